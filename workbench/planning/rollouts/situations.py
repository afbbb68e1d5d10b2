"""The state of a delivery task (what is wanted, and the beliefs about it) as the arrays that rollouts use."""

from __future__ import annotations

from dataclasses import dataclass
from functools import lru_cache
from typing import NamedTuple

import numpy as np

from workbench.arrays import Bools, Floats, Indices, Ints
from workbench.planning.problem import goal_alternatives
from workbench.planning.rollouts.kernels import DeliveryState, remaining_cost_table
from workbench.planning.strategy import View
from workbench.planning.tasks import Delivered
from workbench.search.candidates import choose
from workbench.search.places import SearchSpace, search_space
from workbench.search.remaining import still_missing_by_subset, unconditioned
from workbench.tolerances import RELATIVE
from workbench.worlds.house import ContainerId

MAX_WANTS = 5
CANDIDATES = 10
"""Candidates per type in Eq. 1 within rollouts."""

MAX_PROBABILITY = 1 - 1e-9

SEARCH_CACHE_SIZE = 256
"""Number of cached searches for one item, about 0.1 MB each."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Delivery:
    """A view whose goal is to deliver unprepared items of different types.

    Attributes:
        wants: the distinct wants of the goal.
        containers: the reachable unsearched containers.
        situation: the same as arrays.
    """

    wants: tuple[Delivered, ...]
    containers: tuple[ContainerId, ...]
    situation: DeliveryState

    @property
    def open(self) -> tuple[int, ...]:
        """Indices of the wants that are neither met nor in hand."""
        return _left(len(self.wants), self.situation.done, self.situation.hand)


def delivery_of(view: View) -> Delivery | None:
    """The view as a delivery; None if rollouts do not cover it.

    Not covered are: an item to be held at the end, two items of one type, more than MAX_WANTS wants, another item
    in hand, an unreachable target, and no container left to search.
    """
    knowledge, travel = view.knowledge, view.knowledge.travel
    alternatives = goal_alternatives(view.task.goal)
    named = tuple(dict.fromkeys(want for alternative in alternatives for want in alternative))
    wants = tuple(want for want in named if isinstance(want, Delivered))
    if len(wants) < len(named):
        return None
    types = tuple(want.item_type for want in wants)
    held = knowledge.holding
    if len(set(types)) < len(types) or len(wants) > MAX_WANTS or (held is not None and held.type not in types):
        return None
    done = sum(1 << k for k, want in enumerate(wants) if _is_met(want, view))
    hand = -1 if held is None else types.index(held.type)
    if hand >= 0 and done >> hand & 1:
        return None
    believed = view.belief.only(tuple(types[k] for k in _left(len(wants), done, hand)))
    here = search_space(believed, travel, origins=(knowledge.robot_at,), targets=())
    if not here.containers or not all(travel.reaches(want.at) for want in wants):
        return None
    standing = [[travel.index(at) for at, _ in knowledge.where(t) if travel.reaches(at)] for t in types]
    exists = [not view.task.available or t in view.task.available for t in types]
    sought = np.array([e and not s and k != hand for k, (e, s) in enumerate(zip(exists, standing, strict=True))])
    situation = _situation(
        view,
        here,
        targets=np.array([travel.index(want.at) for want in wants], dtype=np.int64),
        alternatives=np.array(
            [sum(1 << wants.index(w) for w in set(alternative)) for alternative in alternatives], dtype=np.int64
        ),
        done=done,
        hand=hand,
        standing=standing,
        sought=sought,
    )
    return Delivery(wants=wants, containers=here.containers, situation=situation)


def _left(wants: int, done: int, hand: int) -> tuple[int, ...]:
    """Which wants are neither met nor in hand."""
    return tuple(k for k in range(wants) if not done >> k & 1 and k != hand)


def _is_met(want: Delivered, view: View) -> bool:
    return any(item.type == want.item_type for item in view.knowledge.items_at.get(want.at, ()))


def _situation(
    view: View,
    here: SearchSpace,
    *,
    targets: Ints,
    alternatives: Ints,
    done: int,
    hand: int,
    standing: list[list[int]],
    sought: Bools,
) -> DeliveryState:
    """The arrays; `here` has a row of probabilities for each want that is left."""
    travel, costs = view.knowledge.travel, view.costs
    wants, n = len(targets), len(here.containers)
    at = travel.rows(here.containers).astype(np.int64)
    to_m = travel.metres[at[:, None], targets]
    count = min(CANDIDATES, n)
    known = np.zeros((wants, max(map(len, standing)) + n), dtype=np.int64)
    candidates, number = np.zeros((wants, count), dtype=np.int64), np.full((wants, n), -1)
    missing, onward = np.ones((wants, 1 << count)), np.zeros((wants, 1 << count, count))
    chance, beyond = np.zeros((wants, n)), np.zeros(wants)
    for k in range(wants):
        known[k, : len(standing[k])] = standing[k]
    for k, probability in zip(_left(wants, done, hand), here.probability, strict=True):
        if not sought[k]:
            chance[k] = np.minimum(_possible(probability), MAX_PROBABILITY)
            continue
        lengths = here.from_m[0].tobytes(), to_m[:, k].tobytes(), here.between_m.tobytes()
        one = _missing_item_rows(probability.tobytes(), *lengths, look=costs.search, handle=costs.manipulation)
        chance[k], candidates[k], missing[k], onward[k], beyond[k] = one
        number[k, one.candidates] = np.arange(count)
    return DeliveryState(
        metres=travel.metres,
        containers=at,
        targets=targets,
        alternatives=alternatives,
        done=done,
        hand=hand,
        robot=travel.index(view.knowledge.robot_at),
        places=known,
        known=np.array([len(each) for each in standing], dtype=np.int64),
        sought=sought,
        chance=chance,
        candidates=candidates,
        number=number.astype(np.int64),
        missing=missing,
        onward=onward,
        beyond=beyond,
        look=float(costs.search),
        handle=float(costs.manipulation),
    )


class _MissingItemRows(NamedTuple):
    """The rows of a DeliveryState for one missing item."""

    chance: Floats
    candidates: Indices
    missing: Floats
    onward: Floats
    beyond: float


@lru_cache(maxsize=SEARCH_CACHE_SIZE)
def _missing_item_rows(
    p: bytes, from_m: bytes, to_m: bytes, between_m: bytes, *, look: float, handle: float
) -> _MissingItemRows:
    """The search arrays of one missing item, cached: many states share them and differ only in the other items.

    Args:
        p, from_m, to_m, between_m: float64 bytes over the unsearched containers (between_m over all pairs).
    """
    chances, from_here, to_target = (np.frombuffer(row) for row in (p, from_m, to_m))
    n = len(chances)
    between = np.frombuffer(between_m).reshape(n, n)
    chosen = choose(chances[None], from_here, to_target, limit=min(CANDIDATES, n), ranking="worth")
    chance = np.minimum(unconditioned(_possible(chances)[None], "marginal")[0], MAX_PROBABILITY)
    missing = still_missing_by_subset(chances[None], chosen, "marginal")[0]
    beyond = _cost_beyond_candidates(chance, chosen[0], between, to_target) + handle
    lengths = np.ascontiguousarray(between[np.ix_(chosen[0], chosen[0])])
    onward = remaining_cost_table(missing, lengths, handle + to_target[chosen[0]], beyond, float(look))
    return _MissingItemRows(chance=chance, candidates=chosen[0], missing=missing, onward=onward, beyond=beyond)


def _possible(chances: Floats) -> Floats:
    """The chances without those that are, beside the greatest, no more than a rounding."""
    return np.where(chances > RELATIVE * chances.max(initial=0.0), chances, 0.0)


def _cost_beyond_candidates(chance: Floats, chosen: Indices, between_m: Floats, to_m: Floats) -> float:
    """A rough cost of searching on beyond the candidates, assuming that two in five of the other containers are
    searched."""
    is_other = np.ones(len(chance), dtype=np.bool_)
    is_other[chosen] = False
    others = np.flatnonzero(is_other)
    if not len(others):
        return 0.0
    weight = chance[others] + 1e-9
    legs = 0.5 * float(np.median(between_m[np.ix_(others, others)])) * max(1.0, 0.4 * len(others))
    return float(weight @ to_m[others] / weight.sum()) + legs
