"""What is to be delivered, and what is believed of where it is, in the arrays that rollouts read."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from workbench.planning.problem import ways_of
from workbench.planning.rollouts import Situation, onward_costs
from workbench.planning.strategy import View
from workbench.planning.tasks import Delivered
from workbench.search.candidates import choose
from workbench.search.places import Places, places
from workbench.search.remaining import still_missing_by_subset, unconditioned
from workbench.worlds.house import ContainerId, LocationId

Array = npt.NDArray[np.float64]

MOST_WANTS = 5
CANDIDATES = 10
"""Of each type in the rollouts' own Eq. 1."""

MOST_CHANCE = 1 - 1e-9


@dataclass(frozen=True, slots=True, kw_only=True)
class Delivery:
    """A view whose goal is to deliver things of different types, unprepared.

    Attributes:
        wants: what the goal names, once each.
        containers: unsearched ones that can be reached.
        situation: the same in arrays.
    """

    wants: tuple[Delivered, ...]
    containers: tuple[ContainerId, ...]
    situation: Situation

    @property
    def open(self) -> tuple[int, ...]:
        """The wants that are neither met nor in hand."""
        s = self.situation
        return tuple(k for k in range(len(self.wants)) if not s.done >> k & 1 and k != s.hand)


def delivery_of(view: View) -> Delivery | None:
    """The view as a delivery; None for what rollouts do not cover.

    That is a thing to be held at the end, two of one type, more than MOST_WANTS, something else in hand, a place out
    of reach, or no container left to look into.
    """
    knowledge, travel = view.knowledge, view.knowledge.travel
    ways = ways_of(view.task.goal)
    named = tuple(dict.fromkeys(want for way in ways for want in way))
    wants = tuple(want for want in named if isinstance(want, Delivered))
    if len(wants) < len(named):
        return None
    types = tuple(want.item_type for want in wants)
    held = knowledge.holding
    if len(set(types)) < len(types) or len(wants) > MOST_WANTS or (held is not None and held.type not in types):
        return None
    here = places(view.belief.only(types), travel, origins=(knowledge.robot_at,), targets=())
    if not here.containers or not all(travel.reaches(want.at) for want in wants):
        return None
    done = sum(1 << k for k, want in enumerate(wants) if _is_met(want, view))
    hand = -1 if held is None else types.index(held.type)
    if hand >= 0 and done >> hand & 1:
        return None
    standing = [[travel.index(at) for at, _ in knowledge.where(t) if travel.reaches(at)] for t in types]
    exists = [not view.task.available or t in view.task.available for t in types]
    sought = np.array([e and not s and k != hand for k, (e, s) in enumerate(zip(exists, standing, strict=True))])
    situation = _situation(
        view,
        here,
        targets=np.array([travel.index(want.at) for want in wants], dtype=np.int64),
        ways=np.array([sum(1 << wants.index(w) for w in set(way)) for way in ways], dtype=np.int64),
        done=done,
        hand=hand,
        standing=standing,
        sought=sought,
    )
    return Delivery(wants=wants, containers=here.containers, situation=situation)


def _is_met(want: Delivered, view: View) -> bool:
    return any(item.type == want.item_type for item in view.knowledge.items_at.get(want.at, ()))


def _situation(
    view: View,
    here: Places,
    *,
    targets: npt.NDArray[np.int64],
    ways: npt.NDArray[np.int64],
    done: int,
    hand: int,
    standing: list[list[int]],
    sought: npt.NDArray[np.bool_],
) -> Situation:
    travel, costs = view.knowledge.travel, view.costs
    wants, n = here.probability.shape
    at = np.array([travel.index(LocationId(c)) for c in here.containers], dtype=np.int64)
    to_m = travel.metres[at[:, None], targets]
    count = min(CANDIDATES, n)
    known = np.zeros((wants, max(map(len, standing)) + n), dtype=np.int64)
    candidates, number = np.zeros((wants, count), dtype=np.int64), np.full((wants, n), -1)
    missing, onward = np.ones((wants, 1 << count)), np.zeros((wants, 1 << count, count))
    chance, beyond = np.zeros((wants, n)), np.zeros(wants)
    for k in range(wants):
        known[k, : len(standing[k])] = standing[k]
        if not sought[k]:
            chance[k] = 0.0 if k == hand or done >> k & 1 else np.minimum(here.probability[k], MOST_CHANCE)
            continue
        p = here.probability[k : k + 1]
        chance[k] = np.minimum(unconditioned(p, "marginal")[0], MOST_CHANCE)
        chosen = choose(p, here.from_m[0], to_m[:, k], limit=count, ranking="worth")
        candidates[k], number[k, chosen[0]] = chosen[0], np.arange(count)
        missing[k] = still_missing_by_subset(p, chosen, "marginal")[0]
        beyond[k] = _beyond(chance[k], chosen[0], here.between_m, to_m[:, k]) + costs.manipulation
        between_m = np.ascontiguousarray(here.between_m[np.ix_(chosen[0], chosen[0])])
        found = costs.manipulation + to_m[chosen[0], k]
        onward[k] = onward_costs(missing[k], between_m, found, beyond[k], float(costs.search))
    return Situation(
        metres=travel.metres,
        containers=at,
        targets=targets,
        ways=ways,
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


def _beyond(chance: Array, chosen: npt.NDArray[np.intp], between_m: Array, to_m: Array) -> float:
    """A rough cost of going on among the containers that are no candidates: two in five of them are looked into."""
    others = np.setdiff1d(np.arange(len(chance)), chosen)
    if not len(others):
        return 0.0
    weight = chance[others] + 1e-9
    legs = 0.5 * float(np.median(between_m[np.ix_(others, others)])) * max(1.0, 0.4 * len(others))
    return float(weight @ to_m[others] / weight.sum()) + legs
