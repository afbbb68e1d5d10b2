"""The Spot as a World: walks by GraphNav, looks by fiducials, and handles items with its arm or a helper.

Answers to the closed loop are values. Conditions that end the run (stop key, lost lease, network down) raise
RunStopped, which ends it as ABORTED (abort_guard.py).
"""

from __future__ import annotations

from collections.abc import Callable, Collection, Mapping
from dataclasses import dataclass, field, replace
from math import hypot
from types import MappingProxyType
from typing import Any, TypeVar, final

from bosdyn.api import geometry_pb2, world_object_pb2
from bosdyn.api.graph_nav import graph_nav_pb2, map_pb2
from bosdyn.client.exceptions import LeaseUseError, ResponseError, RpcError, UnauthenticatedError
from bosdyn.client.lease import Error as LeaseClientError
from bosdyn.client.math_helpers import SE3Pose

from recorders.spot.client.battery import STOP_PERCENT, charge_percent
from recorders.spot.client.connection import Connection, reason_of
from recorders.spot.client.control import Control
from recorders.spot.client.errors import NoMap, RunStopped, WaypointMissing
from recorders.spot.client.graph_nav_map import waypoint_ids
from recorders.spot.client.localization import Localization, is_localized
from recorders.spot.client.odometer import WalkLog
from recorders.spot.client.seed_frame import on_map
from recorders.spot.run.localize import localize_by_fiducial
from recorders.spot.run.look_around import look_around
from recorders.spot.run.manipulation import ArmManipulator, Handling, HelperManipulator, Manipulator, Picked
from recorders.spot.run.navigate import LEASE_LOST, WalkEnd, WalkEnding, walk
from recorders.spot.run.operator import NoOperator, Operator, StopSwitch
from recorders.spot.run.operator_requests import SKIPPED, OperatorRequests
from recorders.spot.run.run_settings import RunSettings
from recorders.spot.run.tag_watch import TagWatch
from recorders.spot.session.foxglove import map_from_odom
from recorders.spot.tags.detections import TagSighting, place_on_map, robot_detections
from recorders.spot.tags.item_places import ItemPlaces
from recorders.spot.tags.pictures import picture_detections, relevant_detections, tag_sizes
from workbench.errors import LiosError
from workbench.log_schema.events import NANO
from workbench.message_enum import Result
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START, ContainerId, Contents, FloorPlan, Item, ItemId, ItemType, LocationId
from workbench.worlds.sites.site import Site, starting_at
from workbench.worlds.travel import Paths, TravelCosts
from workbench.worlds.world import ActionDone, ActionRefused, LookResult, NotInLog

Answer = TypeVar("Answer")
BATTERY_EVERY_S = 5.0
DOWNLOAD_TIMEOUT_S = 60.0
"""Time limit of the map's download over a slow network."""
ENDING_S = 3.0
"""How long an answer is waited for while the robot comes to rest after a run."""


def _refused(start_ns: int, end_ns: int, reason: str) -> ActionRefused:
    return ActionRefused(start_ns=start_ns, end_ns=end_ns, reason=reason)


