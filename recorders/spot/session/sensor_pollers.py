"""The sensor streams of a robot session: state, localisation, tags, images, local grid and clock."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass
from typing import TYPE_CHECKING, Any

from bosdyn.api import geometry_pb2, image_pb2, local_grid_pb2, robot_state_pb2, world_object_pb2
from bosdyn.api.graph_nav import graph_nav_pb2
from bosdyn.client.frame_helpers import BODY_FRAME_NAME, ODOM_FRAME_NAME
from bosdyn.client.image import build_image_request
from bosdyn.client.math_helpers import SE3Pose
from foxglove_schemas_protobuf.Log_pb2 import Log
from google.protobuf.timestamp_pb2 import Timestamp

from recorders.foxglove.scene import MAP_FRAME, ODOM_FRAME
from recorders.spot.client.battery import charge_percent
from recorders.spot.client.clock import SteppedSessionClock, SyncedClock
from recorders.spot.client.connection import ROBOT_ERRORS, Connection
from recorders.spot.client.frame_trees import tform
from recorders.spot.client.localization import is_localized
from recorders.spot.client.seed_frame import on_map
from recorders.spot.session import foxglove
from recorders.spot.session.tag_messages import detected
from recorders.spot.session.topics import (
    CAMERA,
    FIDUCIALS,
    LOCAL_GRID,
    LOCALIZATION,
    ODOMETRY,
    ROBOT_STATE,
    WORLD_OBJECTS,
    ClockSkew,
    RobotStatus,
    TagPoll,
)
from recorders.spot.tags.detections import Detector, TagDetection, place_on_map, robot_detections
from recorders.spot.tags.pictures import (
    detector_cameras,
    items_detector,
    picture_detections,
    relevant_detections,
    require_detector,
    tag_sizes,
)
from workbench.errors import UnknownName
from workbench.log_schema.events import NANO, Stamp
from workbench.worlds.sites.site import Site

if TYPE_CHECKING:
    from recorders.spot.session.session import Rates, Session

OURS = ("clock", "status")
"""Streams for which the robot is not asked."""
FRESH_TAG_S = 2
POLLS_HZ = 4
"""How many polls for tags are logged at most, a second and detector."""
STATUS_EVERY_NS = NANO - NANO // 20


@dataclass(frozen=True, slots=True)
class SensorStream:
    """A data stream that is polled every period_s seconds, from the robot or locally."""

    name: str
    period_s: float
    take: Callable[[], None]
    asks_robot: bool = True


class _SharedState:
    """State shared between streams: the body's pose on the map, and the last status message."""

    def __init__(self) -> None:
        self.map_tform_body: geometry_pb2.SE3Pose | None = None
        self.map_tform_odom: SE3Pose | None = None
        self.reported_status_ns = 0
        self.faults: tuple[str, ...] = ()
        self.calibrated: set[str] = set()
        self.detected_ns: dict[tuple[str, str, int], int] = {}
        self.polled_ns: dict[Detector, int] = {}


def sensor_streams(session: Session) -> tuple[SensorStream, ...]:
    """The streams enabled by the session's rates."""
    known, rates = _SharedState(), session.rates
    wanted = (
        ("localization", rates.localization_hz, lambda: _localization(session, known)),
        ("state", rates.state_hz, lambda: _state(session, known)),
        ("fiducials", rates.fiducials_hz, lambda: _fiducials(session, known)),
        ("tag pictures", rates.tags_hz if detector_cameras(session.site) else 0.0, lambda: _pictures(session, known)),
        ("images", rates.images_hz if rates.cameras else 0.0, lambda: _images(session, known)),
        ("grid", rates.grid_hz, lambda: _grid(session)),
        ("clock", rates.clock_hz, lambda: _clock(session)),
        # with stepped time nobody watches, and the room on a disk would make two equal runs differ
        (
            "status",
            0.0 if isinstance(session.connection.clock, SteppedSessionClock) else rates.status_hz,
            session.report_status,
        ),
    )
    return tuple(SensorStream(name, 1.0 / hz, take, name not in OURS) for name, hz, take in wanted if hz > 0)


def wanted_cameras(site: Site, rates: Rates) -> tuple[str, ...]:
    """The image sources that a session asks for: those recorded, and those in which tags are looked for.

    Raises:
        MissingExtra: the site's detector is not installed.
    """
    require_detector(site)
    return (*(rates.cameras if rates.images_hz > 0 else ()), *detector_cameras(site))


