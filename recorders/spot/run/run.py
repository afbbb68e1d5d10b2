"""Running and recording a task on a robot: localisation, lease, closed loop and log. The lease is always returned."""

from __future__ import annotations

from collections.abc import Callable, Iterable
from contextlib import ExitStack
from dataclasses import dataclass, field, replace
from pathlib import Path

from recorders.run_identity import Driver
from recorders.run_recorder import RunRecorder
from recorders.sinks.mirrored import ViewerFeed
from recorders.spot.client.clock import SteppedSessionClock
from recorders.spot.client.connection import ROBOT_ERRORS, Connection
from recorders.spot.client.control import Control
from recorders.spot.client.docking import DockOutcome, dock
from recorders.spot.client.errors import NotLocalized
from recorders.spot.client.identity import robot_metadata, robot_run_info
from recorders.spot.client.map_upload import read_graph, upload_map
from recorders.spot.client.services import require_services, services_of_a_run
from recorders.spot.run.abort_guard import stopping_on_error
from recorders.spot.run.event_text import NextStep
from recorders.spot.run.operator import KeyboardOperator, NoOperator, Operator, StopSwitch
from recorders.spot.run.operator_requests import RunKeys
from recorders.spot.run.resumed_knowledge import ResumedKnowledge, look_where_items_were_put, settings_of
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.site_tasks import place_of
from recorders.spot.run.tag_watch import tag_watch
from recorders.spot.run.world import SpotWorld
from recorders.spot.session.sensor_pollers import check_cameras, wanted_cameras
from recorders.spot.session.session import Rates, Session
from recorders.spot.session.topics import SessionStatus
from workbench.beliefs.memory.memory import Memory
from workbench.errors import LiosError
from workbench.execution.events import Event, PlanMade, RunEnded, RunStatus
from workbench.execution.loop import outcome_of
from workbench.execution.setup import RunSetup, set_up
from workbench.log_schema.asking_json import estimator_to_settings
from workbench.log_schema.events import RunInfo
from workbench.log_schema.memory_json import memory_to_settings
from workbench.log_schema.perception_json import perception_to_settings
from workbench.log_schema.run_info import ROBOT_METADATA
from workbench.log_schema.tags_in_passing_json import tags_to_settings
from workbench.planning.actions import relevant_types
from workbench.planning.tasks import Task
from workbench.search.costs import ROBOT_COSTS, ActionCosts
from workbench.terminal import say
from workbench.worlds.house import START, Contents, House, Item
from workbench.worlds.sites.site import Site
from workbench.worlds.world import ActionRefused


@dataclass(frozen=True, slots=True, kw_only=True)
class RobotRun:
    """The settings of a run on a robot.

    Attributes:
        truth: true contents of a simulated robot's containers, for the log; None on a real robot.
        take_lease, own_estop: as in Control.
        operator_name: who runs it, for the log. log_serial: whether the log names the robot's serial number.
        map_folder: a GraphNav map to upload first; None keeps the robot's map.
        earlier: what it takes over from earlier logs of the place; None for a run from scratch.
        audience: viewers that are shown every message once it is written.
        show_status: called with the session's status, once a second.
        memory: what the robot remembers of earlier runs in this place.
    """

    site: Site
    task: Task
    strategy: str
    estimator: str = "best"
    seed: int = 0
    costs: ActionCosts = ROBOT_COSTS
    settings: RunSettings = field(default_factory=RunSettings)
    rates: Rates = field(default_factory=Rates)
    truth: Contents | None = None
    take_lease: bool = False
    own_estop: bool = False
    map_folder: Path | None = None
    title: str = ""
    operator_name: str = ""
    log_serial: bool = True
    earlier: ResumedKnowledge | None = None
    audience: ViewerFeed | None = None
    show_status: Callable[[SessionStatus], None] | None = None
    memory: Memory | None = None

    @property
    def speed_mps(self) -> float:
        """The speed limit that is sent with every command to walk: that of the run, else the site's."""
        return self.settings.speed_mps or self.site.robot.speed_mps


@dataclass(frozen=True, slots=True, kw_only=True)
class RunReport:
    """The result of a run.

    Attributes:
        seconds: duration in seconds from the first decision to the end, by the session's clock.
        lease_returned: whether we no longer hold the lease.
    """

    ended: RunEnded
    seconds: float
    lease_returned: bool
    gaps: tuple[float, ...]
    skipped: int