@final
@dataclass(slots=True, kw_only=True)
class SpotWorld:
    """A Spot in a site, under control. Implements World.

    Attributes:
        tell: called with what the log should say in words.
        recording_trouble: why nothing is recorded any more; None while it is.
        ending: whether the run is over and the robot only comes to rest: neither keys nor outages stop that.
        requests: what the operator wants by key.
        opened_by: who opened which closed furniture.
        shown_by_operator: items that are there by the operator's word; a tag that is not seen does not make them
            absent.
        hands: what picks and places. places: where looks have shown items.
        known: contents of containers that are known before the run, from earlier logs.
        watch: what looks out for tags in passing; None where these do not count.
        localized: where, by which tag and how long ago the robot was last localised; None before.
    """

    connection: Connection
    control: Control
    site: Site
    settings: RunSettings = field(default_factory=RunSettings)
    operator: Operator = field(default_factory=NoOperator)
    stop: StopSwitch = field(default_factory=StopSwitch)
    requests: OperatorRequests = field(default_factory=OperatorRequests)
    at: LocationId | None = None
    known: Contents = field(default_factory=lambda: MappingProxyType({}))
    tell: Callable[[str], None] = field(default=lambda _text: None)
    watch: TagWatch | None = None
    localized: Localization | None = None
    recording_stop_reason: Callable[[], LiosError | None] = field(default=lambda: None)
    ending: bool = False
    _power_checked_ns: int = 0
    opened_by: dict[LocationId, str] = field(default_factory=dict)
    shown_by_operator: set[ItemId] = field(default_factory=set[ItemId])
    hands: Manipulator = field(init=False)
    places: ItemPlaces = field(init=False)

    def __post_init__(self) -> None:
        self.places = ItemPlaces(self.site.plan, margin_m=self.settings.margin_m)
        arm = self.site.robot.arm and self.call(self.connection.robot.has_arm)
        self.hands = ArmManipulator(self) if arm else HelperManipulator(self)

    @property
    def plan(self) -> FloorPlan:
        return self.site.plan

    @property
    def travel(self) -> TravelCosts:
        return self.site.travel if self.watch is None else self.watch.paths.travel_from(self.at or START)

    @property
    def paths(self) -> Paths:
        return self.site.paths if self.watch is None else self.watch.paths

    def now_ns(self) -> int:
        return self.connection.clock.now_ns()

    def known_at_start(self) -> Contents:
        return self.known

    def seen_at_start(self) -> Mapping[ContainerId, Pose]:
        return {}

    def go_to(
        self, location: LocationId, *, seeking: Collection[ItemType] | None = None
    ) -> ActionDone | ActionRefused:
        """Go to a location; the tag of an item that it looks for, seen in passing, ends the walk."""
        start_ns, walked = self.now_ns(), WalkLog()
        if self.watch is not None:
            self.watch.begin(self.at or START, location, seeking)
        self.check_battery()
        if location != self.at:
            self.requests.forget()
        ended = WalkEnd(ending=WalkEnding.REFUSED)
        for attempt in range(self.settings.attempts):
            if attempt:
                self.wait(self.settings.retry_s)
            if not self._localize():
                ended = WalkEnd(ending=WalkEnding.LOCALIZE, reason="the robot does not know where it is, and stays")
                continue
            ended = walk(self, location, walked)
            if ended.ending in (WalkEnding.ARRIVED, WalkEnding.SAW_ITEM):
                turned = ended.ending is WalkEnding.SAW_ITEM
                seen, stop = ((), None) if self.watch is None else self.watch.end(turned=turned)
                self.at, end_ns = stop or location, self.now_ns()
                done = ActionDone(start_ns=start_ns, end_ns=end_ns, travel_m=walked.metres, path=walked.corners())
                return replace(done, items_seen=seen, ended_at=stop)
            self.tell(f"On the way to {location}: {ended.reason}")
            if ended.ending is WalkEnding.REFUSED:
                break
        return ActionRefused(
            start_ns=start_ns,
            end_ns=self.now_ns(),
            reason=ended.reason,
            travel_m=walked.metres,
            path=walked.corners(),
        )

    def look_into(self, container: ContainerId) -> LookResult | NotInLog | ActionRefused:
        start_ns = self.now_ns()
        if not self._stands_open(container):
            return ActionRefused(start_ns=start_ns, end_ns=self.now_ns(), reason="nobody opened it")
        localized = self._localize()
        start_ns = self.now_ns()  # opening and localising may have taken longer than a look
        seen = look_around(self, start_ns, localized=localized)
        if self.requests.take_skip():
            return ActionRefused(start_ns=start_ns, end_ns=self.now_ns(), reason=SKIPPED)
        if seen is None:
            reason = "the robot does not know where it is, so what it sees cannot be placed"
            return ActionRefused(start_ns=start_ns, end_ns=self.now_ns(), reason=reason)
        there = {item.id for item in self.requests.take_there()}
        if there:
            self.shown_by_operator |= there
            self.tell(f"Correction: {', '.join(sorted(there))} in {container}, as the operator says")
        found = tuple(sorted({*self.places.shown_in(container, seen), *there}))
        self.places.settle(container, found)
        if self.watch is not None:
            self.watch.know(found)
        by_id: Mapping[ItemId, Item] = {item.id: item for item in self.site.tags.values()}
        return LookResult(
            start_ns=start_ns,
            end_ns=self.now_ns(),
            container=container,
            items=tuple(by_id[name] for name in found),
            opened_by=self.opened_by.get(LocationId(container), ""),
        )

    def pick(self, item: ItemId) -> ActionDone | ActionRefused:
        start_ns = self.now_ns()
        picked = self.hands.pick(item) if self._may_reach() else Picked(result=self._not_opened(), item_remains=True)
        answer = self._handled(start_ns, picked.result)
        if isinstance(answer, ActionRefused):
            if self.watch is not None and not picked.item_remains:
                self.watch.forget(item)
            return replace(answer, item_remains=picked.item_remains)
        self.places.moved(item)
        return answer

    def place(self, item: ItemId) -> ActionDone | ActionRefused:
        start_ns = self.now_ns()
        return self._handled(start_ns, self.hands.place(item) if self._may_reach() else self._not_opened())

    def prepare(self, action: str, items: tuple[ItemId, ...]) -> ActionDone | ActionRefused:
        start_ns = self.now_ns()
        done = self.operator.confirm(f"Please {action} {', '.join(items)}, then press y.")
        return self._handled(start_ns, Handling.DONE.result() if done else Handling.NO_HELPER.result(action=action))

    def know_the_map(self) -> None:
        """Look up the site's waypoints on the robot's map, by id or by name.

        Raises:
            NoMap: the robot has no map.
            WaypointMissing: the site's waypoints are not on it.
        """
        graph: map_pb2.Graph = self.call(lambda: self.graph_nav().download_graph(timeout=DOWNLOAD_TIMEOUT_S))
        if not graph.waypoints:
            raise NoMap(str(self.connection.address))
        known, missing, ambiguous = waypoint_ids(graph, self.site.waypoints.values())
        if missing or ambiguous:
            raise WaypointMissing(str(self.connection.address), sorted([*missing, *ambiguous]), ambiguous)
        ids = {place: known[name] for place, name in self.site.waypoints.items()}
        self.site = replace(self.site, waypoints=MappingProxyType(ids))

    def localize(self) -> bool:
        """Localise the robot by the nearest fiducial; False if it sees none. Also one that says that it is localised,
        unless the operator says otherwise: a robot that was carried since is confident of its old localisation.
        """
        return self._localize_by_fiducial(keep=self.settings.keep_localization)

    def start_here(self) -> None:
        """Use the robot's pose as the site's start, if it differs from the survey and there is a map.

        Raises:
            RunStopped: the robot is far from the surveyed start, and travel costs were measured from there.
        """
        body = self.body_pose()
        if body is None:
            raise RunStopped("the robot could not be localised")
        here = Pose(x_m=body.position.x, y_m=body.position.y, yaw_rad=SE3Pose.from_proto(body).rot.to_yaw())
        start = self.site.plan.start
        away = hypot(here.x_m - start.x_m, here.y_m - start.y_m)
        if away <= self.settings.start_within_m:
            return
        if self.site.grid is None:
            raise RunStopped(f"the robot is {away:.1f} m from the surveyed start, and the site has no map")
        waypoints = {place: name for place, name in self.site.waypoints.items() if place != START}
        self.site = replace(starting_at(self.site, here), waypoints=MappingProxyType(waypoints))

    def sightings(self) -> tuple[TagSighting, ...] | None:
        """The currently visible tags on the map; None if the robot is not localised."""
        connection = self.connection
        objects: world_object_pb2.ListWorldObjectResponse = self.call(
            lambda: connection.client("world-objects").list_world_objects(timeout=connection.timeout_s)
        )
        found = robot_detections(objects.world_objects, connection.clock, tag_sizes(self.site))
        ours = self.call(lambda: picture_detections(connection, self.site))
        state = self.localization_state()
        if not is_localized(state):
            return None
        body = on_map(self.site, state.localization.seed_tform_body)
        odom = map_from_odom(body, state.robot_kinematics.transforms_snapshot)
        return None if odom is None else place_on_map(relevant_detections(self.site, (*found, *ours)), odom)

    def body_pose(self) -> geometry_pb2.SE3Pose | None:
        """The body pose on the map; None if the robot is not localised."""
        state = self.localization_state()
        return on_map(self.site, state.localization.seed_tform_body) if is_localized(state) else None

    def wait(self, seconds: float) -> None:
        """Wait, unless the run has to stop.

        Raises:
            RunStopped: stop key, lost lease, low battery, or nothing is recorded any more.
        """
        self.connection.clock.sleep(seconds)
        if self.stop.is_pressed and not self.ending:
            raise RunStopped(self.stop.reason)
        if self.control.lease_lost.is_set():
            raise RunStopped(LEASE_LOST)
        if not self.ending:
            stop_reason = self.recording_stop_reason()
            if stop_reason is not None:
                raise RunStopped(f"recording stopped: {stop_reason}")

    def call(self, ask: Callable[[], Answer]) -> Answer:
        """Call the robot, retrying while the network is down.

        Raises:
            RunStopped: the network stayed down, or the robot refuses the request; or it was down for so long that
                the robot stopped by itself, and nobody says that it may go on.
        """
        asked_ns, failed = self.now_ns(), False
        while True:
            try:
                answer = ask()
            except (LeaseUseError, LeaseClientError) as error:
                raise RunStopped(LEASE_LOST) from error
            except UnauthenticatedError as error:
                if self.now_ns() - asked_ns > round(self.settings.patience_s * 1e9):
                    raise RunStopped("the robot rejects the login tokens that it issued") from error
                self.connection.log_in_again()
                self.wait(self.settings.poll_s)
            except ResponseError:
                self._came_back(asked_ns, failed=failed)
                raise
            except RpcError as error:
                failed = True
                patience_s = ENDING_S if self.ending else self.settings.patience_s
                if self.now_ns() - asked_ns > round(patience_s * 1e9):
                    reason = f"the robot did not answer for {patience_s:g} s ({reason_of(error)})"
                    raise RunStopped(reason) from error
                self.wait(self.settings.poll_s)
            else:
                self._came_back(asked_ns, failed=failed)
                return answer

    def check_battery(self) -> None:
        """Ask for the charge of the battery, at most every BATTERY_EVERY_S.

        Raises:
            RunStopped: it is below STOP_PERCENT.
        """
        if self.now_ns() - self._power_checked_ns < BATTERY_EVERY_S * NANO:
            return
        self._power_checked_ns = self.now_ns()
        timeout_s = self.connection.timeout_s
        charge = charge_percent(
            self.call(lambda: self.connection.client("robot-state").get_robot_state(timeout=timeout_s))
        )
        if charge is not None and charge < STOP_PERCENT:
            raise RunStopped(f"the battery is at {charge:.0f} %, below {STOP_PERCENT:.0f} %")

    def go_on_after(self, why: str) -> None:
        """Go on after the robot has stopped by itself, if `resume` was given or the operator says so.

        Raises:
            RunStopped: neither.
        """
        if self.ending:
            return
        if self.settings.resume:
            self.tell(f"The robot goes on: {why}")
            return
        if self.operator.confirm(f"The robot stopped by itself: {why}. Is the way clear? y lets it go on."):
            self.tell(f"The operator lets the robot go on: {why}")
            return
        if self.stop.is_pressed:
            raise RunStopped(self.stop.reason)
        raise RunStopped(f"the robot stopped by itself ({why}); it goes on by itself only with --resume")

    def _came_back(self, asked_ns: int, *, failed: bool) -> None:
        away_s = (self.now_ns() - asked_ns) / 1e9
        if failed and away_s > self.settings.outage_s:
            self.go_on_after(f"no contact for {away_s:.0f} s")

    def graph_nav(self) -> Any:
        """The SDK's client of GraphNav; its methods have no types."""
        return self.connection.client("graph-nav-service")

    def _handled(self, start_ns: int, result: Result[Handling]) -> ActionDone | ActionRefused:
        if result.kind is not Handling.DONE:
            return _refused(start_ns, self.now_ns(), result.message)
        return ActionDone(start_ns=start_ns, end_ns=self.now_ns())

    def _stands_open(self, container: ContainerId) -> bool:
        """Whether a container may be looked into or reached into; for closed furniture an operator is asked once."""
        if not any(entry.closed for entry in self.site.file.containers if entry.id == container):
            return True
        place = LocationId(container)
        if place not in self.opened_by:
            if self.settings.furniture_open:
                self.opened_by[place] = "operator, before the run"
            elif self.operator.confirm(f"Open {container}, then press y."):
                self.opened_by[place] = "operator"
        return place in self.opened_by

    def _not_opened(self) -> Result[Handling]:
        return Handling.NOT_OPENED.result(container=str(self.at))

    def _may_reach(self) -> bool:
        return self.at is None or self.at == START or self._stands_open(ContainerId(self.at))

    def localization_state(self) -> graph_nav_pb2.GetLocalizationStateResponse:
        timeout_s = self.connection.timeout_s
        return self.call(lambda: self.graph_nav().get_localization_state(timeout=timeout_s))

    def _localize(self) -> bool:
        return self.body_pose() is not None or self._localize_by_fiducial()

    def _localize_by_fiducial(self, *, keep: bool = False) -> bool:
        localized = localize_by_fiducial(self, keep=keep)
        if localized is not None:
            self.localized = localized
            self.tell(f"Localised {localized.in_words()}")
        return localized is not None
