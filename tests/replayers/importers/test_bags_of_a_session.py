"""A whole session of the simulated Spot, written as the bag that a namespaced spot_ros2 driver with Nav2 would have
made of it, and imported: the same run comes out, with its pictures and its map.
"""

from __future__ import annotations

import json
from collections.abc import Callable
from math import cos, sin
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from bosdyn.api import robot_state_pb2, world_object_pb2
from foxglove_schemas_protobuf.CompressedImage_pb2 import CompressedImage
from foxglove_schemas_protobuf.FrameTransforms_pb2 import FrameTransforms
from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
from rosbags.rosbag2 import StoragePlugin
from rosbags.rosbag2 import Writer as Writer2
from rosbags.typesys import Stores, get_types_from_msg, get_typestore

from replayers.mcap_io.reader import messages
from replayers.runs.run import Run, read
from workbench.cli import run as lios
from workbench.worlds.house import LocationId
from workbench.worlds.sites.site import load_site

NAME = "gouger"
"""The driver's spot_name: before every topic and every frame."""

HELD = "spot_msgs/msg/ManipulatorState"
TYPES = {
    HELD: "float64 gripper_open_percentage\nbool is_gripper_holding_item\nuint8 stow_state\nuint8 carry_state\n",
}


class SessionBag:
    """Writes what a driver would have published while a recorded run went on."""

    def __init__(self, path: Path, run: Run) -> None:
        self.store = get_typestore(Stores.ROS2_JAZZY)
        for name, text in TYPES.items():
            self.store.register(get_types_from_msg(text, name))
        self.t, self.run, self.path = self.store.types, run, path
        self._channels: dict[str, Any] = {}
        self.pictures = 0

    def write(self) -> None:
        found: list[tuple[int, Callable[[], None]]] = []
        for message in messages(self.run.path):
            handle = {
                "/tf": self._tf,
                "/robot/odometry": self._odometry,
                "/spot/world_objects": self._fiducials,
                "/spot/robot_state": self._gripper,
                "/camera/frontleft_fisheye": self._picture,
            }.get(message.topic)
            if handle is not None:
                at, data = message.publish_time, message.data
                found.append((at, lambda handle=handle, at=at, data=data: handle(at, data)))
        for index, action in enumerate(self.run.actions):
            if action.action == "move":
                found.append((action.start.ns, lambda action=action: self._goal(action)))
                found.append((action.stamp.ns, lambda action=action, index=index: self._status(action, index)))
        with Writer2(self.path, version=9, storage_plugin=StoragePlugin.MCAP) as self.writer:
            self._map()
            for _, put in sorted(found, key=lambda entry: entry[0]):
                put()

    def _put(self, topic: str, kind: str, at: int, message: Any) -> None:
        if topic not in self._channels:
            self._channels[topic] = self.writer.add_connection(topic, kind, typestore=self.store)
        self.writer.write(self._channels[topic], at, self.store.serialize_cdr(message, kind))

    def _header(self, at: int, frame: str) -> Any:
        stamp = self.t["builtin_interfaces/msg/Time"](sec=at // 10**9, nanosec=at % 10**9)
        return self.t["std_msgs/msg/Header"](stamp=stamp, frame_id=frame)

    def _link(self, at: int, parent: str, child: str, position: Any, turn: Any) -> Any:
        return self.t["geometry_msgs/msg/TransformStamped"](
            header=self._header(at, parent),
            child_frame_id=child,
            transform=self.t["geometry_msgs/msg/Transform"](
                translation=self.t["geometry_msgs/msg/Vector3"](x=position.x, y=position.y, z=position.z),
                rotation=self.t["geometry_msgs/msg/Quaternion"](x=turn.x, y=turn.y, z=turn.z, w=turn.w),
            ),
        )

    def _put_tf(self, at: int, links: list[Any]) -> None:
        if links:
            self._put("/tf", "tf2_msgs/msg/TFMessage", at, self.t["tf2_msgs/msg/TFMessage"](transforms=links))

    def _tf(self, at: int, data: bytes) -> None:
        names = {"odom": f"{NAME}/odom", "base_link": f"{NAME}/body", "vision": f"{NAME}/vision", "map": "map"}
        links = FrameTransforms.FromString(data).transforms
        self._put_tf(
            at,
            [
                self._link(at, names[x.parent_frame_id], names[x.child_frame_id], x.translation, x.rotation)
                for x in links
                if x.child_frame_id in names
            ],
        )

    def _fiducials(self, at: int, data: bytes) -> None:
        """Only what was detected in the last second, as the driver does."""
        answer = world_object_pb2.ListWorldObjectResponse.FromString(data)
        now = answer.header.response_timestamp.ToNanoseconds()
        links = []
        for thing in answer.world_objects:
            frame = thing.apriltag_properties.frame_name_fiducial_filtered
            if not frame or now - thing.acquisition_time.ToNanoseconds() > 10**9:
                continue
            pose = thing.transforms_snapshot.child_to_parent_edge_map[frame].parent_tform_child
            links.append(self._link(at, f"{NAME}/body", f"{NAME}/{frame}", pose.position, pose.rotation))
        self._put_tf(at, links)

    def _gripper(self, at: int, data: bytes) -> None:
        state = robot_state_pb2.RobotState.FromString(data).manipulator_state
        held = self.t[HELD](
            gripper_open_percentage=state.gripper_open_percentage,
            is_gripper_holding_item=state.is_gripper_holding_item,
            stow_state=1,
            carry_state=1,
        )
        self._put(f"/{NAME}/manipulation_state", HELD, at, held)

    def _odometry(self, at: int, data: bytes) -> None:
        body = PoseInFrame.FromString(data).pose
        zero = self.t["geometry_msgs/msg/Vector3"](x=0.0, y=0.0, z=0.0)
        covariance = np.zeros(36)
        self._put(
            f"/{NAME}/odometry",
            "nav_msgs/msg/Odometry",
            at,
            self.t["nav_msgs/msg/Odometry"](
                header=self._header(at, f"{NAME}/odom"),
                child_frame_id=f"{NAME}/body",
                pose=self.t["geometry_msgs/msg/PoseWithCovariance"](
                    pose=self._pose(body.position, body.orientation), covariance=covariance
                ),
                twist=self.t["geometry_msgs/msg/TwistWithCovariance"](
                    twist=self.t["geometry_msgs/msg/Twist"](linear=zero, angular=zero), covariance=covariance
                ),
            ),
        )

    def _pose(self, position: Any, turn: Any) -> Any:
        return self.t["geometry_msgs/msg/Pose"](
            position=self.t["geometry_msgs/msg/Point"](x=position.x, y=position.y, z=position.z),
            orientation=self.t["geometry_msgs/msg/Quaternion"](x=turn.x, y=turn.y, z=turn.z, w=turn.w),
        )

    def _picture(self, at: int, data: bytes) -> None:
        self.pictures += 1
        header = self._header(at, f"{NAME}/frontleft_fisheye")
        kind = "sensor_msgs/msg/CompressedImage"
        pixels = np.frombuffer(CompressedImage.FromString(data).data, dtype=np.uint8)
        self._put(
            f"/{NAME}/camera/frontleft/compressed",
            kind,
            at,
            self.t[kind](header=header, format="rgb8; jpeg compressed bgr8", data=pixels),
        )
        kind = "sensor_msgs/msg/CameraInfo"
        region = self.t["sensor_msgs/msg/RegionOfInterest"](0, 0, 0, 0, False)
        lens = np.array([300.0, 0, 160, 0, 300, 120, 0, 0, 1])
        info = self.t[kind](
            header, 240, 320, "plumb_bob", np.zeros(5), lens, np.eye(3).ravel(), np.zeros(12), 0, 0, region
        )
        self._put(f"/{NAME}/camera/frontleft/camera_info", kind, at, info)

    def _goal(self, action: Any) -> None:
        pose = self.run.place.standing[LocationId(action.target)]
        place = self.t["geometry_msgs/msg/Point"](x=pose.x_m, y=pose.y_m, z=0.0)
        turn = self.t["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=sin(pose.yaw_rad / 2), w=cos(pose.yaw_rad / 2))
        kind, at = "geometry_msgs/msg/PoseStamped", action.start.ns
        goal = self.t[kind](header=self._header(at, "map"), pose=self._pose(place, turn))
        self._put("/goal_pose", kind, at, goal)

    def _status(self, action: Any, index: int) -> None:
        uuid = self.t["unique_identifier_msgs/msg/UUID"](uuid=np.full(16, index % 250, dtype=np.uint8))
        at = action.stamp.ns
        info = self.t["action_msgs/msg/GoalInfo"](goal_id=uuid, stamp=self._header(at, "").stamp)
        status = 4 if action.success else 6
        kind = "action_msgs/msg/GoalStatusArray"
        each = self.t["action_msgs/msg/GoalStatus"](goal_info=info, status=status)
        self._put("/navigate_to_pose/_action/status", kind, at, self.t[kind](status_list=[each]))

    def _map(self) -> None:
        grid = load_site("paper_home").grid
        assert grid is not None
        at = min(action.start.ns for action in self.run.actions)
        rows, columns = grid.occupied.shape
        x, y = grid.origin
        place = self.t["geometry_msgs/msg/Point"](x=x, y=y, z=0.0)
        turn = self.t["geometry_msgs/msg/Quaternion"](x=0.0, y=0.0, z=0.0, w=1.0)
        info = self.t["nav_msgs/msg/MapMetaData"](
            self._header(at, "").stamp, grid.resolution_m, columns, rows, self._pose(place, turn)
        )
        kind = "nav_msgs/msg/OccupancyGrid"
        cells = (grid.occupied.astype(np.int8) * 100).ravel()
        self._put("/map", kind, at, self.t[kind](header=self._header(at, "map"), info=info, data=cells))


@pytest.fixture(scope="module")
def recorded(tmp_path_factory: pytest.TempPathFactory) -> tuple[Run, SessionBag]:
    folder = tmp_path_factory.mktemp("session")
    wanted = ["-c", "A", "-s", "conditioned-lios", "--estimator", "counts", "--no-cross", "--images-hz", "0.5"]
    assert lios(["evaluate", "spot", *wanted, "-o", str(folder)]) == 0
    run = read(folder / "spot_A_conditioned-lios.mcap")
    bag = SessionBag(folder / "rosbag2", run)
    bag.write()
    return run, bag


def imported(bag: Path, output: Path, *more: str) -> int:
    return lios(["import", str(bag), "--site", "paper_home", "-o", str(output), *more])


def steps(run: Run) -> list[tuple[str, str]]:
    return [(action.action, action.target) for action in run.actions if action.success]


@pytest.mark.ci
def test_the_same_run_comes_out_of_its_bag(
    recorded: tuple[Run, SessionBag], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    was, bag = recorded
    task = load_site("paper_home").path.parent / "deliver.yaml"
    log = tmp_path / "imported.mcap"
    options = ("--task", str(task), "--estimator", "counts", "--json")
    assert imported(bag.path, log, *options) == 0
    shut = read(log)
    closed = {entry.id for entry in load_site("paper_home").file.containers if entry.closed}
    assert not [seen for seen in shut.observations if seen.container in closed and not seen.items]
    capsys.readouterr()
    assert imported(bag.path, log, *options, "--furniture-open", "--force") == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["mapping"] == "spot_ros2"
    now = read(log)
    put_down_at = {target for action, target in steps(was) if action == "place"}
    looked_into = {o.container for o in was.observations}
    by_the_way = {("search", target) for target in put_down_at - looked_into}
    """A robot that stands at a container to put something down has seen what it holds; the bag says no more."""
    assert [step for step in steps(now) if step not in by_the_way] == steps(was)
    held = {o.container: sorted(item.id for item in o.items) for o in was.observations}
    seen = {o.container: sorted(item.id for item in o.items) for o in now.observations}
    assert seen == held | {target: [] for _, target in by_the_way}
    assert now.outcome is not None
    assert was.outcome is not None
    assert now.outcome.status == was.outcome.status
    assert now.outcome.cost - len(by_the_way) == pytest.approx(was.outcome.cost, rel=0.05)
    topics: dict[str, int] = {}
    for message in messages(log):
        topics[message.topic] = topics.get(message.topic, 0) + 1
    assert topics[f"/camera/{NAME}/frontleft"] == bag.pictures
    assert topics[f"/camera/{NAME}/frontleft/calibration"] == 1
    assert topics["/map"] >= 1
    capsys.readouterr()
    assert lios(["doctor", str(log), "--json"]) == 0
    assert json.loads(capsys.readouterr().out)["verdict"] in ("fine", "clean")
    assert lios(["replay", str(log), "--strategies", "pes-greedy,conditioned-lios", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert {row["status"] for row in rows} <= {"done", "undetermined"}


@pytest.mark.ci
def test_a_site_is_drafted_from_a_bag(
    recorded: tuple[Run, SessionBag], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    was, bag = recorded
    log = tmp_path / "imported.mcap"
    assert imported(bag.path, log, "--strategy", "none") == 0
    capsys.readouterr()
    assert lios(["site", "from-log", str(log), "-o", str(tmp_path / "home"), "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    stood = {action.target for action in was.actions if action.action == "move"}
    assert set(answer["stops"]) <= {str(c.id) for c in was.place.plan.containers}
    assert len(answer["stops"]) == len(stood)
    assert answer["map"]
    assert lios(["site", "check", str(tmp_path / "home")]) in (0, 1)


@pytest.mark.ci
def test_two_robots_in_one_bag_are_told_apart_by_the_mapping(
    recorded: tuple[Run, SessionBag], tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """With two robots no frame can be guessed: the message names the frames, a mapping settles it."""
    from replayers.importers.frames import FrameBuffer

    _, bag = recorded
    frames = FrameBuffer()
    for parent, child in (("a/odom", "a/body"), ("b/odom", "b/body"), ("map", "a/odom")):
        frames._links[child] = (parent, np.eye(4))
    assert frames.named("body") == "body"
    assert frames.named("/map") == "map"
    mapping = tmp_path / "mapping.yaml"
    mapping.write_text(
        "lios_bag_mapping: 1\nname: mine\nframes: {map: map, odom: odom, body: torso}\ntopics: {tf: [/tf]}\n"
    )
    assert imported(bag.path, tmp_path / "x.mcap", "-m", str(mapping)) == 2
    err = capsys.readouterr().err
    assert f"{NAME}/body" in err
    assert len(err.strip().splitlines()) == 1
