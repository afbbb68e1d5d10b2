"""Bags for tests: a short trip through the paper's home, written with rosbags in ROS's own message definitions.

The trip: from the start to the countertop, where tag 101 stands; to the dining table, where tag 102 stands and is
picked; to the bed, where it is put down. tf at 5 Hz.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from itertools import pairwise
from math import cos, hypot, sin
from pathlib import Path
from typing import Any, Literal

import numpy as np
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from workbench.worlds.house import LocationId
from workbench.worlds.sites.site import Site

START_S = 1_767_000_000
HEADER1 = "std_msgs/Header header\n"

ROS1_TYPES = {
    # ar_track_alvar_msgs, move_base_msgs and moveit_msgs as their packages define them
    "ar_track_alvar_msgs/msg/AlvarMarker": (
        "Header header\nuint32 id\nuint32 confidence\ngeometry_msgs/PoseStamped pose\n"
    ),
    "ar_track_alvar_msgs/msg/AlvarMarkers": "Header header\nAlvarMarker[] markers\n",
    "move_base_msgs/msg/MoveBaseGoal": "geometry_msgs/PoseStamped target_pose\n",
    "move_base_msgs/msg/MoveBaseResult": "",
    "move_base_msgs/msg/MoveBaseActionGoal": "Header header\nactionlib_msgs/GoalID goal_id\nMoveBaseGoal goal\n",
    "move_base_msgs/msg/MoveBaseActionResult": (
        "Header header\nactionlib_msgs/GoalStatus status\nMoveBaseResult result\n"
    ),
    "moveit_msgs/msg/MoveItErrorCodes": "int32 val\nint32 SUCCESS=1\nint32 FAILURE=99999\n",
    "moveit_msgs/msg/ExecuteTrajectoryResult": "MoveItErrorCodes error_code\n",
    "moveit_msgs/msg/ExecuteTrajectoryActionResult": (
        "Header header\nactionlib_msgs/GoalStatus status\nExecuteTrajectoryResult result\n"
    ),
    "tf2_msgs/msg/TFMessage": "geometry_msgs/TransformStamped[] transforms\n",
}

ROS2_TYPES = {
    "ar_track_alvar_msgs/msg/AlvarMarker": (
        "std_msgs/Header header\nuint32 id\nuint32 confidence\ngeometry_msgs/PoseStamped pose\n"
    ),
    "ar_track_alvar_msgs/msg/AlvarMarkers": "std_msgs/Header header\nAlvarMarker[] markers\n",
    "apriltag_msgs/msg/Point": "float64 x\nfloat64 y\n",
    "apriltag_msgs/msg/AprilTagDetection": (
        "string family\nint32 id\nint32 hamming\nfloat32 goodness\nfloat32 decision_margin\nPoint centre\n"
        "Point[4] corners\nfloat64[9] homography\n"
    ),
    "apriltag_msgs/msg/AprilTagDetectionArray": "std_msgs/Header header\nAprilTagDetection[] detections\n",
    "odd_msgs/msg/Unheard": "int32 x\n",
}


def ros1_store() -> Any:
    return _store(Stores.ROS1_NOETIC, ROS1_TYPES)


def ros2_store() -> Any:
    return _store(Stores.ROS2_HUMBLE, ROS2_TYPES)


def _store(base: Any, texts: dict[str, str]) -> Any:
    store = get_typestore(base)
    types: dict[str, Any] = {}
    for name, text in texts.items():
        types.update(get_types_from_msg(text, name))
    store.register({name: fields for name, fields in types.items() if name not in store.fielddefs})
    return store


@dataclass(frozen=True, slots=True)
class Moment:
    """One instant of the trip: pose on the map, what is visible (tag and its place), what happens."""

    at_s: float
    pose: tuple[float, float, float]
    tags: tuple[tuple[int, tuple[float, float, float]], ...] = ()
    goal: str = ""
    arrived: str = ""
    picked: bool = False
    placed: bool = False


def trip(site: Site, *, speed: float = 1.0, every_s: float = 0.2) -> Iterator[Moment]:
    """The trip, moment by moment."""
    stops = ("countertop", "dining_table", "bed")
    tag_at = {"countertop": (101, (2.3, 4.45, 0.9)), "dining_table": (102, (1.5, 1.0, 0.75))}
    at, here = 0.0, LocationId("start")
    for stop in stops:
        target = LocationId(stop)
        path = site.paths.path(here, target)
        assert path is not None
        yield Moment(at, (*path[0], 0.0), goal=stop)
        for a, b in pairwise(path):
            steps = max(1, round(hypot(b[0] - a[0], b[1] - a[1]) / speed / every_s))
            for i in range(1, steps + 1):
                at += every_s
                share = i / steps
                yield Moment(at, (a[0] + (b[0] - a[0]) * share, a[1] + (b[1] - a[1]) * share, 0.0))
        pose = site.paths.standing_pose(target)
        assert pose is not None
        standing = (pose.x_m, pose.y_m, pose.yaw_rad)
        yield Moment(at, standing, arrived=stop)
        for i in range(40):
            at += every_s
            seen = (tag_at[stop],) if stop in tag_at and not (stop == "dining_table" and i > 30) else ()
            yield Moment(
                at, standing, tags=seen, picked=stop == "dining_table" and i == 30, placed=stop == "bed" and i == 30
            )
        here = target


class Ros1Bag:
    """Writes the trip as move_base, ar_track_alvar, MoveIt and tf of ROS 1."""

    def __init__(self, path: Path) -> None:
        self.store = ros1_store()
        self.t = self.store.types
        self.writer = Writer1(path)

    def write(self, site: Site, *, tf: bool = True, goals: bool = True) -> None:
        with self.writer:
            links = self._channel("/tf", "tf2_msgs/msg/TFMessage") if tf else None
            marks = self._channel("/ar_pose_marker", "ar_track_alvar_msgs/msg/AlvarMarkers")
            goal = self._channel("/move_base/goal", "move_base_msgs/msg/MoveBaseActionGoal")
            result = self._channel("/move_base/result", "move_base_msgs/msg/MoveBaseActionResult")
            arm = self._channel("/execute_trajectory/result", "moveit_msgs/msg/ExecuteTrajectoryActionResult")
            noise = self._channel("/rosout_agg", "std_msgs/msg/String")
            self._put(noise, 0.0, self.t["std_msgs/msg/String"](data="hello"))
            for number, m in enumerate(trip(site)):
                if links is not None:
                    self._put(links, m.at_s, self._tf(m))
                if m.goal and goals:
                    self._put(goal, m.at_s, self._goal(m, site))
                if m.arrived and goals:
                    self._put(result, m.at_s, self._result(m, number, "move_base_msgs/msg/MoveBaseResult"))
                if m.tags:
                    self._put(marks, m.at_s, self._markers(m))
                if m.picked or m.placed:
                    for part in range(3):  # an arm's pick is several motions
                        self._put(arm, m.at_s + 0.1 * part, self._arm(m, number * 10 + part))

    def _channel(self, topic: str, kind: str) -> tuple[Any, str]:
        return self.writer.add_connection(topic, kind, typestore=self.store), kind

    def _put(self, channel: tuple[Any, str], at_s: float, message: Any) -> None:
        connection, kind = channel
        self.writer.write(connection, _ns(at_s), self.store.serialize_ros1(message, kind))

    def _header(self, at_s: float, frame: str) -> Any:
        ns = _ns(at_s)
        stamp = self.t["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
        return self.t["std_msgs/msg/Header"](seq=0, stamp=stamp, frame_id=frame)

    def _pose(self, x: float, y: float, z: float, yaw: float) -> Any:
        return self.t["geometry_msgs/msg/Pose"](
            position=self.t["geometry_msgs/msg/Point"](x=x, y=y, z=z),
            orientation=self.t["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=sin(yaw / 2), w=cos(yaw / 2)),
        )

    def _tf(self, m: Moment) -> Any:
        link = self.t["geometry_msgs/msg/TransformStamped"]
        turn = self.t["geometry_msgs/msg/Quaternion"]
        move, vector = self.t["geometry_msgs/msg/Transform"], self.t["geometry_msgs/msg/Vector3"]
        x, y, yaw = m.pose
        return self.t["tf2_msgs/msg/TFMessage"](
            transforms=[
                link(
                    header=self._header(m.at_s, "/map"),
                    child_frame_id="odom",
                    transform=move(
                        translation=vector(x=1.0, y=0.0, z=0.0), rotation=turn(x=0.0, y=0.0, z=0.0, w=1.0)
                    ),
                ),
                link(
                    header=self._header(m.at_s, "odom"),
                    child_frame_id="base_link",
                    transform=move(
                        translation=vector(x=x - 1.0, y=y, z=0.0),
                        rotation=turn(x=0.0, y=0.0, z=sin(yaw / 2), w=cos(yaw / 2)),
                    ),
                ),
            ]
        )

    def _markers(self, m: Moment) -> Any:
        """Seen from the body, as a camera on it would."""
        x, y, yaw = m.pose
        marks = []
        for number, (tx, ty, tz) in m.tags:
            dx, dy = tx - x, ty - y
            local = (cos(yaw) * dx + sin(yaw) * dy, -sin(yaw) * dx + cos(yaw) * dy)
            stamped = self.t["geometry_msgs/msg/PoseStamped"](
                header=self._header(m.at_s, ""), pose=self._pose(local[0], local[1], tz, 0.0)
            )
            mark = self.t["ar_track_alvar_msgs/msg/AlvarMarker"]
            marks.append(mark(header=self._header(m.at_s, "base_link"), id=number, confidence=0, pose=stamped))
        kind = self.t["ar_track_alvar_msgs/msg/AlvarMarkers"]
        return kind(header=self._header(m.at_s, ""), markers=marks)

    def _goal(self, m: Moment, site: Site) -> Any:
        pose = site.paths.standing_pose(LocationId(m.goal))
        assert pose is not None
        stamped = self.t["geometry_msgs/msg/PoseStamped"](
            header=self._header(m.at_s, "map"), pose=self._pose(pose.x_m, pose.y_m, 0.0, pose.yaw_rad)
        )
        return self.t["move_base_msgs/msg/MoveBaseActionGoal"](
            header=self._header(m.at_s, ""),
            goal_id=self._goal_id(m.at_s, m.goal),
            goal=self.t["move_base_msgs/msg/MoveBaseGoal"](target_pose=stamped),
        )

    def _goal_id(self, at_s: float, name: str) -> Any:
        return self.t["actionlib_msgs/msg/GoalID"](stamp=self._header(at_s, "").stamp, id=name)

    def _status(self, at_s: float, name: str) -> Any:
        return self.t["actionlib_msgs/msg/GoalStatus"](goal_id=self._goal_id(at_s, name), status=3, text="done")

    def _result(self, m: Moment, number: int, kind: str) -> Any:
        return self.t["move_base_msgs/msg/MoveBaseActionResult"](
            header=self._header(m.at_s, ""),
            status=self._status(m.at_s, f"{m.arrived}-{number}"),
            result=self.t[kind](structure_needs_at_least_one_member=0)
            if _has_filler(self.t[kind])
            else self.t[kind](),
        )

    def _arm(self, m: Moment, number: int) -> Any:
        code = self.t["moveit_msgs/msg/MoveItErrorCodes"](val=1)
        return self.t["moveit_msgs/msg/ExecuteTrajectoryActionResult"](
            header=self._header(m.at_s, ""),
            status=self._status(m.at_s, f"arm-{number}"),
            result=self.t["moveit_msgs/msg/ExecuteTrajectoryResult"](error_code=code),
        )


class Ros2Bag:
    """Writes the trip as spot_ros2 and Nav2 of ROS 2: tags as frames of tf, goals and status, a map, pictures."""

    def __init__(self, path: Path, plugin: StoragePlugin, *, version: Literal[8, 9] = 9) -> None:
        self.store = ros2_store()
        self.t = self.store.types
        self.writer = Writer2(path, version=version, storage_plugin=plugin)

    def write(self, site: Site, *, tf: bool = True, unheard: bool = False) -> None:
        with self.writer:
            links = self._channel("/tf", "tf2_msgs/msg/TFMessage") if tf else None
            goal = self._channel("/goal_pose", "geometry_msgs/msg/PoseStamped")
            status = self._channel("/navigate_to_pose/_action/status", "action_msgs/msg/GoalStatusArray")
            image = self._channel("/spot/camera/frontleft/image", "sensor_msgs/msg/Image")
            ground = self._channel("/map", "nav_msgs/msg/OccupancyGrid")
            odom = self._channel("/spot/odometry", "nav_msgs/msg/Odometry")
            if unheard:
                kind = "odd_msgs/msg/Unheard"
                self._put(self._channel("/apriltag/detections", kind), 0.0, self.t[kind](x=1))
            self._put(ground, 0.0, self._map(site))
            for number, m in enumerate(trip(site)):
                if links is not None:
                    self._put(links, m.at_s, self._tf(m))
                if m.goal:
                    self._put(goal, m.at_s, self._goal(m, site))
                if m.arrived:
                    self._put(status, m.at_s, self._status(m, number))
                if number % 20 == 0:
                    self._put(image, m.at_s, self._image(m))
                    self._put(odom, m.at_s, self._odom(m))

    def _channel(self, topic: str, kind: str) -> tuple[Any, str]:
        return self.writer.add_connection(topic, kind, typestore=self.store), kind

    def _put(self, channel: tuple[Any, str], at_s: float, message: Any) -> None:
        connection, kind = channel
        self.writer.write(connection, _ns(at_s), self.store.serialize_cdr(message, kind))

    def _header(self, at_s: float, frame: str) -> Any:
        ns = _ns(at_s)
        stamp = self.t["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
        return self.t["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)

    def _pose(self, x: float, y: float, z: float, yaw: float) -> Any:
        return self.t["geometry_msgs/msg/Pose"](
            position=self.t["geometry_msgs/msg/Point"](x=x, y=y, z=z), orientation=self._turn(yaw)
        )

    def _turn(self, yaw: float) -> Any:
        return self.t["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=sin(yaw / 2), w=cos(yaw / 2))

    def _link(self, m: Moment, parent: str, child: str, x: float, y: float, z: float, yaw: float) -> Any:
        return self.t["geometry_msgs/msg/TransformStamped"](
            header=self._header(m.at_s, parent),
            child_frame_id=child,
            transform=self.t["geometry_msgs/msg/Transform"](
                translation=self.t["geometry_msgs/msg/Vector3"](x=x, y=y, z=z), rotation=self._turn(yaw)
            ),
        )

    def _tf(self, m: Moment) -> Any:
        x, y, yaw = m.pose
        links = [self._link(m, "map", "odom", 0.0, 0.0, 0.0, 0.0), self._link(m, "odom", "body", x, y, 0.5, yaw)]
        for number, (tx, ty, tz) in m.tags:
            links.append(self._link(m, "odom", f"filtered_fiducial_{number}", tx, ty, tz, 0.0))
        return self.t["tf2_msgs/msg/TFMessage"](transforms=links)

    def _goal(self, m: Moment, site: Site) -> Any:
        pose = site.paths.standing_pose(LocationId(m.goal))
        assert pose is not None
        return self.t["geometry_msgs/msg/PoseStamped"](
            header=self._header(m.at_s, "map"), pose=self._pose(pose.x_m, pose.y_m, 0.0, pose.yaw_rad)
        )

    def _status(self, m: Moment, number: int) -> Any:
        uuid = self.t["unique_identifier_msgs/msg/UUID"](uuid=np.full(16, number % 250, dtype=np.uint8))
        info = self.t["action_msgs/msg/GoalInfo"](goal_id=uuid, stamp=self._header(m.at_s, "").stamp)
        return self.t["action_msgs/msg/GoalStatusArray"](
            status_list=[self.t["action_msgs/msg/GoalStatus"](goal_info=info, status=4)]
        )

    def _image(self, m: Moment) -> Any:
        pixels = np.full((6, 8), 90, dtype=np.uint8)
        return self.t["sensor_msgs/msg/Image"](
            header=self._header(m.at_s, "frontleft"),
            height=6,
            width=8,
            encoding="mono8",
            is_bigendian=0,
            step=8,
            data=pixels.ravel(),
        )

    def _odom(self, m: Moment) -> Any:
        twist = self.t["geometry_msgs/msg/Twist"](
            linear=self.t["geometry_msgs/msg/Vector3"](x=0.5, y=0.0, z=0.0),
            angular=self.t["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0),
        )
        zeros = np.zeros(36)
        return self.t["nav_msgs/msg/Odometry"](
            header=self._header(m.at_s, "odom"),
            child_frame_id="body",
            pose=self.t["geometry_msgs/msg/PoseWithCovariance"](
                pose=self._pose(*m.pose[:2], 0.5, 0.0), covariance=zeros
            ),
            twist=self.t["geometry_msgs/msg/TwistWithCovariance"](twist=twist, covariance=zeros),
        )

    def _map(self, site: Site) -> Any:
        assert site.grid is not None
        rows, columns = site.grid.occupied.shape
        info = self.t["nav_msgs/msg/MapMetaData"](
            map_load_time=self._header(0.0, "").stamp,
            resolution=site.grid.resolution_m,
            width=columns,
            height=rows,
            origin=self._pose(site.grid.origin[0], site.grid.origin[1], 0.0, 0.0),
        )
        cells = (site.grid.occupied.astype(np.int8) * 100).ravel()
        return self.t["nav_msgs/msg/OccupancyGrid"](header=self._header(0.0, "map"), info=info, data=cells)


def _ns(at_s: float) -> int:
    return START_S * 10**9 + round(at_s * 1e9)


def _has_filler(kind: Any) -> bool:
    return "structure_needs_at_least_one_member" in kind.__dataclass_fields__
