"""The combined knowledge of the logs of one place at their end, for a run that resumes from them."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from dataclasses import dataclass, field
from math import hypot
from types import MappingProxyType

from recorders.spot.run.resumed_knowledge import EarlierLog, ResumedKnowledge
from replayers.runs.correcting import LEFT_OUT, corrections_of
from replayers.runs.gaps import gaps_of
from replayers.runs.run import Run
from workbench.errors import BadValue, InputError
from workbench.execution.events import RunStatus
from workbench.log_schema.corrections import Correction
from workbench.log_schema.events import ActionFinished, ItemSighting, Observation
from workbench.planning.tasks import AllOf
from workbench.worlds.house import ContainerId, FloorPlan, Item, ItemId, ItemType, LocationId
from workbench.worlds.travel import TravelCosts

SAME_PLACE_M = 0.3
"""Distance in metres within which a container of two logs of a place stands where it stood."""


class NothingToResume(InputError):
    """The log's task is done, or it has none."""

    def __init__(self, run: Run, why: str) -> None:
        super().__init__(f"{run.path}: {why}. Give the log of a run that was interrupted, or lios spot run.")


class OtherPlace(InputError):
    """A log is of another place than the site."""

    def __init__(self, run: Run, why: str) -> None:
        super().__init__(f"{run.path}: it is of another place ({why}). Give logs of the site that --site names.")


class HasGaps(InputError):
    """Messages within the log are missing, so that it does not show where things are now."""

    def __init__(self, run: Run, lost: str) -> None:
        super().__init__(
            f"{run.path}: the log is not whole ({lost}), so it does not show where things are. Leave it out."
        )


@dataclass(slots=True)
class _Whereabouts:
    """Where items are, as the logs are read in the order of time.

    Attributes:
        items: those of the site that have a tag.
        known: contents of containers that were looked into. put: items put down, or seen in passing, where nobody
            looked.
        held: the item in the gripper, and where it was taken from.
    """

    items: tuple[Item, ...] = ()
    known: dict[ContainerId, tuple[Item, ...]] = field(default_factory=dict)
    put: dict[ContainerId, tuple[Item, ...]] = field(default_factory=dict)
    held: Item | None = None
    notes: list[str] = field(default_factory=list)

    def forget(self, items: Iterable[Item]) -> None:
        """Take items away from wherever they were."""
        gone = {item.id for item in items}
        for places in (self.known, self.put):
            for place, there in places.items():
                places[place] = tuple(item for item in there if item.id not in gone)
        if self.held is not None and self.held.id in gone:
            self.held = None

    def look(self, seen: Observation) -> None:
        items, place = tuple(_item(i.id, i.type) for i in seen.items), ContainerId(seen.container)
        before = self.known.get(place, ())
        self.forget(items)
        if seen.look is not None:  # a look that can miss: what it does not show may be there still
            items = tuple({i.id: i for i in (*before, *items)}.values())
        self.known[place] = items
        self.put.pop(place, None)

    def correct(self, correction: Correction) -> None:
        """Add what a person says that the looks missed. Of an item named by its type alone the tag is sought by its
        number: where several would do, the robot has to look again."""
        item, place = correction.item, correction.container
        who = correction.author or "a person"
        if correction.names_type_only:
            placed = {i.id for there in (*self.known.values(), *self.put.values()) for i in there}
            free = [i for i in self.items if i.type == item.type and i.id not in placed]
            if len(free) > 1:
                self.known.pop(place, None)
                names = ", ".join(i.id for i in free)
                self.notes.append(f"{who} says that {correction.words}, not which one ({names}): looked into again")
                return
            item = free[0] if free else item
        self.forget((item,))
        self.known[place] = (*self.known.get(place, ()), item)
        self.notes.append(f"{who} says that {item.id} was in {place}, which no look showed: taken as certain")

    def act(self, action: ActionFinished) -> None:
        items = tuple(_item(i, t) for i, t in zip(action.items, action.item_types, strict=False))
        if action.action == "pick" and (action.success or not action.item_remains):
            self.forget(items)
            self.held = items[0] if action.success and items else self.held
        elif action.action == "place" and action.success:
            self.put_down(ContainerId(action.target), items or ((self.held,) if self.held else ()))
        elif action.action not in ("pick", "place", "move", "search") and action.success:
            self.notes.append(f"not taken over: {action.action} {', '.join(action.items)}")

    def sight(self, seen: ItemSighting) -> None:
        """Add an item that was seen in passing; what else is in its container, nobody saw."""
        self.put_down(ContainerId(seen.container), (_item(seen.item.id, seen.item.type),))

    def put_down(self, place: ContainerId, items: tuple[Item, ...]) -> None:
        self.forget(items)
        places = self.known if place in self.known else self.put
        places[place] = (*places.get(place, ()), *items)


