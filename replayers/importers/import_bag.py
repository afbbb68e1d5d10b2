"""Turns a bag into a log: sensor data pass through for viewers, what the robot did becomes events."""

from __future__ import annotations

import hashlib
from dataclasses import dataclass
from pathlib import Path

import msgspec

from recorders.code_revision import revision
from recorders.run_recorder import RunRecorder
from recorders.spot.run.site_tasks import session_task
from recorders.spot.session.inferred_actions import InconclusiveLook
from replayers.importers.bag_survey import survey_bag
from replayers.importers.bags import Bag
from replayers.importers.clocks import BagClock, ClockName
from replayers.importers.mapping import Mapping
from replayers.importers.message_handlers import BagDerivation
from replayers.importers.retrospective_plans import AFTER_THE_FACT, AfterTheFact
from workbench import __version__
from workbench.beliefs.estimators import estimator as estimator_named
from workbench.execution.events import RunEnded
from workbench.log_schema.events import SCHEMA_VERSION, RunInfo, Stamp
from workbench.log_schema.place import Place
from workbench.planning.strategies import strategy as strategy_named
from workbench.planning.tasks import Task
from workbench.plugins import NameOrigin
from workbench.search.costs import ROBOT_COSTS
from workbench.worlds.sites.site import Site


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportPlan:
    """How to import a bag.

    Attributes:
        task: what the robot was to do; None when unknown.
        strategy, estimator: whose beliefs and plans are computed after the fact; "" for none.
        furniture_open: somebody's word that all closed furniture was opened before; else a closed container in which
            nothing was seen counts as not looked into.
        clock: whose times are used; None for header stamps unless they are of another clock or jump back.
    """

    site: Site
    mapping: Mapping
    task: Task | None = None
    strategy: str = "model-lios"
    estimator: str = "best"
    clock: ClockName | None = None
    furniture_open: bool = False


@dataclass(frozen=True, slots=True, kw_only=True)
class ImportReport:
    """The result of an import.

    Attributes:
        ended: the end of the run.
        seconds: time between its first and last message.
        messages: number by role.
        unmapped: topics without a role.
        skipped: topics that could not be read, with the reason.
        profiles: profiles of MCAP files other than ROS's own.
        walked_m: length of the whole way in metres.
        inconclusive: looks that count as not looked.
        detections_placed, detections_late: tags placed on the map, and those of them by an old transform.
        detections_not_placed: number by reason.
        static_transforms: frames with a static transform.
        poses_not_placed: number of poses by topic and frame, where the frame does not lead to the map.
        clock: whose times were used.
    """

    ended: RunEnded
    seconds: float
    messages: dict[str, int]
    unmapped: tuple[str, ...]
    skipped: dict[str, str]
    profiles: tuple[str, ...]
    moves: int
    unknown_tags: tuple[int, ...]
    walked_m: float
    inconclusive: tuple[InconclusiveLook, ...]
    detections_placed: int
    detections_late: int
    detections_not_placed: dict[str, int]
    static_transforms: int
    poses_not_placed: dict[str, int]
    clock: BagClock


def import_bag(bag: Bag, plan: ImportPlan, output: Path, *, force: bool = False) -> ImportReport:
    """Reads a bag and writes a log.

    Raises:
        RobotNotLocated: it does not say where the robot was.
        UnknownMessageType, NotABag: it cannot be read.
        OutputExists: the log is there and force is not set.
    """
    task = plan.task or session_task()
    roles = {topic: role for topic in bag.counts if (role := plan.mapping.role_of(topic)) is not None}
    strategy = strategy_named(plan.strategy, origin=NameOrigin.USER) if plan.strategy else None
    estimator = estimator_named(plan.estimator, origin=NameOrigin.USER) if plan.strategy else None
    survey, frames, clock = survey_bag(bag, plan.mapping, roles, plan.clock)
    mapping = msgspec.structs.replace(plan.mapping, frames=frames)
    with RunRecorder(
        output,
        info=_info(bag, plan, task, estimator.name if estimator else plan.estimator, clock.start_ns),
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
                "clock": clock.name,
            }
        },
    ) as recorder:
        thinker = AfterTheFact(
            strategy=strategy, estimator=estimator, task=task, costs=ROBOT_COSTS, tell=recorder.record
        )
        given = "results" in roles.values()
        importer = BagDerivation(
            plan.site, mapping, recorder, thinker, task, given, survey, clock, plan.furniture_open
        )
        for message in bag.messages(tuple(sorted(roles))):
            importer.take(roles[message.topic], message)
        ended = importer.end()
    return ImportReport(
        ended=ended,
        seconds=importer.derived.spans_s,
        messages=dict(sorted(importer.counts.items())),
        unmapped=tuple(topic for topic in bag.counts if topic not in roles),
        skipped=bag.skipped,
        profiles=bag.profiles,
        moves=importer.moves,
        unknown_tags=tuple(sorted(importer.unknown_tags)),
        walked_m=importer.derived.walked_m,
        inconclusive=tuple(importer.derived.inconclusive),
        detections_placed=importer.support.placed,
        detections_late=importer.support.late,
        detections_not_placed=dict(sorted(importer.support.not_placed.items())),
        static_transforms=len(survey.static),
        poses_not_placed={f"{topic} in frame {f}": n for (topic, f), n in sorted(importer.misframed.items())},
        clock=clock,
    )


def _info(bag: Bag, plan: ImportPlan, task: Task, estimator: str, start_ns: int) -> RunInfo:
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
        started=Stamp.of(start_ns),
        title=f"{task.title} ({bag.path.name})",
        source="import",
        code_version=__version__,
        code_revision=code.commit,
        code_dirty=code.dirty,
        weights_sha256=estimator.partition("@")[2],
        inertial_frame=plan.mapping.frames.odom,
    )