def check_cameras(connection: Connection, cameras: Sequence[str]) -> None:
    """Check that the robot has these image sources, since one unknown name makes the whole request fail.

    Raises:
        UnknownName: a source does not exist. RobotUnreachable, ServiceMissing: the robot does not answer, or cannot.
    """
    if not cameras:
        return
    try:
        sources = connection.client("image").list_image_sources(timeout=connection.timeout_s)
    except ROBOT_ERRORS as error:
        raise connection.as_line(error) from error
    known = sorted(source.name for source in sources)
    for name in cameras:
        if name not in known:
            raise UnknownName("camera", name, known, f"the robot at {connection.address}")


def our_ns(session: Session, stamp: Timestamp) -> int:
    """A robot stamp in our time; the current time if it is missing."""
    robot_ns = stamp.seconds * NANO + stamp.nanos
    return session.connection.clock.from_robot(robot_ns) if robot_ns else session.now_ns()


def _ask(session: Session, service: str) -> Any:
    return session.connection.client(service)


def _localization(session: Session, known: _SharedState) -> None:
    answer: graph_nav_pb2.GetLocalizationStateResponse = _ask(session, "graph-nav-service").get_localization_state(
        timeout=session.connection.timeout_s
    )
    place = answer.localization
    session.live.localized = is_localized(answer)
    if not is_localized(answer):
        known.map_tform_body = known.map_tform_odom = None
        return
    at = our_ns(session, place.timestamp)
    body = on_map(session.site, place.seed_tform_body)
    known.map_tform_body = body
    known.map_tform_odom = foxglove.map_from_odom(body, answer.robot_kinematics.transforms_snapshot)
    session.put("/robot/pose", foxglove.in_frame(body, MAP_FRAME, at), source_ns=at)
    if session.rates.raw:
        session.put(LOCALIZATION, place, source_ns=at)
    if session.watch is not None:
        session.watch.pose(at, (body.position.x, body.position.y))


def _state(session: Session, known: _SharedState) -> None:
    state: robot_state_pb2.RobotState = _ask(session, "robot-state").get_robot_state(
        timeout=session.connection.timeout_s
    )
    frames = state.kinematic_state.transforms_snapshot
    at = our_ns(session, state.kinematic_state.acquisition_timestamp)
    odom = tform(frames, ODOM_FRAME_NAME, BODY_FRAME_NAME)
    session.put("/tf", foxglove.transforms(frames, known.map_tform_odom, at), source_ns=at)
    if odom is not None:
        session.put(ODOMETRY, foxglove.in_frame(odom, ODOM_FRAME, at), source_ns=at)
    if session.rates.raw:
        session.put(ROBOT_STATE, state, source_ns=at)
    if session.watch is not None:
        session.watch.holding(at, state.manipulator_state.is_gripper_holding_item)
    charge = charge_percent(state)
    session.live.battery_percent = -1.0 if charge is None else charge
    faults = foxglove.faults_of(state)
    for fault in faults:
        if fault not in known.faults:
            session.words(f"Fault: {fault}", level=Log.ERROR)
    if faults != known.faults or at - known.reported_status_ns >= STATUS_EVERY_NS:
        known.faults, known.reported_status_ns = faults, at
        session.tell(_status(state, at, faults, localized=known.map_tform_body is not None))


def _status(state: robot_state_pb2.RobotState, at: int, faults: tuple[str, ...], *, localized: bool) -> RobotStatus:
    power = state.power_state
    motors = robot_state_pb2.PowerState.MotorPowerState.Name(power.motor_power_state)
    stopped = robot_state_pb2.EStopState.STATE_ESTOPPED
    return RobotStatus(
        stamp=Stamp.of(at),
        battery_percent=power.locomotion_charge_percentage.value,
        battery_left_s=power.locomotion_estimated_runtime.seconds,
        motors=motors.removeprefix("MOTOR_POWER_").removeprefix("STATE_").lower(),
        estopped=any(stop.state == stopped for stop in state.estop_states),
        localized=localized,
        holding=state.manipulator_state.is_gripper_holding_item,
        faults=faults,
    )


def _fiducials(session: Session, known: _SharedState) -> None:
    answer: world_object_pb2.ListWorldObjectResponse = _ask(session, "world-objects").list_world_objects(
        object_type=[world_object_pb2.WORLD_OBJECT_APRILTAG], timeout=session.connection.timeout_s
    )
    if session.rates.raw:
        session.put(WORLD_OBJECTS, answer, source_ns=our_ns(session, answer.header.response_timestamp))
    found = robot_detections(answer.world_objects, session.connection.clock, tag_sizes(session.site))
    _tags(session, known, found)
    _poll(session, known, Detector.ROBOT, found)


