"""Bags of a robot that stands at the countertop of the paper's home for fifteen seconds and sees tag 101 on it.

The map's link to odometry is static. Written for ROS 1 and ROS 2 alike.
"""

from __future__ import annotations

from dataclasses import dataclass
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
from bag_writing import START_S, ros1_store, ros2_store
from rosbags.rosbag1 import Writer as Writer1
from rosbags.rosbag2 import CompressionFormat, CompressionMode, StoragePlugin
from rosbags.rosbag2 import Writer as Writer2

from workbench.worlds.house import LocationId
from workbench.worlds.sites.site import Site

SECONDS, EVERY_S = 15.0, 0.2
TAG_AT = (2.3, 4.45, 0.9)


@dataclass(frozen=True, slots=True, kw_only=True)
class Standing:
    """What is odd about the bag.

    Attributes:
        ros2: for ROS 2, else ROS 1.
        static_age_s: how long before the start the static transform was stamped.
        static_at_s: when it was recorded, seconds after the start.
        header_shift_s: header stamps minus record times.
        camera: frame of the detections; "" for the message without a frame.
        linked: whether that frame is in tf.
        zero_until_s: header stamps are zero until then.
        map_yaw: turn of the map's rows in radians; None for no map.
        pose_frame: frame of a topic of poses; "" for no such topic.
        tf_until_s: transforms end then.
        body: the frame of the robot's body.
    """

    ros2: bool
    static_age_s: float = 0.0
    static_at_s: float = 0.0
    header_shift_s: float = 0.0
    camera: str = "camera"
    linked: bool = True
    zero_until_s: float = 0.0
    map_yaw: float | None = None
    pose_frame: str = ""
    tf_until_s: float = SECONDS
    body: str = "base_link"


class StandingBag:
    """Writes the bag.

    Args:
        storage: of a bag of ROS 2.
        packed: its messages are compressed one by one.
    """

    def __init__(
        self,
        path: Path,
        odd: Standing,
        *,
        storage: StoragePlugin = StoragePlugin.MCAP,
        packed: bool = False,
    ) -> None:
        self.odd, self.path = odd, path
        self.store = ros2_store() if odd.ros2 else ros1_store()
        self.t = self.store.types
        self.writer: Any = Writer2(path, version=9, storage_plugin=storage) if odd.ros2 else Writer1(path)
        if packed:
            self.writer.set_compression(CompressionMode.MESSAGE, CompressionFormat.ZSTD)

    def write(self, site: Site) -> Path:
        pose = site.paths.standing_pose(LocationId("countertop"))
        assert pose is not None
        x, y, yaw = pose.x_m, pose.y_m, pose.yaw_rad
        dx, dy = TAG_AT[0] - x, TAG_AT[1] - y
        seen = (cos(yaw) * dx + sin(yaw) * dy, -sin(yaw) * dx + cos(yaw) * dy, TAG_AT[2])
        moments = [i * EVERY_S for i in range(round(SECONDS / EVERY_S))]
        with self.writer:
            fixed, links, tags = (
                self._channel("/tf_static", "tf2_msgs/msg/TFMessage"),
                self._channel("/tf", "tf2_msgs/msg/TFMessage"),
                self._channel("/ar_pose_marker", MARKERS),
            )
            static = (
                self.odd.static_at_s,
                fixed,
                self._links(-self.odd.static_age_s, ("map", "odom", 0.0, 0.0, 0.0)),
            )
            messages, posed = [static], fixed
            for at in moments:
                body = [("odom", self.odd.body, x, y, yaw)]
                if self.odd.linked:
                    body.append((self.odd.body, "camera", 0.0, 0.0, 0.0))
                messages.append((at, tags, self._markers(at, seen)))
                if at < self.odd.tf_until_s:
                    messages.insert(len(messages) - 1, (at, links, self._links(at, *body)))
                if self.odd.pose_frame:
                    posed = self._channel("/amcl_pose", "geometry_msgs/msg/PoseStamped") if at == 0 else posed
                    messages.append((at, posed, self._posed(at, x, y, yaw)))
            if self.odd.map_yaw is not None:
                messages.append((0.0, self._channel("/map", "nav_msgs/msg/OccupancyGrid"), self._map()))
            for at, channel, message in sorted(messages, key=lambda each: each[0]):
                self._put(channel, at, message)
        return self.path

    def _channel(self, topic: str, kind: str) -> tuple[Any, str]:
        return self.writer.add_connection(topic, kind, typestore=self.store), kind

    def _put(self, channel: tuple[Any, str], at: float, message: Any) -> None:
        serialize = self.store.serialize_cdr if self.odd.ros2 else self.store.serialize_ros1
        self.writer.write(channel[0], START_S * 10**9 + round(at * 1e9), serialize(message, channel[1]))

    def _header(self, at: float, frame: str) -> Any:
        ns = START_S * 10**9 + round((at + self.odd.header_shift_s) * 1e9)
        ns = 0 if 0 <= at < self.odd.zero_until_s else ns
        stamp = self.t["builtin_interfaces/msg/Time"](sec=ns // 10**9, nanosec=ns % 10**9)
        own = {} if self.odd.ros2 else {"seq": 0}
        return self.t["std_msgs/msg/Header"](**own, stamp=stamp, frame_id=frame)

    def _turn(self, yaw: float) -> Any:
        return self.t["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=sin(yaw / 2), w=cos(yaw / 2))

    def _links(self, at: float, *links: tuple[str, str, float, float, float]) -> Any:
        return self.t["tf2_msgs/msg/TFMessage"](
            transforms=[
                self.t["geometry_msgs/msg/TransformStamped"](
                    header=self._header(at, parent),
                    child_frame_id=child,
                    transform=self.t["geometry_msgs/msg/Transform"](
                        translation=self.t["geometry_msgs/msg/Vector3"](x=x, y=y, z=0.0), rotation=self._turn(yaw)
                    ),
                )
                for parent, child, x, y, yaw in links
            ]
        )

    def _pose(self, x: float, y: float, z: float, yaw: float) -> Any:
        return self.t["geometry_msgs/msg/Pose"](
            position=self.t["geometry_msgs/msg/Point"](x=x, y=y, z=z), orientation=self._turn(yaw)
        )

    def _posed(self, at: float, x: float, y: float, yaw: float) -> Any:
        pose = self._pose(x, y, 0.0, yaw)
        return self.t["geometry_msgs/msg/PoseStamped"](header=self._header(at, self.odd.pose_frame), pose=pose)

    def _markers(self, at: float, seen: tuple[float, float, float]) -> Any:
        stamped = self.t["geometry_msgs/msg/PoseStamped"](header=self._header(at, ""), pose=self._pose(*seen, 0.0))
        mark = self.t["ar_track_alvar_msgs/msg/AlvarMarker"](
            header=self._header(at, self.odd.camera), id=101, confidence=0, pose=stamped
        )
        return self.t[MARKERS](header=self._header(at, self.odd.camera), markers=[mark])

    def _map(self) -> Any:
        info = self.t["nav_msgs/msg/MapMetaData"](
            map_load_time=self._header(0.0, "").stamp,
            resolution=0.5,
            width=3,
            height=2,
            origin=self._pose(10.0, 20.0, 0.0, self.odd.map_yaw or 0.0),
        )
        cells = np.array([0, 0, 0, 100, 0, -1], dtype=np.int8)
        return self.t["nav_msgs/msg/OccupancyGrid"](header=self._header(0.0, "map"), info=info, data=cells)


MARKERS = "ar_track_alvar_msgs/msg/AlvarMarkers"
