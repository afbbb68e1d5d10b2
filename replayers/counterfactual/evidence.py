"""Evidence of a log about its place, certain and open: the basis of every counterfactual.

Certain are the contents, at the start of the run, of containers that were known or searched; the map and the travel
costs; and which actions were refused. Open are the other containers that can be reached: every assignment of contents
to them is a consistent world (docs/replay.md states the assumptions).
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from types import MappingProxyType

from replayers.counterfactual.evidence_rules import (
    IMPUTED,
    OVERLOOKED,
    Deed,
    Leg,
    SeenOnMove,
    chances_of_missing,
    first_belief,
    items_left_in_place,
    looks_in_order,
    refused_looks,
    refused_targets,
    seen_from_start,
    seen_on_moves,
    successful_manipulations,
)
from replayers.runs.contents import contents_at_start, picked_without_look, sighted_at_start
from replayers.runs.correcting import with_corrections
from replayers.runs.gaps import Gaps, StartKnowledge, gaps_of
from replayers.runs.run import Run
from workbench.beliefs.asking.answers import Answer
from workbench.beliefs.memory.memory import Memory
from workbench.errors import Unsupported, first_few
from workbench.log_schema.asking_json import AskingInfo, answers_in, asking_from_settings
from workbench.log_schema.corrections import Correction
from workbench.log_schema.events import ROUNDED_BEFORE, Observation, RunInfo
from workbench.log_schema.memory_json import memory_from_settings
from workbench.log_schema.perception_json import perception_from_settings
from workbench.log_schema.place import Place
from workbench.log_schema.sight_json import sight_from_settings
from workbench.log_schema.tags_in_passing_json import SETTING, tags_from_settings
from workbench.planning.tasks import AllOf, Task
from workbench.search.costs import ActionCosts
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START, ContainerId, Contents, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.perception import PERFECT, Perception
from workbench.worlds.sight.sightings import SightPaths, sight_paths
from workbench.worlds.sight.tags_in_passing import TagsInPassing
from workbench.worlds.travel import TravelCosts

TAGS_NOTE = (
    "its robot turns for tags that it sees in passing: for other strategies, bounds count them as seen and as not "
    "seen, the estimate as not seen"
)


class PartOfRun(Unsupported):
    """One part of a split recording, which shows neither what was before nor what came after it."""

    def __init__(self, run: Run) -> None:
        super().__init__(
            f"{run.path}: one part of a run that was split into several files. "
            "Join them first: lios log merge ALL PARTS -o WHOLE.mcap"
        )


class StartUnknown(Unsupported):
    """A log that lost what the robot knew at the start: no strategy can be run from there."""

    def __init__(self, run: Run, why: str) -> None:
        super().__init__(f"{run.path}: {why}. Replay the log as it was recorded, before it was filtered or damaged.")


class NoTaskAttempted(Unsupported):
    """The log of a session in which no task was attempted: every planner would be done before it began."""

    def __init__(self, run: Run) -> None:
        super().__init__(
            f"{run.path}: no task was tried in it, so there is nothing to replay. "
            "Record a run, or a session with --site and --task."
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class Evidence:
    """What one log makes certain.

    Attributes:
        path, sha256, info, complete: which log; whether it was closed in order.
        gaps: what is missing from it; nothing above rests on that.
        known: containers whose contents the robot knew before it started.
        contents: every container whose contents are certain (the known ones too), as at the start of the run.
        partly: of others, the items that certainly stood there at the start: the robot picked them up where no look
            counts, or saw them in passing. The other contents are open.
        refused_searches: containers that could not be searched, with the reason; they refuse again.
        refused_moves: locations to which every recorded move was refused; they refuse again.
        refused_picks: items of which every recorded pick was refused; they refuse again.
        left: those of them that are still where they were after it (a failed grasp); the others are gone.
        walked, done: legs walked and manipulations made while recording: they tag a step as "logged".
        first_belief: per (item type, container), the first probability that the log holds.
        static_beliefs: whether no later belief of the log differs from the first one about the same pair.
        imputed: containers whose contents nobody saw: the log is of a replay in an imagined world.
        rounded: the log is of a release that rounded beliefs (events.ROUNDED_BEFORE): they differ slightly from what
            the robot believed.
        misses: how many items the recorded looks may have overlooked, at most.
        perception: how surely a look of the run showed what was there, as the robot believed it.
        looks: what each look of the run showed, by container, in order.
        miss_chance: per item type and searched container, the chance that every look there missed it, as the log
            assumes it; 0 where it is not named.
        corrections: what people say was there although no look showed it; `contents` holds it.
        memory: what the robot remembered of earlier runs; None where it remembered nothing.
        asking: how the run's estimator asked, where its answers cost something; None where it asked nobody.
        answers: what it was answered.
        passing: the ways of a robot that sees open furniture in passing; None for one that does not.
        tags: the ways of a robot that stops for the tag of an item that it seeks and sees in passing; None for one
            that does not. Whether it sees one that is in view, the log does not say.
        seen_on_moves: what it saw so while recording, by the number of the move.
        seen_at_start: what of the known is so because it is in view from the start pose, with that pose.
        notes: what was odd and how it is read, one line each.
        open: containers that can be reached and whose contents nobody saw, in the order of the floor plan.
    """

    path: str
    sha256: str
    info: RunInfo
    complete: bool
    gaps: Gaps = field(default_factory=Gaps)
    place: Place
    task: Task
    costs: ActionCosts
    known: Contents
    contents: Contents
    partly: Contents = field(default_factory=lambda: MappingProxyType({}))
    refused_searches: Mapping[ContainerId, str] = field(default_factory=lambda: MappingProxyType({}))
    refused_moves: Mapping[LocationId, str] = field(default_factory=lambda: MappingProxyType({}))
    refused_picks: Mapping[ItemId, str] = field(default_factory=lambda: MappingProxyType({}))
    left: frozenset[ItemId] = frozenset()
    walked: frozenset[Leg] = frozenset()
    done: frozenset[Deed] = frozenset()
    first_belief: Mapping[tuple[str, str], float] = field(default_factory=lambda: MappingProxyType({}))
    static_beliefs: bool = True
    imputed: tuple[ContainerId, ...] = ()
    rounded: bool = False
    misses: int = 0
    perception: Perception = PERFECT
    looks: Mapping[ContainerId, tuple[tuple[Item, ...], ...]] = field(default_factory=lambda: MappingProxyType({}))
    miss_chance: Mapping[tuple[ItemType, ContainerId], float] = field(default_factory=lambda: MappingProxyType({}))
    corrections: tuple[Correction, ...] = ()
    memory: Memory | None = None
    asking: AskingInfo | None = None
    answers: tuple[Answer, ...] = ()
    passing: SightPaths | None = field(default=None, compare=False)
    tags: TagsInPassing | None = field(default=None, compare=False)
    seen_on_moves: Mapping[int, SeenOnMove] = field(default_factory=lambda: MappingProxyType({}))
    seen_at_start: Mapping[ContainerId, Pose] = field(default_factory=lambda: MappingProxyType({}))
    notes: tuple[str, ...] = ()
    open: tuple[ContainerId, ...] = field(init=False, repr=False, compare=False)
    _seen: frozenset[ItemType] = field(init=False, repr=False, compare=False)

    @property
    def travel(self) -> TravelCosts:
        """The travel costs, with what the robot sees on its ways."""
        return self.place.travel if self.passing is None else self.passing.travel_from(START)

    def __post_init__(self) -> None:
        place = self.place
        names = (
            c.id
            for c in place.plan.containers
            if c.id not in self.contents
            and c.id not in self.refused_searches
            and LocationId(c.id) not in self.refused_moves
            and place.travel.reaches(LocationId(c.id))
        )
        object.__setattr__(self, "open", tuple(names))
        shown = (*self.contents.values(), *self.partly.values())
        object.__setattr__(self, "_seen", frozenset([item.type for items in shown for item in items]))

    @property
    def doubtful(self) -> tuple[ContainerId, ...]:
        """Reachable containers that were looked into while recording, where looks may have missed; in plan order."""
        if not self.misses:
            return ()
        return tuple(
            c.id
            for c in self.place.plan.containers
            if c.id in self.contents
            and c.id not in self.known
            and LocationId(c.id) not in self.refused_moves
            and self.place.travel.reaches(LocationId(c.id))
        )

    def misses_left(self, knowledge: Knowledge) -> int:
        """How many items may still have been overlooked in a world that a robot has come to know so far."""
        if not self.misses:
            return 0
        spent = 0
        for container, items in knowledge.first_seen.items():
            shown = self.contents.get(container)
            if shown is not None and container not in self.known:
                mark = f"{OVERLOOKED}{container}|"
                spent += sum(item.id.startswith(f"{item.type}{mark}") and item not in shown for item in items)
        if self.tags is None:
            return self.misses - spent
        held = () if knowledge.holding is None else (knowledge.holding,)
        known = (*knowledge.first_seen.values(), *knowledge.items_at.values(), held)
        return self.misses - len({item.id for items in known for item in items if OVERLOOKED in item.id})

    def seen_types(self) -> frozenset[ItemType]:
        """Item types of which the log shows an instance."""
        return self._seen

    def shown_in(self, container: ContainerId) -> tuple[Item, ...]:
        """What the log shows in a container, all or part of what it holds."""
        return self.contents.get(container, self.partly.get(container, ()))


def is_plain(evidence: Evidence) -> bool:
    """Whether nothing over a log is out of the ordinary: every look shows all, and nothing is refused."""
    refused = evidence.refused_moves or evidence.refused_picks or evidence.refused_searches or evidence.left
    return not (refused or evidence.misses or evidence.passing is not None or evidence.tags is not None)


def evidence_of(run: Run) -> Evidence:
    """The evidence in the log of a run.

    Raises:
        NoTaskAttempted: a session without a task.
        PartOfRun: one of several parts of a run.
        StartUnknown: what the robot knew at the start is missing.
    """
    gaps = gaps_of(run)
    _require_whole_task(run, gaps)
    containers = tuple(c.id for c in run.place.plan.containers)
    seen = tuple(o for o in run.observations if _is_certain(o, gaps))
    contents, odd = contents_at_start(seen, run.actions, containers)
    found, told = ({}, ()) if gaps.lost else _found_without_look(run, seen, contents)
    contents |= {c: (*contents[c], *items) for c, items in found.items() if c in contents}
    refused = refused_looks(run.actions, contents)
    partly = MappingProxyType({c: i for c, i in found.items() if c not in contents and c not in refused})
    rounded = run.info.schema_version < ROUNDED_BEFORE
    probabilities, static_beliefs, strange = first_belief(run.beliefs, containers, rounded=rounded)
    imputed = tuple(sorted({ContainerId(o.container) for o in run.observations if o.support == IMPUTED}))
    known = _known_at_start(run, contents)
    contents, corrections, corrected = with_corrections(contents, known, run)
    return Evidence(
        path=str(run.path),
        sha256=run.sha256,
        info=run.info,
        complete=run.has_end,
        gaps=gaps,
        place=run.place,
        task=run.task,
        costs=run.costs,
        known=known,
        contents=MappingProxyType(contents),
        partly=partly,
        refused_searches=refused,
        refused_moves=MappingProxyType({LocationId(k): v for k, v in refused_targets(run.actions, "move").items()}),
        refused_picks=MappingProxyType({ItemId(k): v for k, v in refused_targets(run.actions, "pick").items()}),
        left=items_left_in_place(run.actions),
        walked=frozenset((LocationId(a.origin), LocationId(a.target)) for a in run.actions if a.action == "move"),
        done=successful_manipulations(run.actions),
        first_belief=probabilities,
        static_beliefs=static_beliefs and not gaps.beliefs,
        rounded=rounded,
        imputed=imputed,
        perception=perception_from_settings(run.settings),
        looks=looks_in_order(seen),
        corrections=corrections,
        memory=memory_from_settings(run.settings),
        asking=asking_from_settings(run.settings),
        answers=answers_in(run.answers),
        passing=_passing(run),
        tags=tags_from_settings(run.settings, run.place),
        seen_on_moves=seen_on_moves(run.sightings, run.actions, run.plans),
        seen_at_start=seen_from_start(run.observations),
        miss_chance=chances_of_missing(seen, independent=run.info.source == "simulation"),
        notes=(*_notes(run, gaps, len(seen), imputed), *told, *corrected, *odd, *strange),
    )


def _require_whole_task(run: Run, gaps: Gaps) -> None:
    if run.task.goal == AllOf(parts=()):
        raise NoTaskAttempted(run)
    if run.part and (run.part != "0" or not run.complete or gaps.lost):
        raise PartOfRun(run)
    if gaps.start.kind is not StartKnowledge.KNOWN:
        raise StartUnknown(run, gaps.start.message)


def _known_at_start(run: Run, contents: Contents) -> Contents:
    at_start = {ContainerId(o.container) for o in run.observations if o.known_at_start}
    return MappingProxyType({c: contents[c] for c in sorted(at_start) if c in contents})


def _found_without_look(
    run: Run, seen: Iterable[Observation], contents: Contents
) -> tuple[dict[ContainerId, tuple[Item, ...]], tuple[str, ...]]:
    """Items that were picked up, or seen in passing, where no look shows them, by container, and notes on them.

    Args:
        contents: of the containers that were looked into.
    """
    containers = tuple(c.id for c in run.place.plan.containers)
    found = picked_without_look(seen, run.actions, containers)
    sighted, told = sighted_at_start(run.sightings, run.actions, contents, containers)
    notes = tuple(
        f"{', '.join(item.id for item in items)} was picked up in {container}, into which no look counts: it stood "
        "there at the start, and what else lies there is open"
        for container, items in found.items()
        if container not in contents and container not in sighted
    )
    for container, items in sighted.items():
        known = {item.id for item in found.get(container, ())}
        found[container] = (*found.get(container, ()), *(item for item in items if item.id not in known))
    return found, (*told, *notes)


def _passing(run: Run) -> SightPaths | None:
    """The ways of a robot that sees in passing."""
    place = run.place
    return sight_paths(place.plan, place.travel, place.paths(), sight_from_settings(run.settings))


def _is_certain(seen: Observation, gaps: Gaps) -> bool:
    """Whether an observation shows contents as at the start: nothing that is missing can have changed them."""
    if seen.known_at_start:
        return True
    late = gaps.actions_after_ns is not None and seen.stamp.ns > gaps.actions_after_ns
    return not late and seen.container not in gaps.not_looked


def _notes(run: Run, gaps: Gaps, used: int, imputed: tuple[ContainerId, ...]) -> tuple[str, ...]:
    """The notes on what is missing, imagined, or open on every way; of the observations, so many are used."""
    turns = (TAGS_NOTE,) if SETTING in run.settings else ()
    return (*_gap_notes(run, gaps, used), *_imagined(imputed), *turns)


def _gap_notes(run: Run, gaps: Gaps, used: int) -> tuple[str, ...]:
    """The notes on what is missing; of the observations, so many are used."""
    dropped = len(run.observations) - used
    cut = () if run.has_end else ("the log is cut off: what it holds is replayed",)
    if not gaps.lost:
        return cut
    unused = "1 search proves nothing and counts" if dropped == 1 else f"{dropped} searches prove nothing and count"
    after = f"; with that missing, {unused} as not made" if dropped else ""
    return (
        *cut,
        f"the log is not whole: {'; '.join(gaps.lost)}{after}",
    )


def _imagined(imputed: tuple[ContainerId, ...]) -> tuple[str, ...]:
    """The note on a log that a replay in an imagined world wrote."""
    if not imputed:
        return ()
    return (
        f"the log is of an imagined world: what lies in {first_few(imputed, 3)} is imputed, nobody saw it; "
        "costs and bounds are those of that imagined world",
    )