def _pictures(session: Session, known: _SharedState) -> None:
    found = picture_detections(session.connection, session.site)
    _tags(session, known, found)
    _poll(session, known, Detector.OPENCV, found)


def _poll(session: Session, known: _SharedState, detector: Detector, found: Sequence[TagDetection]) -> None:
    """Log that a detector was asked, and what it sees now: without that, nobody could tell a moment at which nothing
    was seen from one at which nobody looked."""
    now = session.now_ns()
    if now - known.polled_ns.get(detector, 0) < NANO // POLLS_HZ * 9 // 10:
        return
    known.polled_ns[detector] = now
    session.tell(
        TagPoll(
            stamp=Stamp.of(now),
            detector=detector.value,
            counts=items_detector(session.site) is detector,
            localized=known.map_tform_odom is not None,
            tags=tuple(sorted({seen.tag for seen in found if now - seen.stamp_ns < FRESH_TAG_S * NANO})),
        )
    )


def _tags(session: Session, known: _SharedState, found: Sequence[TagDetection]) -> None:
    """Log new detections, and pass those that count to the listener and to viewers."""
    now, site = session.now_ns(), session.site
    counting = relevant_detections(site, found)
    placed = {id(one.detection): one for one in place_on_map(found, known.map_tform_odom)}
    for seen in found:
        key = (seen.detector.value, seen.camera, seen.tag)
        if known.detected_ns.get(key) == seen.stamp_ns:
            continue
        known.detected_ns[key] = seen.stamp_ns
        session.tell(detected(site, seen, placed.get(id(seen)), received_ns=now, counts=seen in counting))
    fresh = [placed[id(seen)] for seen in counting if id(seen) in placed and now - seen.stamp_ns < FRESH_TAG_S * NANO]
    for sighting in fresh:
        item = site.tags.get(sighting.tag)
        session.live.tags[f"tag {sighting.tag}" if item is None else str(item.id)] = sighting.stamp_ns
    if session.watch is not None:
        for sighting in fresh:
            session.watch.tag(sighting.stamp_ns, sighting.tag, sighting.position)
    if fresh:
        at = max(sighting.stamp_ns for sighting in fresh)
        session.put(FIDUCIALS, foxglove.tag_scene(fresh, dict(site.tags), at), source_ns=at)


def _images(session: Session, known: _SharedState) -> None:
    rates = session.rates
    ratio = rates.image_ratio if rates.image_ratio < 1.0 else None
    requests = [
        build_image_request(name, quality_percent=rates.image_quality, resize_ratio=ratio) for name in rates.cameras
    ]
    answers: list[image_pb2.ImageResponse] = _ask(session, "image").get_image(
        requests, timeout=session.connection.timeout_s
    )
    for answer in answers:
        name = answer.source.name
        at = our_ns(session, answer.shot.acquisition_time)
        image = foxglove.picture(answer.shot, at)
        mounted = foxglove.camera_link(answer.shot, at)
        if mounted is not None:
            session.put("/tf", mounted, source_ns=at)
        if name not in known.calibrated:
            known.calibrated.add(name)
            calibrated = foxglove.calibration(answer.source, answer.shot, at)
            session.put(f"{CAMERA}/{_short(name)}/calibration", calibrated, source_ns=at, latched=True)
        if image is not None:
            session.put(f"{CAMERA}/{_short(name)}", image, source_ns=at)
        if rates.raw:
            kept = answer if image is None else foxglove.without_pixels(answer)
            session.put(f"/spot/image/{_short(name)}", kept, source_ns=at)


def _short(source: str) -> str:
    return source.removesuffix("_image")


def _grid(session: Session) -> None:
    answers: list[local_grid_pb2.LocalGridResponse] = _ask(session, "local-grid-service").get_local_grids(
        ["obstacle_distance"], timeout=session.connection.timeout_s
    )
    for answer in answers:
        grid = answer.local_grid
        at = our_ns(session, grid.acquisition_time)
        if session.rates.raw:
            session.put(f"/spot/local_grid/{answer.local_grid_type_name}", answer, source_ns=at)
        drawn = foxglove.local_grid(grid, at)
        if drawn is not None:
            session.put(LOCAL_GRID, drawn, source_ns=at)


def _clock(session: Session) -> None:
    clock = session.connection.clock
    trip = 0
    if isinstance(clock, SyncedClock):
        clock.refresh()
        trip = clock.round_trip_ns()
    session.tell(
        ClockSkew(
            stamp=Stamp.of(clock.now_ns()),
            skew_ns=clock.skew_ns(),
            round_trip_ns=trip,
            uncertain=clock.uncertain(),
        )
    )
