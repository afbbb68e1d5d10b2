"""The state of the simulated robot: body, items, leases and faults, behind one lock.

Services (basic_services.py and those beside it) translate between this state and bosdyn-api's messages.
"""

from __future__ import annotations

import logging
import threading
from collections.abc import Callable, Generator
from contextlib import contextmanager
from dataclasses import dataclass, field, replace
from math import inf

import numpy as np
from bosdyn.api import license_pb2, power_pb2, robot_state_pb2, world_object_pb2
from bosdyn.api.graph_nav import graph_nav_pb2, nav_pb2

from recorders.spot.client.software import SoftwareVersion
from recorders.spot.client.time_source import RobotClock
from recorders.spot.simulated.body import TOP_SPEED_MPS, Body, BodyWalk, WalkState
from recorders.spot.simulated.estop import EstopBoard
from recorders.spot.simulated.faults import Fault, FaultKind
from recorders.spot.simulated.leases import LeaseBook
from recorders.spot.simulated.missed_tags import MissedTags
from recorders.spot.simulated.sight import TaggedThing, in_hand, sees, shows, thing_in
from workbench.errors import Malformed
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import ContainerId, House, LocationId
from workbench.worlds.sites.paths import SiteNavigation
from workbench.worlds.sites.site import Site

NOT_CARRIABLE = robot_state_pb2.ManipulatorState.CARRY_STATE_NOT_CARRIABLE
PICK_S, PLACE_S = 20.0, 4.0
"""Times in seconds of a grasp and of an arm motion."""
NEWEST = SoftwareVersion(5)
"""The release of the robot's software, if no other is wanted."""
FORGET_S = 15.0
"""Time in seconds for which a tag is still listed after its last detection."""

_Feedback = graph_nav_pb2.NavigationFeedbackResponse
ROUTE_ENDS = {
    FaultKind.NO_ROUTE: _Feedback.STATUS_NO_ROUTE,
    FaultKind.CONSTRAINT_FAULT: _Feedback.STATUS_CONSTRAINT_FAULT,
    FaultKind.AREA_CALLBACK: _Feedback.STATUS_AREA_CALLBACK_ERROR,
    FaultKind.OVERRIDDEN: _Feedback.STATUS_COMMAND_OVERRIDDEN,
    FaultKind.IMPAIRED: _Feedback.STATUS_ROBOT_IMPAIRED,
}
"""Faults that end every walk with a feedback status of GraphNav."""

FIDUCIAL, FIDUCIAL_M = 540, 0.6
"""Number and height in metres of the map's fiducial, which hangs at the start."""

log = logging.getLogger("lios.spot.simulated")


class UntaggedItem(Malformed):
    """An item without a tag, which the robot could never recognise."""

    def __init__(self, item: str, site: Site) -> None:
        super().__init__(f"{site.path}: no tag names the item {item}. Add it under tags.")


@dataclass(slots=True)
class LastSighting:
    """When and where a tag was last detected, in the map frame, and the body then: transforms are of that moment."""

    position: tuple[float, float, float]
    body_s: float
    robot_ns: int
    body: Body
    size_m: float


@dataclass(slots=True)
class Grasp:
    """A pick in progress."""

    number: int
    began_s: float
    thing: TaggedThing | None
    done: bool = False


