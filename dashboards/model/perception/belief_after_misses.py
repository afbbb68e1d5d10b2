"""What is left of a belief in containers whose looks may have missed the item in focus."""

from __future__ import annotations

from bisect import bisect_right
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np

from workbench.arrays import Floats
from workbench.beliefs.after_looks import posterior_after_misses
from workbench.caches import PerObject
from workbench.log_schema.events import BeliefUpdate, Observation
from workbench.worlds.house import ContainerId

if TYPE_CHECKING:
    from dashboards.model.timeline import Timeline


@dataclass(frozen=True, slots=True, kw_only=True)
class _Left:
    """From a stamp on, the probability that an item is in a container after all; NaN once it was found there."""

    stamp_ns: int
    container: int
    probability: float


_LEFT: PerObject[str, tuple[_Left, ...]] = PerObject(64)


def can_miss(timeline: Timeline) -> bool:
    """Whether some look of a run could miss what is there."""
    return any(seen.look is not None for seen in timeline.run.observations)


def left_after_misses(timeline: Timeline, focus: str, stamp_ns: int) -> Floats:
    """For each container, the probability that the item is there though looks did not show it; float64 (n,).

    NaN where nobody has looked, where looks show everything, and where the item was found. Bayes after a look, with
    the look's p_detect, and then what the decisions of the run believe, as long as they count the container.
    """
    left = np.full(len(timeline.plan.containers), np.nan)
    changes = _LEFT.of(timeline).get(focus, lambda: _changes(timeline, focus))
    for change in changes[: bisect_right(changes, stamp_ns, key=lambda change: change.stamp_ns)]:
        left[change.container] = change.probability
    return left


def _changes(timeline: Timeline, focus: str) -> tuple[_Left, ...]:
    """Every change of what is left, in order."""
    if not can_miss(timeline):
        return ()
    index: dict[ContainerId, int] = {c.id: i for i, c in enumerate(timeline.plan.containers)}
    looks = [o for o in timeline.run.observations if o.look is not None and ContainerId(o.container) in index]
    beliefs = [b for b in timeline.run.beliefs if focus in b.item_types]
    changes: list[_Left] = []
    for container in dict.fromkeys(look.container for look in looks):
        here = [look for look in looks if look.container == container]
        changes += _of_container(index[ContainerId(container)], container, focus, here, beliefs)
    return tuple(sorted(changes, key=lambda change: change.stamp_ns))


def _of_container(
    number: int, container: str, focus: str, looks: list[Observation], beliefs: list[BeliefUpdate]
) -> list[_Left]:
    # At one stamp a look comes before the belief that rests on it.
    events = sorted([*looks, *(b for b in beliefs if container in b.containers)], key=lambda event: event.stamp.ns)
    believed, looked = float("nan"), False
    changes: list[_Left] = []
    for event in events:
        if isinstance(event, BeliefUpdate):
            believed = event.probability[event.item_types.index(focus)][event.containers.index(container)]
        else:
            if any(item.type == focus for item in event.items):
                changes.append(_Left(stamp_ns=event.stamp.ns, container=number, probability=float("nan")))
                return changes
            p_detect = _p_detect(event, focus)
            looked = looked or p_detect < 1
            if not np.isnan(believed):
                believed = float(posterior_after_misses(np.array(believed), np.array(1.0 - p_detect)))
        if looked:
            changes.append(_Left(stamp_ns=event.stamp.ns, container=number, probability=believed))
    return changes


def _p_detect(seen: Observation, focus: str) -> float:
    look = seen.look
    return dict(zip(look.item_types, look.p_detect, strict=True)).get(focus, 1.0) if look is not None else 1.0