def _item(item_id: str, item_type: str) -> Item:
    return Item(id=ItemId(item_id), type=ItemType(item_type))


def known_from_logs(
    runs: Sequence[Run], plan: FloorPlan, travel: TravelCosts, *, items: Iterable[Item] = (), held_at: str = ""
) -> ResumedKnowledge:
    """What logs know together, with the corrections that people made in them.

    Args:
        runs: the interrupted run first, then other sessions of the same place, in any order.
        plan, travel: the place as it is surveyed now.
        items: its items that have a tag.
        held_at: the container in which a person put what the interrupted run ended with in its gripper.

    Raises:
        NothingToResume, OtherPlace, HasGaps: a log cannot be gone on from.
        BadValue: `held_at` is missing, not needed, or no container.
    """
    interrupted = runs[0]
    if interrupted.task.goal == AllOf(parts=()):
        raise NothingToResume(interrupted, "it has no task")
    if interrupted.outcome is not None and interrupted.outcome.status == RunStatus.DONE:
        raise NothingToResume(interrupted, "its task is done")
    where = _Whereabouts(items=tuple(items))
    for run in sorted(runs, key=lambda run: run.info.started.ns):
        _check(run, plan)
        if where.held is not None:
            where.notes.append(f"it is not known where {where.held.id} is")
            where.held = None
        _read(run, where)
    if where.held is not None or held_at:
        _put_held(interrupted, where, plan, held_at)
    reached = {c.id for c in plan.containers if travel.reaches(LocationId(c.id))}
    return ResumedKnowledge(
        logs=tuple(EarlierLog(log=run.path.name, run_id=run.info.run_id, sha256=run.sha256) for run in runs),
        known=MappingProxyType({c: where.known[c] for c in sorted(where.known)}),
        put=MappingProxyType({c: items for c, items in sorted(where.put.items()) if items and c in reached}),
        notes=tuple(where.notes),
    )


def _put_held(run: Run, where: _Whereabouts, plan: FloorPlan, held_at: str) -> None:
    """The item that the logs end with in the gripper is where a person put it."""
    names = [container.id for container in plan.containers]
    if where.held is None:
        raise BadValue("--held-at", held_at, f"left out: {run.path.name} does not end with an item in the gripper")
    if held_at not in names:
        what = f"the container into or onto which {where.held.id} was put, which the log ends with in the gripper: "
        raise BadValue("--held-at", held_at or None, what + ", ".join(names))
    where.put_down(ContainerId(held_at), (where.held,))


def _read(run: Run, where: _Whereabouts) -> None:
    """The looks and actions of a run by time; a look at the start comes first, and a search before what it showed.

    What a person says that the looks missed was never carried, so at the end of the run it is where that person says.
    """
    events = [((not o.known_at_start, o.stamp.ns, 1), o) for o in run.observations]
    acted = [((True, a.stamp.ns, 0), a) for a in run.actions]
    sighted = [((True, s.stamp.ns, 1), s) for s in run.sightings]
    for _, event in sorted([*events, *sighted, *acted], key=lambda entry: entry[0]):
        if isinstance(event, Observation):
            where.look(event)
        elif isinstance(event, ItemSighting):
            where.sight(event)
        else:
            where.act(event)
    used, notes = corrections_of(run)
    for correction in used:
        where.correct(correction)
    where.notes += [note for note in notes if note.startswith(LEFT_OUT)]


def _check(run: Run, plan: FloorPlan) -> None:
    """Raises OtherPlace or HasGaps."""
    lost = gaps_of(run).lost
    if lost:
        raise HasGaps(run, "; ".join(lost))
    then, now = run.place.plan, plan
    ours, theirs = {c.id for c in now.containers}, {c.id for c in then.containers}
    if ours != theirs:
        raise OtherPlace(run, f"containers differ: {', '.join(sorted(ours ^ theirs)[:4])}")
    for container in then.containers:
        was, is_now = container.pose, now.container(container.id).pose
        moved_m = hypot(was.x_m - is_now.x_m, was.y_m - is_now.y_m)
        if moved_m > SAME_PLACE_M:
            raise OtherPlace(run, f"{container.id} stood {moved_m:.1f} m away")
