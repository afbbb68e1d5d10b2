"""Checks of a connected robot before a run: who stops and drives it, power, faults, map, senses, software."""

from __future__ import annotations

import time
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from statistics import median
from typing import Any

from bosdyn.api import estop_pb2, lease_pb2, license_pb2, robot_id_pb2, robot_state_pb2
from bosdyn.api.docking import docking_pb2
from bosdyn.api.graph_nav import graph_nav_pb2, map_pb2

from recorders.spot.checks.disk import disk_finding
from recorders.spot.checks.findings import CheckFinding, fine, forbids, warning
from recorders.spot.checks.map_checks import map_findings
from recorders.spot.client.battery import START_PERCENT, charge_percent, left_minutes
from recorders.spot.client.clock import SyncedClock
from recorders.spot.client.connection import ROBOT_ERRORS, Connection, reason_of
from recorders.spot.client.identity import MAP_TIMEOUT_S
from recorders.spot.client.localization import is_localized
from recorders.spot.client.services import missing_services, services_of_a_run
from recorders.spot.client.software import MIN_SOFTWARE, SoftwareVersion, client_version
from workbench.log_schema.events import NANO
from workbench.tolerances import TINY
from workbench.worlds.sites.site import Site

OLD_LOCALIZATION_S, OLD_IMAGE_S = 60.0, 2.0
"""Ages in seconds from which a localisation or a picture is worth a warning."""
SKEW_S, SLOW_S = 60.0, 0.3
"""A clock skew and a round trip, in seconds, that are worth a warning."""
TRIPS, PICTURES = 8, 3
"""Numbers of round trips and pictures that are timed."""
STATE_HZ = 10.0
"""Robot states recorded per second by default."""


@dataclass(frozen=True, slots=True, kw_only=True)
class CheckPlan:
    """What a run would do.

    Attributes:
        new_map: the graph that would be uploaded first; None keeps the robot's.
    """

    site: Site
    cameras: tuple[str, ...] = ()
    images_hz: float = 2.0
    take_lease: bool = False
    own_estop: bool = False
    new_map: map_pb2.Graph | None = None


def robot_findings(connection: Connection, plan: CheckPlan, output: Path) -> list[CheckFinding]:
    """All findings about a robot and about the disk of the log `output`; the robot is asked only, nothing is changed.

    A service that does not answer is a separate finding, so that one missing service hides no other.
    """
    parts: tuple[tuple[str, Callable[[Connection, CheckPlan], list[CheckFinding]], bool], ...] = (
        ("robot", _identity, False),
        ("services", _services, True),
        ("disk", lambda robot, wanted: [_disk(robot, wanted, output)], False),
        ("e-stop", _estop, True),
        ("lease", _lease, True),
        ("power", _power_and_faults, True),
        ("dock", _dock, False),
        ("map", _map, True),
        ("localisation", _localization, True),
        ("cameras", _cameras, bool(plan.cameras)),
        ("link", _link, True),
        ("clock", _clock, False),
        ("licence", _licence, False),
        ("arm", _arm, True),
    )
    found: list[CheckFinding] = []
    for subject, look, needed in parts:
        try:
            found += look(connection, plan)
        except ROBOT_ERRORS as error:
            said = forbids if needed else warning
            found.append(said(subject, f"the robot does not say ({reason_of(error)})"))
    return found


def _disk(connection: Connection, plan: CheckPlan, output: Path) -> CheckFinding:
    """The room for a log, by the size of one answer of each service and the default rates."""
    state: robot_state_pb2.RobotState = connection.client("robot-state").get_robot_state(timeout=connection.timeout_s)
    per_s = STATE_HZ * 2 * state.ByteSize()  # as received, and as the transforms and odometry derived from it
    if plan.cameras:
        answers: list[Any] = connection.client("image").get_image_from_sources(
            list(plan.cameras), timeout=connection.timeout_s
        )
        per_s += plan.images_hz * sum(answer.ByteSize() for answer in answers)
    return disk_finding(output, per_s)


