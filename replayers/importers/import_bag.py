"""Turns a bag into a log: sensor data pass through for viewers, what the robot did becomes events."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass, replace
from pathlib import Path

import msgspec

from recorders.run_identity import Driver, run_id, run_info
from recorders.run_recorder import RunRecorder
from recorders.spot.run.site_tasks import session_task
from recorders.spot.session.look_findings import InconclusiveLook
from replayers.importers.bag_survey import RobotNotLocated, survey_bag
from replayers.importers.bags import Bag
from replayers.importers.clocks import BagClock, ClockName
from replayers.importers.mapping import Mapping
from replayers.importers.message_handlers import BagDerivation
from replayers.importers.retrospective_plans import AFTER_THE_FACT, RetrospectivePlanner
from workbench.beliefs.estimators import estimator as estimator_named
from workbench.execution.events import RunEnded
from workbench.log_schema.events import RunInfo
from workbench.log_schema.perception_json import perception_to_settings
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
        furniture_open: an operator's assurance that all closed furniture was opened before; else a closed container
            in which nothing was seen counts as not looked into.
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


def import_by_any(
    bag: Bag, plan: ImportPlan, mappings: Sequence[Mapping], output: Path, *, force: bool = False
) -> tuple[ImportReport, ImportPlan]:
    """Imports by the first of several mappings that locates the robot; the plan that is returned has that one.

    Topics alone do not always tell presets apart: a bag of tf fits each of them, and only the frames of one.

    Raises:
        RobotNotLocated: none does; what is missing for the first. And what import_bag raises.
    """
    refused: RobotNotLocated | None = None
    for mapping in mappings:
        try:
            tried = replace(plan, mapping=mapping)
            return import_bag(bag, tried, output, force=force), tried
        except RobotNotLocated as error:
            refused = refused or error
    assert refused is not None, "there is a mapping"
    raise refused


def import_bag(bag: Bag, plan: ImportPlan, output: Path, *, force: bool = False) -> ImportReport:
    """Reads a bag and writes a log.

    Raises:
        RobotNotLocated: it does not say where the robot was.
        UnknownMessageType, NotABag: it cannot be read.
        OutputExists: the log is there and force is not set.
    """
    task = plan.task or session_task()
    there = (*bag.counts, *bag.undefined)
    roles = {topic: role for topic in there if (role := plan.mapping.role_of(topic)) is not None}
    strategy = strategy_named(plan.strategy, origin=NameOrigin.USER) if plan.strategy else None
    estimator = estimator_named(plan.estimator, origin=NameOrigin.USER) if plan.strategy else None
    survey, frames, clock = survey_bag(bag, plan.mapping, roles, plan.clock)
    mapping = msgspec.structs.replace(plan.mapping, frames=frames)
    with RunRecorder(
        output,
        info=_info(bag, plan, task, estimator.name if estimator else plan.estimator, clock.start_ns),
        place=Place.of(plan.site.plan, plan.site.navigation),
        task=task,
        costs=ROBOT_COSTS,
        force=force,
        motion=False,
        settings={"import": _settings(bag, plan, clock), **perception_to_settings(plan.site.perception)},
    ) as recorder:
        planner = RetrospectivePlanner(
            strategy=strategy, estimator=estimator, task=task, costs=ROBOT_COSTS, tell=recorder.record
        )
        given = "results" in roles.values()
        importer = BagDerivation(
            plan.site, mapping, recorder, planner, task, given, survey, clock, plan.furniture_open
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


def _settings(bag: Bag, plan: ImportPlan, clock: BagClock) -> dict[str, object]:
    """What the log says of how the bag was read."""
    return {
        "bag": bag.path.name,
        "mapping": plan.mapping.name,
        "computed_after_the_fact": ["belief", "find_cost", "plan"] if plan.strategy else [],
        "strategy": plan.strategy,
        "note": AFTER_THE_FACT,
        "clock": clock.name,
        "furniture_open": plan.furniture_open,
    }


def _info(bag: Bag, plan: ImportPlan, task: Task, estimator: str, start_ns: int) -> RunInfo:
    return run_info(
        task,
        Driver(strategy="recorded", estimator=estimator),
        id=run_id(f"{bag.path.name}|{bag.start_ns}|{sorted(bag.counts.items())}"),
        place=plan.site.name,
        started_ns=start_ns,
        source="import",
        title=f"{task.title} ({bag.path.name})",
        inertial_frame=plan.mapping.frames.odom,
    )
