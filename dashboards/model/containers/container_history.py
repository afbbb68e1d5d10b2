"""One container in one run: what it held and when that was seen, and what each decision made of it."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass

from dashboards.model.belief_series import Series
from dashboards.model.containers.fruitless_looks import FruitlessLooks, fruitless_looks
from dashboards.model.first_stop_costs import FirstLook, first_looks
from dashboards.model.timeline import NEVER, DecisionFrame, Timeline
from workbench.log_schema.events import SeenItem
from workbench.planning.tasks import goal_types
from workbench.worlds.house import Container, LocationId
from workbench.worlds.names import readable_name

MAX_DECISIONS = 40
"""Decisions that are explained, at most: the last ones up to the moment."""


@dataclass(frozen=True, slots=True, kw_only=True)
class ItemCount:
    """Items of one type in a container; taken: how many of them the robot has picked up by the moment."""

    item_type: str
    count: int
    taken: int
    wanted: bool
    """Whether the task's goal names the type."""


@dataclass(frozen=True, slots=True, kw_only=True)
class Consideration:
    """What one decision made of the container.

    Attributes:
        probability: of finding the item in focus there; None where the belief has no such entry.
        rank: in the intended order of search, 1 first; 0 for a container that is not in it.
        first: the container that the decision looked into first; "" for a decision without a search.
        cost_here, cost_taken: expected costs of the search with a look here first, and with the first look that was
            taken; None where the log does not show it.
    """

    number: int
    stamp_ns: int
    probability: float | None
    rank: int
    first: str
    cost_here: float | None
    cost_taken: float | None


@dataclass(frozen=True, slots=True, kw_only=True)
class ContainerHistory:
    """A container as one moment of a run shows it.

    Attributes:
        room: the kind of its room, as the floor plan names it.
        reachable: whether the robot can stand at it.
        distance_m: metres from where the robot stood at the decision in force; None where that is unknown.
        known: whether its contents were known before the run began.
        searched_ns: when it was searched in this run (also later than the moment); None for never.
        in_passing: whether it was not searched then, but seen by a robot that passed it.
        contents: what was seen in it by the moment; None while it is unopened.
        truth: what it held in truth, at the start; None unless asked for and recorded.
        belief: (stamp, probability of the item in focus) at each decision of the whole run that has one.
        in_vain: looks that did not show the item in focus and may have missed it; None where there are none.
        considerations: the decisions up to the moment while it was unopened, the last first.
    """

    container: Container
    room: str
    reachable: bool
    distance_m: float | None
    known: bool
    searched_ns: int | None
    in_passing: bool
    contents: tuple[ItemCount, ...] | None
    truth: tuple[ItemCount, ...] | None
    belief: Series
    in_vain: FruitlessLooks | None
    considerations: tuple[Consideration, ...]


def container_history(
    timeline: Timeline,
    index: int,
    stamp_ns: int,
    *,
    focus: str,
    truth: Mapping[str, Sequence[SeenItem]] | None = None,
) -> ContainerHistory:
    """What is known of the index-th container of the plan at a moment.

    Args:
        focus: the item type whose belief is shown.
        truth: the true contents of every container, where they were asked for.

    Raises:
        IndexError: there is no such container.
    """
    container = timeline.plan.containers[index]
    searched_ns = int(timeline.searched_ns[index])
    known = bool(timeline.known[index])
    seen = known or searched_ns <= stamp_ns
    at = timeline.decision_at(stamp_ns)
    plan = timeline.decisions[at].plan if at >= 0 else None
    here, travel = LocationId(container.id), timeline.run.place.travel
    return ContainerHistory(
        container=container,
        room=timeline.plan.room(container.room).kind,
        reachable=travel.reaches(here),
        distance_m=travel.between(LocationId(plan.robot_at), here) if plan is not None else None,
        known=known,
        searched_ns=searched_ns if searched_ns != NEVER else None,
        in_passing=any(
            o.passing is not None and o.container == container.id and o.stamp.ns == searched_ns
            for o in timeline.run.observations
        ),
        contents=_counts(timeline, container.id, timeline.contents.get(container.id, ()), stamp_ns) if seen else None,
        truth=None if truth is None else _counts(timeline, container.id, truth.get(container.id, ()), stamp_ns),
        belief=_belief(timeline, container.id, focus),
        in_vain=fruitless_looks(timeline, container.id, focus, stamp_ns),
        considerations=()
        if known
        else _considerations(timeline, container.id, min(stamp_ns, searched_ns - 1), focus),
    )


def wanted_words(timeline: Timeline, items: Sequence[SeenItem]) -> str:
    """The items that the goal names among some, in words: "egg, mug"; "" for none."""
    wanted = set(goal_types(timeline.run.task.goal))
    return ", ".join(sorted({readable_name(item.type) for item in items if item.type in wanted}))


def _counts(timeline: Timeline, container: str, items: Sequence[SeenItem], stamp_ns: int) -> tuple[ItemCount, ...]:
    """Items by type, those of the goal first."""
    picked = {
        item
        for action in timeline.actions
        if action.action == "pick" and action.success and action.target == container and action.stamp.ns <= stamp_ns
        for item in action.items
    }
    wanted = set(goal_types(timeline.run.task.goal))
    by_type: dict[str, list[SeenItem]] = {}
    for item in items:
        by_type.setdefault(item.type, []).append(item)
    counts = [
        ItemCount(
            item_type=item_type,
            count=len(of_type),
            taken=sum(item.id in picked for item in of_type),
            wanted=item_type in wanted,
        )
        for item_type, of_type in by_type.items()
    ]
    return tuple(sorted(counts, key=lambda c: (not c.wanted, c.item_type)))


def _belief(timeline: Timeline, container: str, focus: str) -> Series:
    found = [(frame.stamp_ns, _probability(frame, container, focus)) for frame in timeline.decisions]
    return [(stamp, p) for stamp, p in found if p is not None]


def _probability(frame: DecisionFrame, container: str, focus: str) -> float | None:
    update = frame.belief
    if update is None or focus not in update.item_types or container not in update.containers:
        return None
    return float(update.probability[update.item_types.index(focus)][update.containers.index(container)])


def _considerations(timeline: Timeline, container: str, until_ns: int, focus: str) -> tuple[Consideration, ...]:
    frames = [frame for frame in timeline.decisions if frame.stamp_ns <= until_ns][-MAX_DECISIONS:]
    return tuple(_consideration(timeline, frame, container, focus) for frame in reversed(frames))


def _consideration(timeline: Timeline, frame: DecisionFrame, container: str, focus: str) -> Consideration:
    order = [stop.container for stop in frame.plan.search_order] if frame.plan is not None else []
    looks = first_looks(timeline, frame) if container in order else ()
    return Consideration(
        number=frame.number,
        stamp_ns=frame.stamp_ns,
        probability=_probability(frame, container, focus),
        rank=order.index(container) + 1 if container in order else 0,
        first=order[0] if order else "",
        cost_here=_cost(looks, lambda look: look.container == container),
        cost_taken=_cost(looks, lambda look: look.chosen),
    )


def _cost(looks: Sequence[FirstLook], which: Callable[[FirstLook], bool]) -> float | None:
    return next((look.cost for look in looks if which(look)), None)
