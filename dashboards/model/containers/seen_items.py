"""Places of the items that a run has seen by a moment: in their container, until they are taken."""

from __future__ import annotations

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING

from workbench.caches import PerObject
from workbench.planning.tasks import goal_types
from workbench.worlds.house import ContainerId

if TYPE_CHECKING:
    from dashboards.model.timeline import Timeline


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemPlace:
    """One item that was seen.

    Attributes:
        container: where it is, as an index into the plan's containers.
        wanted: whether the task's goal names its type.
    """

    item: str
    item_type: str
    container: int
    wanted: bool


def items_seen(timeline: Timeline, stamp_ns: int) -> tuple[ItemPlace, ...]:
    """The items seen by a moment, by container, those of the goal first within each; without those in the hand.

    Computed once for each look, pick or place of a timeline that is in use.
    """
    moves = _MOVES.of(timeline).get(0, lambda: _moves(timeline))
    count = bisect_right(moves, stamp_ns, key=lambda move: move.stamp_ns)
    return _PLACES.of(timeline).get(count, lambda: _places(timeline, moves[:count]))


@dataclass(frozen=True, slots=True, kw_only=True)
class _Move:
    """Items that are from now on in a container; in the robot's hand where it is None."""

    stamp_ns: int
    items: tuple[tuple[str, str], ...]
    """Each with its type."""
    container: int | None


_MOVES: PerObject[int, tuple[_Move, ...]] = PerObject(2)
_PLACES: PerObject[int, tuple[ItemPlace, ...]] = PerObject(64)


def _moves(timeline: Timeline) -> tuple[_Move, ...]:
    index: dict[ContainerId, int] = {c.id: i for i, c in enumerate(timeline.plan.containers)}
    moves = [
        _Move(
            stamp_ns=timeline.start_ns if seen.known_at_start else seen.stamp.ns,
            items=tuple((item.id, item.type) for item in seen.items),
            container=index[ContainerId(seen.container)],
        )
        for seen in timeline.run.observations
        if ContainerId(seen.container) in index
    ]
    moves += [
        _Move(
            stamp_ns=seen.stamp.ns,
            items=((seen.item.id, seen.item.type),),
            container=index[ContainerId(seen.container)],
        )
        for seen in timeline.run.sightings
        if ContainerId(seen.container) in index
    ]
    for action in timeline.actions:
        if action.success and action.action in ("pick", "place"):
            held = action.action == "pick"
            moves.append(
                _Move(
                    stamp_ns=action.stamp.ns,
                    items=tuple(zip(action.items, action.item_types, strict=False)),
                    container=None if held else index.get(ContainerId(action.target)),
                )
            )
    return tuple(sorted(moves, key=lambda move: move.stamp_ns))


def _places(timeline: Timeline, moves: Sequence[_Move]) -> tuple[ItemPlace, ...]:
    at: dict[str, tuple[str, int]] = {}
    for move in moves:
        for item, item_type in move.items:
            if move.container is None:
                at.pop(item, None)
            else:
                at[item] = (item_type, move.container)
    wanted = set(goal_types(timeline.run.task.goal))
    places = [
        ItemPlace(item=item, item_type=item_type, container=container, wanted=item_type in wanted)
        for item, (item_type, container) in at.items()
    ]
    return tuple(sorted(places, key=lambda p: (p.container, not p.wanted, p.item_type, p.item)))
