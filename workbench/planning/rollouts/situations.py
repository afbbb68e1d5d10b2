"""The state of a delivery task (what is wanted, and the beliefs about it) as the arrays that rollouts use."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from workbench.arrays import Floats, Ints
from workbench.beliefs.belief import Belief
from workbench.caches import PerObject
from workbench.planning.problem import goal_alternatives
from workbench.planning.rollouts.delivery_state import DeliveryState
from workbench.planning.rollouts.find_tables import CANDIDATES, MAX_PROBABILITY, FindTables, find_tables, possible
from workbench.planning.strategy import View
from workbench.planning.tasks import Delivered, Goal
from workbench.search.places import reachable
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.travel import TravelCosts

MAX_WANTS = 5


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


@dataclass(frozen=True, slots=True, kw_only=True)
class _Wants:
    """What a goal wants in a house; `targets` and `alternatives` as of DeliveryState."""

    wants: tuple[Delivered, ...]
    types: tuple[ItemType, ...]
    targets: Ints
    alternatives: Ints


def delivery_of(view: View) -> Delivery | None:
    """The view as a delivery; None if rollouts do not cover it.

    Not covered are: an item to be held at the end, two items of one type, more than MAX_WANTS wants, another item
    in hand, an unreachable target, and no container left to search.
    """
    knowledge, travel, goal = view.knowledge, view.knowledge.travel, view.task.goal
    wanted = _WANTS.of(travel).get(goal, lambda: _wants_of(goal, travel))
    held = knowledge.holding
    if wanted is None or (held is not None and held.type not in wanted.types):
        return None
    done = sum(1 << k for k, want in enumerate(wanted.wants) if _is_met(want, view))
    hand = -1 if held is None else wanted.types.index(held.type)
    if hand >= 0 and done >> hand & 1:
        return None
    containers, columns = reachable(view.belief.containers, travel)
    if not containers:
        return None
    situation = _situation(view, wanted, containers, columns, done=done, hand=hand)
    return Delivery(wants=wanted.wants, containers=containers, situation=situation)


def _wants_of(goal: Goal, travel: TravelCosts) -> _Wants | None:
    """None where rollouts do not cover the goal."""
    alternatives = goal_alternatives(goal)
    named = tuple(dict.fromkeys(want for alternative in alternatives for want in alternative))
    wants = tuple(want for want in named if isinstance(want, Delivered))
    types = tuple(want.item_type for want in wants)
    if len(wants) < len(named) or len(set(types)) < len(types) or len(wants) > MAX_WANTS:
        return None
    if not all(travel.reaches(want.at) for want in wants):
        return None
    masks = [sum(1 << named.index(want) for want in set(alternative)) for alternative in alternatives]
    return _Wants(
        wants=wants,
        types=types,
        targets=np.array([travel.index(want.at) for want in wants], dtype=np.int64),
        alternatives=np.array(masks, dtype=np.int64),
    )


_WANTS: PerObject[Goal, _Wants | None] = PerObject(64)


def _left(wants: int, done: int, hand: int) -> tuple[int, ...]:
    """Which wants are neither met nor in hand."""
    return tuple(k for k in range(wants) if not done >> k & 1 and k != hand)


def _is_met(want: Delivered, view: View) -> bool:
    return any(item.type == want.item_type for item in view.knowledge.items_at.get(want.at, ()))


def _situation(
    view: View,
    wanted: _Wants,
    containers: tuple[ContainerId, ...],
    columns: list[int] | None,
    *,
    done: int,
    hand: int,
) -> DeliveryState:
    """The arrays; of the belief's containers those in `columns`, and of its types those of the wants that are left.

    It reads no other rows: a decision rests on what it reads.
    """
    knowledge, travel, costs = view.knowledge, view.knowledge.travel, view.costs
    wants, n, at, robot = (
        len(wanted.wants),
        len(containers),
        travel.rows(containers),
        travel.index(knowledge.robot_at),
    )
    standing = [[travel.index(at) for at, _ in knowledge.where(t) if travel.reaches(at)] for t in wanted.types]
    places = np.zeros((wants, max(map(len, standing)) + n), dtype=np.int64)
    chance, find, tables = np.zeros((wants, n)), np.full(wants, -1), list[FindTables]()
    for k, there in enumerate(standing):
        places[k, : len(there)] = there
    available = view.task.available
    for k in _left(wants, done, hand):
        item_type = wanted.types[k]
        row = _chances(view.belief, item_type)
        row = row if columns is None else row[columns]
        if standing[k] or (available and item_type not in available):
            chance[k] = np.minimum(possible(row), MAX_PROBABILITY)
            continue
        one = find_tables(row, at, robot, int(wanted.targets[k]), travel, costs)
        chance[k], find[k] = one.chance, len(tables)
        tables.append(one)
    candidates, missing, onward, beyond = _stacked(tables, min(CANDIDATES, n))
    return DeliveryState(
        metres=travel.metres,
        containers=at,
        targets=wanted.targets,
        alternatives=wanted.alternatives,
        done=done,
        hand=hand,
        robot=robot,
        places=places,
        known=np.array([len(each) for each in standing], dtype=np.int64),
        chance=chance,
        find=find,
        candidates=candidates,
        missing=missing,
        onward=onward,
        beyond=beyond,
        look=float(costs.search),
        handle=float(costs.manipulation),
    )


def _chances(belief: Belief, item_type: ItemType) -> Floats:
    """A type's row of the belief, shape (containers,); 0 where it has none."""
    return belief.of(item_type) if item_type in belief.item_types else np.zeros(len(belief.containers))


def _stacked(tables: list[FindTables], count: int) -> tuple[Ints, Floats, Floats, Floats]:
    """One row for each find: its candidates, missing, onward and beyond; the usual one find is not copied."""
    if not tables:
        subsets = 1 << count
        return (
            np.zeros((0, count), dtype=np.int64),
            np.zeros((0, subsets)),
            np.zeros((0, subsets, count)),
            np.zeros(0),
        )
    beyond = np.array([one.beyond for one in tables])
    if len(tables) == 1:
        return tables[0].candidates[None], tables[0].missing[None], tables[0].onward[None], beyond
    return (
        np.stack([one.candidates for one in tables]),
        np.stack([one.missing for one in tables]),
        np.stack([one.onward for one in tables]),
        beyond,
    )