@dataclass(slots=True)
class SimulatedState:
    """The state shared by all services; hold `lock` (through `alive`) while using it.

    Attributes:
        site: the site as known to the robot. house: the true house.
        things: the tagged items, wherever they are.
        last_localization: GraphNav's last localisation, kept while lost.
        fiducials_from_floor: whether a lying robot sees a fiducial of the map.
        power_refusal: a power_pb2.PowerCommandStatus with which power-on is refused; STATUS_UNKNOWN for none.
        behaviour_fault: a fault that forbids commands until a person clears it.
        critical_fault: the name of a critical system fault; "" for none.
        on_shore_power: whether it is plugged in. dock: the number of the dock on which it stands; None for none.
        docks: the numbers of the docks in the site.
        licence: a license_pb2.LicenseInfo.Status.
        arm_stalls: whether arm motions never finish. arm_mishaps: what an arm ran into, in words.
        grasps_miss: how many of the next grasps close on nothing.
        no_grasp_from: a point near which no grasp succeeds: from there something is in the way; None for none.
        tag_status: the AprilTagProperties status with which items' tags are reported.
        carry_state: of what is held; a robot without an override does not stow it, and lets go of it when the
            connection breaks off (SDK example arm_grasp_carry_override).
        arm_goal: last goal of the arm: frame, x, y, z.
        navigation_status: the feedback status with which every walk ends at once; None for none.
        fiducials: tag numbers of the map's own fiducials, and where they hang in metres on the map.
        on_drop: called with the duration of a network outage in seconds.
        on_expired_tokens: called when all tokens expire at once.
        software: the release of its software.
        missed_tags: which tags of items its detector misses; None for none that is in view.
    """

    site: Site
    house: House
    clock: RobotClock
    body: Body
    rng: np.random.Generator
    things: list[TaggedThing]
    faults: list[Fault] = field(default_factory=list)
    leases: LeaseBook = field(default_factory=LeaseBook)
    estop: EstopBoard = field(default_factory=EstopBoard)
    lock: threading.RLock = field(default_factory=threading.RLock)
    localized: bool = False
    last_localization: nav_pb2.Localization | None = None
    fiducials_from_floor: bool = True
    power_refusal: power_pb2.PowerCommandStatus.ValueType = power_pb2.STATUS_UNKNOWN
    behaviour_fault: bool = False
    critical_fault: str = ""
    on_shore_power: bool = False
    dock: int | None = None
    docks: tuple[int, ...] = (520,)
    licence: license_pb2.LicenseInfo.Status.ValueType = license_pb2.LicenseInfo.STATUS_VALID
    arm_stalls: bool = False
    arm_mishaps: list[str] = field(default_factory=list)
    arm_at: tuple[float, float, float] | None = None
    released_at: tuple[float, float, float] | None = None
    released_goal: tuple[str, float, float, float] | None = None
    grasps_miss: int = 0
    no_grasp_from: Point | None = None
    tag_status: world_object_pb2.AprilTagProperties.AprilTagPoseStatus.ValueType = (
        world_object_pb2.AprilTagProperties.STATUS_OK
    )
    carry_state: robot_state_pb2.ManipulatorState.CarryState.ValueType = NOT_CARRIABLE
    arm_goal: tuple[str, float, float, float] | None = None
    hides_tags: bool = False
    ends: list[tuple[float, FaultKind]] = field(default_factory=list)
    sightings: dict[int, LastSighting] = field(default_factory=dict)
    grasp: Grasp | None = None
    arm_busy_until_s: float = 0.0
    gripper_open: bool = False
    arm_deployed: bool = False
    commands: dict[int, str] = field(default_factory=dict)
    comments: list[str] = field(default_factory=list)
    next_command: int = 1
    navigation_status: graph_nav_pb2.NavigationFeedbackResponse.Status.ValueType | None = None
    fiducials: dict[int, tuple[float, float, float]] = field(default_factory=dict)
    on_drop: Callable[[float], None] | None = None
    on_expired_tokens: Callable[[], None] | None = None
    software: SoftwareVersion = NEWEST
    missed_tags: MissedTags | None = None

    @property
    def sees_fiducials(self) -> bool:
        """Whether a fiducial of the map is visible for localisation."""
        return self.body.standing or self.fiducials_from_floor

    @contextmanager
    def alive(self) -> Generator[SimulatedState]:
        """Simulate the body until now, and hold the lock."""
        with self.lock:
            self.catch_up()
            yield self

    def catch_up(self) -> None:
        now = self.clock.body_s()
        while self.faults and self.faults[0].at_s <= now:
            fault = self.faults.pop(0)
            self.body.advance_to(max(fault.at_s, self.body.lived_s))
            self.apply_fault(fault)
        self.body.advance_to(now)
        for end in [e for e in self.ends if e[0] <= now]:
            self.ends.remove(end)
            self.recover(end[1])
        if self.estop.stopped:
            self.body.power_off()
        if self.body.walk is not None and self.body.walk.state is WalkState.WALKING and not self.localized:
            self.body.halt(WalkState.LOST)
        self._finish_grasp()
        self._look()

    def apply_fault(self, fault: Fault) -> None:
        """Inject a fault now."""
        log.info("fault: %s", fault.kind.value)
        if fault.kind is FaultKind.LOST_LEASE:
            self.leases.grant("another-client")
            self.body.halt(WalkState.NO_LEASE)
        elif fault.kind is FaultKind.LOST_LOCALIZATION:
            self.localized = False
        elif fault.kind is FaultKind.STUCK:
            self.body.stuck = True
        elif fault.kind is FaultKind.TAG_NOT_SEEN:
            self.hides_tags = True
        elif fault.kind is FaultKind.ESTOP:
            self.estop.press()
        elif fault.kind is FaultKind.CLOCK_SKEW:
            self.clock.skew_s = fault.for_s or 0.0
        elif fault.kind in ROUTE_ENDS:
            self.navigation_status = ROUTE_ENDS[fault.kind]
        elif fault.kind is FaultKind.DROPPED_ITEM:
            self.drop_item()
        elif fault.kind is FaultKind.DROPPED and self.on_drop is not None:
            if self.carry_state == NOT_CARRIABLE:
                self.drop_item()
            self.on_drop(fault.for_s or 2.0)
        elif fault.kind is FaultKind.EXPIRED_TOKENS and self.on_expired_tokens is not None:
            self.on_expired_tokens()
        if fault.for_s is not None and fault.kind not in (FaultKind.CLOCK_SKEW, FaultKind.DROPPED):
            self.ends.append((self.body.lived_s + fault.for_s, fault.kind))

    def recover(self, kind: FaultKind) -> None:
        """End a fault."""
        if kind is FaultKind.STUCK:
            self.body.stuck = False
        elif kind is FaultKind.TAG_NOT_SEEN:
            self.hides_tags = False
        elif kind is FaultKind.LOST_LOCALIZATION:
            self.localized = True
        elif kind is FaultKind.ESTOP:
            self.estop.release()
        elif kind in ROUTE_ENDS:
            self.navigation_status = None

    def number(self, what: str) -> int:
        """The id of a new command."""
        number, self.next_command = self.next_command, self.next_command + 1
        self.commands[number] = what
        return number

    def walk_to(self, goal: Pose, *, speed_mps: float | None, lasts_s: float = inf, turn: bool = True) -> int | None:
        """Walk to a pose on the map; None if there is no path."""
        corners = self.path(self.body.pose.point, goal.point)
        if corners is None:
            return None
        if self.arm_deployed and self.held is None:
            self.arm_mishaps.append("walked with its arm out")
        number = self.number("walk")
        speed = min(self.body.speed_mps, speed_mps or self.body.speed_mps)
        self.body.go(
            BodyWalk(
                number=number,
                corners=list(corners[1:]),
                final_yaw_rad=goal.yaw_rad if turn else None,
                speed_mps=speed,
                end_s=self.body.lived_s + lasts_s,
            )
        )
        return number

    def path(self, a: Point, b: Point) -> tuple[Point, ...] | None:
        navigation = self.site.navigation
        return navigation.path_between(a, b) if isinstance(navigation, SiteNavigation) else (a, b)

    def begin_grasp(self, at: tuple[float, float, float]) -> int:
        """Start to grasp the item nearest to a point on the map."""
        reachable = [
            thing
            for thing in self.things
            if not thing.held
            and np.hypot(*np.subtract(thing.position[:2], at[:2])) < 0.4
            and np.hypot(thing.position[0] - self.body.pose.x_m, thing.position[1] - self.body.pose.y_m) < 1.8
        ]
        reachable.sort(key=lambda thing: float(np.hypot(*np.subtract(thing.position[:2], at[:2]))))
        number = self.number("grasp")
        if self.grasps_miss > 0:
            self.grasps_miss, reachable = self.grasps_miss - 1, []
        here, blocked = self.body.pose.point, self.no_grasp_from
        if blocked is not None and np.hypot(here[0] - blocked[0], here[1] - blocked[1]) < 0.5:
            reachable = []
        self.grasp = Grasp(number=number, began_s=self.body.lived_s, thing=reachable[0] if reachable else None)
        self.arm_deployed, self.gripper_open = True, True
        return number

    @property
    def held(self) -> TaggedThing | None:
        return next((thing for thing in self.things if thing.held), None)

    def open_gripper(self) -> None:
        """Release the held item onto the container at hand, or onto the floor."""
        self.gripper_open = True
        thing = self.held
        if thing is None:
            return
        near = self._container_at_hand()
        if near is None:
            x, y, _ = in_hand(self.body.pose)
            thing.container, thing.position = None, (x, y, 0.0)
        else:
            container = self.site.plan.container(near)
            place = sum(1 for other in self.things if other.container == near and not other.held)
            put = thing_in(thing.tag, container, place)
            thing.container, thing.position = near, put.position
        thing.held, self.carry_state = False, NOT_CARRIABLE

    def drop_item(self) -> None:
        """Let go of what is held: it falls to the floor in front of the robot."""
        thing = self.held
        if thing is not None:
            x, y, _ = in_hand(self.body.pose)
            thing.held, thing.container, thing.position = False, None, (x, y, 0.05)
            self.carry_state = NOT_CARRIABLE

    def _container_at_hand(self) -> ContainerId | None:
        here = self.body.pose
        near = [
            (np.hypot(pose.x_m - here.x_m, pose.y_m - here.y_m), name)
            for name, pose in self.site.navigation.standing.items()
            if name != LocationId("start")
        ]
        best = min(near, default=None)
        return ContainerId(best[1]) if best is not None and best[0] < 1.0 else None

    def _finish_grasp(self) -> None:
        grasp = self.grasp
        if grasp is None or grasp.done or self.body.lived_s - grasp.began_s < PICK_S or grasp.thing is None:
            return
        grasp.done = True
        if not grasp.thing.held and self.held is None:
            grasp.thing.held, grasp.thing.container, self.gripper_open = True, None, False

    def tags_in_view(self) -> list[TaggedThing]:
        """Tags that cameras show now: of items, and of the map."""
        hung = [TaggedThing(tag=tag, container=None, position=at) for tag, at in self.fiducials.items()]
        if self.hides_tags:
            return []
        return [thing for thing in (*self.things, *hung) if shows(self.site, self.body.pose, thing)]

    def _detects(self, thing: TaggedThing) -> bool:
        """Whether the detector reports the tag of an item that nobody holds."""
        if self.hides_tags or not sees(self.site, self.body.pose, thing):
            return False
        return self.missed_tags is None or not self.missed_tags.misses(self.site, self.body.pose, thing)

    def _look(self) -> None:
        then = replace(self.body, odom=replace(self.body.odom), vision=replace(self.body.vision))
        lived_s, robot_ns = self.body.lived_s, self.clock.robot_ns()
        for thing in self.things:
            if thing.held:
                thing.position = in_hand(self.body.pose)
                self.sightings.pop(thing.tag, None)
            elif self._detects(thing):
                noise = self.rng.normal(0.0, 0.005, 3)
                x, y, z = (float(value) for value in np.add(thing.position, noise))
                self.sightings[thing.tag] = LastSighting(
                    (x, y, z), self.body.lived_s, self.clock.robot_ns(), then, thing.size_m
                )
        for tag, (x, y, z) in self.fiducials.items():
            hung = TaggedThing(tag=tag, container=None, position=(x, y, z))
            if not self.hides_tags and sees(self.site, self.body.pose, hung):
                self.sightings[tag] = LastSighting((x, y, z), lived_s, robot_ns, then, hung.size_m)
        for tag in [t for t, seen in self.sightings.items() if self.body.lived_s - seen.body_s > FORGET_S]:
            del self.sightings[tag]


def new_state(
    site: Site, house: House, clock: RobotClock, *, faults: tuple[Fault, ...] = (), seed: int = 0
) -> SimulatedState:
    """A robot that sits at the site's start with its motors off, not localised.

    Raises:
        UntaggedItem: the house holds an item to which the site gives no tag.
    """
    tag_of = {item.id: tag for tag, item in site.tags.items()}
    things: list[TaggedThing] = []
    for name, items in house.contents.items():
        for place, item in enumerate(items):
            if item.id not in tag_of:
                raise UntaggedItem(item.id, site)
            thing = thing_in(tag_of[item.id], site.plan.container(name), place)
            things.append(replace(thing, size_m=site.file.tags[thing.tag].size_m))
    return SimulatedState(
        site=site,
        house=house,
        clock=clock,
        body=Body(pose=site.plan.start, speed_mps=TOP_SPEED_MPS, lived_s=clock.body_s()),
        rng=np.random.default_rng(seed),
        things=things,
        faults=sorted(faults, key=lambda fault: fault.at_s),
        fiducials={FIDUCIAL: (site.plan.start.x_m, site.plan.start.y_m, FIDUCIAL_M)},
    )