def _identity(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    robot_id: robot_id_pb2.RobotId = connection.client("robot-id").get_id(timeout=connection.timeout_s)
    has, ours = SoftwareVersion.of(robot_id), client_version()
    name = f"{robot_id.nickname or 'no nickname'}, serial {robot_id.serial_number}"
    software = f"robot {has}, client {ours}"
    if has < MIN_SOFTWARE:
        said = warning("software", f"{software}: not tested with robots below {MIN_SOFTWARE}")
    elif has.major > int(ours.split(".")[0]):
        said = warning("software", f"{software}: the client is older; update bosdyn-client")
    else:
        said = fine("software", software)
    return [fine("robot", name), said]


def _services(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    needed = services_of_a_run(plan.site, plan.cameras)
    missing = missing_services(connection, needed)
    if missing:
        return [
            forbids("services", f"the robot has no {', '.join(missing)}: update its software, or look at licences")
        ]
    return [fine("services", f"all {len(needed)} that a run needs")]


def _estop(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    status: estop_pb2.EstopSystemStatus = connection.client("estop").get_status(timeout=connection.timeout_s)
    owners = ", ".join(e.endpoint.name or e.endpoint.role or "unnamed" for e in status.endpoints)
    level = estop_pb2.EstopStopLevel.Name(status.stop_level).removeprefix("ESTOP_LEVEL_")
    text = f"{owners or 'nobody'}, level {level}"
    if plan.own_estop:
        replaced = f", which replaces {owners}" if owners else ""
        return [fine("e-stop", f"{text}; the run would use its own{replaced}")]
    if not owners:
        return [forbids("e-stop", f"{text}: take it at the tablet, or give --own-estop")]
    if status.stop_level != estop_pb2.ESTOP_LEVEL_NONE:
        return [forbids("e-stop", f"{text}: release it at the tablet, or give --own-estop")]
    return [fine("e-stop", text)]


def _lease(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    listed: list[lease_pb2.LeaseResource] = connection.client("lease").list_leases(timeout=connection.timeout_s)
    owners = sorted(
        {one.lease_owner.client_name for one in listed if one.lease_owner.client_name and not one.is_stale}
    )
    if not owners:
        return [fine("lease", "free")]
    held = f"held by {', '.join(owners)}"
    if plan.take_lease:
        return [warning("lease", f"{held}; the run would take it away")]
    return [forbids("lease", f"{held}: release control there, or give --take-lease")]


def _power_and_faults(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    state: robot_state_pb2.RobotState = connection.client("robot-state").get_robot_state(timeout=connection.timeout_s)
    found = [_battery(state)]
    if state.power_state.shore_power_state == robot_state_pb2.PowerState.SHORE_POWER_STATE_ON:
        found.append(forbids("shore power", "connected: unplug it"))
    for fault in state.system_fault_state.faults:
        critical = fault.severity == robot_state_pb2.SystemFault.SEVERITY_CRITICAL
        found.append((forbids if critical else warning)("fault", f"{fault.name}: {fault.error_message}"))
    for blocked in state.behavior_fault_state.faults:
        cause = robot_state_pb2.BehaviorFault.Cause.Name(blocked.cause).removeprefix("CAUSE_").lower()
        found.append(forbids("fault", f"a behaviour fault ({cause}): clear it at the tablet"))
    if len(found) == 1:
        found.append(fine("faults", "none"))
    networks = [comms.wifi_state for comms in state.comms_states if comms.HasField("wifi_state")]
    for wifi in networks:
        mode = robot_state_pb2.WiFiState.Mode.Name(wifi.current_mode).removeprefix("MODE_").lower().replace("_", " ")
        found.append(fine("Wi-Fi", f"{mode}, {wifi.essid or 'no network'}"))
    return found


def _battery(state: robot_state_pb2.RobotState) -> CheckFinding:
    charge, left = charge_percent(state), left_minutes(state)
    if charge is None:
        return warning("battery", "the robot reports no charge")
    text = f"{charge:.0f} %" + ("" if left is None else f", about {left:.0f} min")
    if charge < START_PERCENT:
        return forbids("battery", f"{text}: a run begins with at least {START_PERCENT:.0f} %")
    return fine("battery", text)


def _dock(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    state: docking_pb2.DockState = connection.client("docking").get_docking_state(timeout=connection.timeout_s)
    known = plan.site.robot.dock
    if state.status == docking_pb2.DockState.DOCK_STATUS_UNDOCKED:
        return [fine("dock", "undocked" + ("" if known is None else f"; the run would end on dock {known}"))]
    name = docking_pb2.DockState.DockedStatus.Name(state.status).removeprefix("DOCK_STATUS_").lower()
    if state.status == docking_pb2.DockState.DOCK_STATUS_DOCKED and known is not None:
        return [fine("dock", f"docked at {state.dock_id}; the run would undock it")]
    return [forbids("dock", f"{name}: undock with the tablet, or name the dock in the site (robot: dock)")]


def _map(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    graph: map_pb2.Graph = connection.client("graph-nav-service").download_graph(timeout=MAP_TIMEOUT_S)
    if plan.new_map is None:
        return map_findings(graph, plan.site)
    return [fine("robot's map", f"{len(graph.waypoints)} waypoints; --map would replace it")]


def _localization(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    state: graph_nav_pb2.GetLocalizationStateResponse = connection.client("graph-nav-service").get_localization_state(
        timeout=connection.timeout_s
    )
    at = state.localization
    if not is_localized(state):
        return [warning("localisation", "none; the run tries by the nearest fiducial, so one must be in view")]
    age_s = (
        connection.clock.now_ns() - connection.clock.from_robot(at.timestamp.seconds * NANO + at.timestamp.nanos)
    ) / 1e9
    text = f"at {at.waypoint_id}, {age_s:.1f} s old"
    return [(warning if age_s > OLD_LOCALIZATION_S else fine)("localisation", text)]


def _cameras(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    client = connection.client("image")
    known = sorted(source.name for source in client.list_image_sources(timeout=connection.timeout_s))
    found = [
        forbids("camera", f"{name}: the robot has none of that name, but {', '.join(known)}")
        for name in plan.cameras
        if name not in known
    ]
    there = [name for name in plan.cameras if name in known]
    for name in there:
        began, oldest_s = time.monotonic(), 0.0
        for _ in range(PICTURES):
            shot = client.get_image_from_sources([name], timeout=connection.timeout_s)[0].shot
            taken = shot.acquisition_time.seconds * NANO + shot.acquisition_time.nanos
            oldest_s = max(oldest_s, (connection.clock.now_ns() - connection.clock.from_robot(taken)) / 1e9)
        rate = PICTURES / max(time.monotonic() - began, TINY)
        text = f"{name}: up to {rate:.0f} Hz, {oldest_s:.1f} s old at most"
        found.append((warning if oldest_s > OLD_IMAGE_S else fine)("camera", text))
    return found


def _link(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    trips: list[float] = []
    for _ in range(TRIPS):
        began = time.monotonic()
        connection.client("robot-id").get_id(timeout=connection.timeout_s)
        trips.append(time.monotonic() - began)
    text = f"round trip {1000 * median(trips):.0f} ms, worst of {TRIPS} {1000 * max(trips):.0f} ms"
    return [(warning if median(trips) > SLOW_S else fine)("link", text)]


def _clock(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    clock = connection.clock
    skew_s = clock.skew_ns() / 1e9
    text = f"the robot's is {abs(skew_s):.3f} s {'ahead' if skew_s >= 0 else 'behind'}"
    if isinstance(clock, SyncedClock) and clock.uncertain():
        return [forbids("clock", f"{text}, but it was not measured again: the time sync has ended")]
    return [(warning if abs(skew_s) > SKEW_S else fine)("clock", text)]


def _licence(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    info: license_pb2.LicenseInfo = connection.client("license").get_license_info(timeout=connection.timeout_s)
    features = ", ".join(info.licensed_features) or "no features named"
    if info.status == license_pb2.LicenseInfo.STATUS_VALID:
        return [fine("licence", f"valid: {features}")]
    name = license_pb2.LicenseInfo.Status.Name(info.status).removeprefix("STATUS_").lower().replace("_", " ")
    return [forbids("licence", f"{name}: the robot may refuse GraphNav and its arm")]


def _arm(connection: Connection, plan: CheckPlan) -> list[CheckFinding]:
    there = connection.robot.has_arm(timeout=connection.timeout_s)
    if there == plan.site.robot.arm:
        return [fine("arm", "as the site says" if there else "none; a helper hands things over")]
    if there:
        return [warning("arm", "the robot has one, and the site says that it is not used")]
    return [warning("arm", "the site says that there is one, and the robot has none: a helper is asked")]