def run_and_record(
    connection: Connection,
    run: RobotRun,
    output: Path,
    *,
    stop: StopSwitch | None = None,
    operator: Operator | None = None,
    force: bool = False,
    setup: RunSetup | None = None,
    on_event: Callable[[Event], None] | None = None,
) -> RunReport:
    """Run a task on a robot and record it; the lease is always returned.

    Args:
        setup: from setup_of, if that was called before. on_event: called with every event.

    Raises:
        as for Connection and Control before the run; a started run always ends with a status.
    """
    setup = setup or setup_of(run)
    cameras = wanted_cameras(run.site, run.rates)
    require_services(connection, services_of_a_run(run.site, cameras))
    check_cameras(connection, cameras)
    if run.map_folder is not None:
        read_graph(run.map_folder)
    control = Control(connection, take=run.take_lease, own_estop=run.own_estop, dock=run.site.robot.dock)
    with ExitStack() as held:
        world = _world(connection, control, run, operator=operator, stop=stop)
        _localize_and_set_start(world, run, held)
        if not control.held:
            held.enter_context(control)
        say(f"{control.estop_in_words()}, and a walk ends within {run.settings.stop_within_m:g} m")
        if run.earlier is not None:
            say(run.earlier.in_words())
            look_where_items_were_put(world, run.earlier)
        run = replace(run, site=world.site)
        world.watch = tag_watch(world, relevant_types(run.task.goal))
        robot = robot_metadata(connection, operator=run.operator_name, serial=run.log_serial)
        with _recorder(connection, run, setup, output, world=world, force=force) as recorder:
            session = Session(connection, run.site, recorder.sink, rates=run.rates)
            session.watch, session.show_status, world.tell = world.watch, run.show_status, session.words
            world.recording_stop_reason = lambda: recorder.stop_reason
            recorder.sink.describe(ROBOT_METADATA, robot)
            if isinstance(operator, KeyboardOperator):
                operator.on_key = RunKeys(world.requests, _sought(run), session.note).press
            try:
                start_ns = world.now_ns()
                events = stopping_on_error(setup.events(world), world, control, run.task)
                seen = _record_events(events, recorder, session, on_event)
                _dock_at_the_end(world, seen)
            finally:
                control.give_back()
    ended = outcome_of(seen)
    return RunReport(
        ended=ended,
        seconds=(ended.stamp_ns - start_ns) / 1e9,
        lease_returned=control.returned,
        gaps=tuple(session.gaps),
        skipped=sum(session.skipped.values()),
    )


def _recorder(
    connection: Connection, run: RobotRun, setup: RunSetup, output: Path, *, world: SpotWorld, force: bool
) -> RunRecorder:
    tags = None if world.watch is None else world.watch.paths
    stepped = isinstance(connection.clock, SteppedSessionClock)
    return RunRecorder(
        output,
        info=_info(connection, run, setup),
        place=place_of(run.site),
        task=run.task,
        costs=run.costs,
        truth=run.truth,
        force=force,
        paths=tags,
        audience=run.audience,
        background=not stepped,
        receipt_ns=None if stepped else connection.clock.now_ns,
        settings={
            "spot": {**_settings(run), **_as_found(world, run)},
            **tags_to_settings(tags),
            **perception_to_settings(setup.perception),
            **memory_to_settings(run.memory),
            **estimator_to_settings(setup.estimator),
        },
    )


def first_decision(connection: Connection, run: RobotRun, setup: RunSetup | None = None) -> PlanMade | None:
    """The first decision, without moving the robot, taking the lease or recording.

    Raises:
        NotLocalized, NoMap, WaypointMissing, ServiceMissing: as for a run.
    """
    require_services(connection, services_of_a_run(run.site, wanted_cameras(run.site, run.rates)))
    world = _world(connection, Control(connection), run)
    world.know_the_map()
    if not world.localize():
        raise NotLocalized(str(connection.address))
    world.start_here()
    if run.earlier is not None:
        world.known = run.earlier.known
    for event in (setup or setup_of(run)).events(world):
        if isinstance(event, PlanMade):
            return event
    return None


def _world(
    connection: Connection,
    control: Control,
    run: RobotRun,
    *,
    operator: Operator | None = None,
    stop: StopSwitch | None = None,
) -> SpotWorld:
    return SpotWorld(
        connection=connection,
        control=control,
        site=run.site,
        settings=run.settings,
        operator=operator or NoOperator(),
        stop=stop or StopSwitch(),
    )


