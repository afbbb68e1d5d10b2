"""Turns a bag into a log: sensor data pass through for viewers, what the robot did becomes events."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import msgspec

from recorders.code_revision import revision
from recorders.run_recorder import RunRecorder
from recorders.spot.run.site_tasks import session_task
from replayers.importers import decoding
from replayers.importers.bags import Bag
from replayers.importers.frames import FrameBuffer, plain
from replayers.importers.mapping import BagFrames, Mapping
from replayers.importers.message_handlers import BagDerivation
from replayers.importers.retrospective_plans import AFTER_THE_FACT, AfterTheFact
from workbench import __version__
from workbench.beliefs.estimators import estimator as estimator_named
from workbench.errors import Malformed
from workbench.execution.events import RunEnded
from workbench.log_schema.events import SCHEMA_VERSION, RunInfo, Stamp
from workbench.log_schema.place import Place
from workbench.planning.strategies import strategy as strategy_named
from workbench.planning.tasks import Task
from workbench.plugins import NameOrigin
from workbench.search.costs import ROBOT_COSTS
from workbench.worlds.sites.site import Site


class RobotNotLocated(Malformed):
    """A bag that does not say where the robot was on the map."""

    def __init__(self, path: Path, mapping: Mapping, topics: tuple[str, ...], seen: list[str]) -> None:
        frames = mapping.frames
        listed = ", ".join(topics[:8]) + (", ..." if len(topics) > 8 else "")
        linked = f" Frames: {', '.join(seen[:8])}{', ...' if len(seen) > 8 else ''}." if seen else ""
        super().__init__(
            f"{path}: nothing places the robot on the map: no tf from {frames.map} to {frames.body}, no mapped pose "
            f"topic (mapping {mapping.name}).{linked} Topics: {listed}. "
            "Map a pose topic, or correct the mapping's frames."
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportPlan:
    """How to import a bag.

    Attributes:
        task: what the robot was to do; None when unknown.
        strategy, estimator: whose beliefs and plans are computed after the fact; "" for none.
    """

    site: Site
    mapping: Mapping
    task: Task | None = None
    strategy: str = "model-lios"
    estimator: str = "best"


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportReport:
    """The result of an import: messages by role, events, and unmapped topics."""

    ended: RunEnded
    seconds: float
    messages: dict[str, int]
    unmapped: tuple[str, ...]
    moves: int
    unknown_tags: tuple[int, ...]


def import_bag(bag: Bag, plan: ImportPlan, output: Path, *, force: bool = False) -> ImportReport:
    """Reads a bag and writes a log.

    Raises:
        RobotNotLocated: it does not say where the robot was.
        UnknownMessageType, NotABag: it cannot be read.
        OutputExists: the log is there and force is not set.
    """
    task = plan.task or session_task()
    roles = {topic: role for topic in bag.topics if (role := plan.mapping.role_of(topic)) is not None}
    strategy = strategy_named(plan.strategy, origin=NameOrigin.USER) if plan.strategy else None
    estimator = estimator_named(plan.estimator, origin=NameOrigin.USER) if plan.strategy else None
    mapping = _resolve_frames(bag, plan, roles)
    with RunRecorder(
        output,
        info=_info(bag, plan, task, estimator.name if estimator else plan.estimator),
        place=Place.of(plan.site.plan, plan.site.ways),
        task=task,
        costs=ROBOT_COSTS,
        force=force,
        motion=False,
        settings={
            "import": {
                "bag": bag.path.name,
                "mapping": plan.mapping.name,
                "computed_after_the_fact": ["belief", "find_cost", "plan"] if strategy else [],
                "strategy": plan.strategy,
                "note": AFTER_THE_FACT,
            }
        },
    ) as recorder:
        thinker = AfterTheFact(
            strategy=strategy, estimator=estimator, task=task, costs=ROBOT_COSTS, tell=recorder.record
        )
        importer = BagDerivation(plan.site, mapping, recorder, thinker, task, given_moves="results" in roles.values())
        for message in bag.messages(tuple(sorted(roles))):
            importer.take(roles[message.topic], message)
        ended = importer.derived.end()
    return ImportReport(
        ended=ended,
        seconds=importer.derived.spans_s,
        messages=dict(sorted(importer.counts.items())),
        unmapped=tuple(topic for topic in bag.topics if topic not in roles),
        moves=importer.moves,
        unknown_tags=tuple(sorted(importer.unknown_tags)),
    )


def _resolve_frames(bag: Bag, plan: ImportPlan, roles: dict[str, str]) -> Mapping:
    """The mapping with the frames as the bag calls them.

    Reads tf and poses once, so that no log is begun for a bag that does not say where the robot was.
    """
    frames, names = FrameBuffer(), plan.mapping.frames
    topics = tuple(topic for topic, role in sorted(roles.items()) if role in ("tf", "tf_static", "pose"))
    for message in bag.messages(topics):
        posed = None
        if roles[message.topic] == "pose":
            posed = decoding.body_pose(message.message)
        else:
            for link in message.message.transforms:
                frames.add(link.header.frame_id, link.child_frame_id, link.transform)
        found = BagFrames(map=frames.named(names.map), odom=frames.named(names.odom), body=frames.named(names.body))
        known = frames.lookup(found.map, found.body) is not None
        if posed is not None:
            known = known or plain(posed[0]) == found.map or frames.lookup(found.map, posed[0]) is not None
        if known:
            return msgspec.structs.replace(plan.mapping, frames=found)
    raise RobotNotLocated(bag.path, plan.mapping, bag.topics, sorted(frames.names))


def _info(bag: Bag, plan: ImportPlan, task: Task, estimator: str) -> RunInfo:
    code = revision()
    name = f"{bag.path.name}|{bag.start_ns}|{sorted(bag.counts.items())}"
    return RunInfo(
        run_id=hashlib.sha256(name.encode()).hexdigest()[:12],
        schema_version=SCHEMA_VERSION,
        place=plan.site.name,
        scenario=task.scenario,
        strategy="recorded",
        estimator=estimator,
        seed=0,
        started=Stamp.of(bag.start_ns),
        title=f"{task.title} ({bag.path.name})",
        source="import",
        code_version=__version__,
        code_revision=code.commit,
        code_dirty=code.dirty,
        weights_sha256=estimator.partition("@")[2],
        inertial_frame=plan.mapping.frames.odom,
    )