def _localize_and_set_start(world: SpotWorld, run: RobotRun, held: ExitStack) -> None:
    """Localise the robot and set the site's start to its pose. A lying robot sees few fiducials, so it may stand up
    for this, under control that ends with `held`."""
    if run.map_folder is not None:
        held.enter_context(world.control)
        upload_map(world.connection, run.map_folder)
    world.know_the_map()
    if not world.localize() and not world.control.held:
        held.enter_context(world.control)
    if not world.localize():
        raise NotLocalized(str(world.connection.address))
    world.start_here()


def _sought(run: RobotRun) -> tuple[Item, ...]:
    """The tagged items that the task is about."""
    types = relevant_types(run.task.goal)
    return tuple(item for _, item in sorted(run.site.tags.items()) if item.type in types)


def _record_events(
    events: Iterable[Event], recorder: RunRecorder, session: Session, on_event: Callable[[Event], None] | None
) -> list[Event]:
    """Record the events one by one while the session runs."""
    seen: list[Event] = []
    clock, coming = session.connection.clock, NextStep()

    def take() -> None:
        for event in events:
            session.live.doing = coming.after(event)
            recorder.record(event)
            seen.append(event)
            if on_event is not None:
                on_event(event)

    if isinstance(clock, SteppedSessionClock):
        clock.on_step = session.tick
        try:
            take()
        finally:
            clock.on_step = None
    else:
        with session:
            take()
    return seen


def setup_of(run: RobotRun) -> RunSetup:
    """The set-up of a run, with its names resolved; needs no robot.

    Raises:
        UnknownName: no such strategy or estimator.
        BadValue: the robot is so fast that it could not stop within the permitted way.
    """
    run.settings.check_hold(run.speed_mps)
    house = None if run.truth is None else House(plan=run.site.plan, contents=run.truth)
    return set_up(
        run.task,
        strategy=run.strategy,
        estimator=run.estimator,
        costs=run.costs,
        seed=run.seed,
        house=house,
        perception=run.site.perception,
        memory=run.memory,
    )


def _settings(run: RobotRun) -> dict[str, object]:
    driven, rates = run.settings, run.rates
    return {
        "site": run.site.path.name,
        "travel": run.site.travel_source,
        "speed_mps": run.speed_mps,
        "stop_within_m": driven.stop_within_m,
        "look_s": driven.look_s,
        "furniture_open": driven.furniture_open,
        "resume": driven.resume,
        "images_hz": rates.images_hz,
        "cameras": list(rates.cameras),
    }


def _dock_at_the_end(world: SpotWorld, seen: list[Event]) -> None:
    """After a run that was not broken off, go back to the start and dock, where the site names a dock."""
    number = world.site.robot.dock
    if number is None or outcome_of(seen).status is RunStatus.ABORTED or world.hands.check_holding():
        return
    try:
        went = world.go_to(START)
        if isinstance(went, ActionRefused):
            failure = f"The robot is not docked: {went.reason}"
        else:
            docked = dock(world.connection, number)
            failure = None if docked.kind is DockOutcome.DONE else f"The robot is not docked: {docked.message}"
    except (*ROBOT_ERRORS, LiosError) as error:
        failure = f"The robot is not docked: {error}"
    world.tell(failure or f"Docked at {number}")
    if failure is not None:
        say(failure)


def _as_found(world: SpotWorld, run: RobotRun) -> dict[str, object]:
    """What was found before the first decision: whose e-stop guards the run, where the robot was localised, and what
    earlier logs knew."""
    localized = None if world.localized is None else world.localized.facts()
    return {
        "estop_guard": world.control.estop_guard,
        "estop_replaced": world.control.estop_replaced,
        "localization": localized,
        **settings_of(run.earlier, world.known),
    }


def _info(connection: Connection, run: RobotRun, setup: RunSetup) -> RunInfo:
    driver = Driver(strategy=setup.strategy.name, estimator=setup.estimator.name, seed=run.seed)
    by = f"{driver.strategy}|{driver.seed}|{run.title}"
    info = robot_run_info(connection, run.site, run.task, driver, title=run.title, id_salt=by)
    return info if run.earlier is None else run.earlier.continued(info)
