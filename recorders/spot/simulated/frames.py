"""Poses as bosdyn messages: planar map poses as SE(3), and the robot's frame tree.

The tree is rooted at `body`, as a Spot's is: odom, vision, flat_body, gpe and detected objects are its children.
"""

from __future__ import annotations

from collections.abc import Mapping
from math import atan2, cos, sin

from bosdyn.api import geometry_pb2, robot_state_pb2
from google.protobuf.timestamp_pb2 import Timestamp

from recorders.spot.simulated.body import Body, DeadReckoning, wrapped
from workbench.log_schema.events import NANO
from workbench.worlds.geometry import Pose

STANDING_M, SITTING_M = 0.52, 0.22
"""Height of the body frame above the floor."""

Position = tuple[float, float, float]


def stamp(stamp_ns: int) -> Timestamp:
    return Timestamp(seconds=stamp_ns // NANO, nanos=stamp_ns % NANO)


def se3(x: float, y: float, z: float, yaw_rad: float) -> geometry_pb2.SE3Pose:
    """A pose rotated about z only."""
    return geometry_pb2.SE3Pose(
        position=geometry_pb2.Vec3(x=x, y=y, z=z),
        rotation=geometry_pb2.Quaternion(x=0.0, y=0.0, z=sin(yaw_rad / 2), w=cos(yaw_rad / 2)),
    )


def optical(x: float, y: float, z: float, yaw_rad: float) -> geometry_pb2.SE3Pose:
    """A camera's pose in the body frame: x right, y down, z along the viewing direction, which is yaw_rad to the
    left of ahead."""
    c, s = cos(yaw_rad / 2), sin(yaw_rad / 2)
    return geometry_pb2.SE3Pose(
        position=geometry_pb2.Vec3(x=x, y=y, z=z),
        rotation=geometry_pb2.Quaternion(x=(-c - s) / 2, y=(c - s) / 2, z=(s - c) / 2, w=(c + s) / 2),
    )


def yaw_of(rotation: geometry_pb2.Quaternion) -> float:
    """The heading of a rotation."""
    q = rotation
    return atan2(2 * (q.w * q.z + q.x * q.y), 1 - 2 * (q.y * q.y + q.z * q.z))


def height_of(body: Body) -> float:
    return STANDING_M if body.standing else SITTING_M


def in_body(body: Body, position: Position) -> Position:
    """A map point in the body frame."""
    dx, dy = position[0] - body.pose.x_m, position[1] - body.pose.y_m
    c, s = cos(body.pose.yaw_rad), sin(body.pose.yaw_rad)
    return (c * dx + s * dy, -s * dx + c * dy, position[2] - height_of(body))


def from_body(body: Body, position: Position) -> Position:
    """A body-frame point on the map."""
    c, s = cos(body.pose.yaw_rad), sin(body.pose.yaw_rad)
    return (
        body.pose.x_m + c * position[0] - s * position[1],
        body.pose.y_m + s * position[0] + c * position[1],
        position[2] + height_of(body),
    )


def inverse(frame: DeadReckoning | Pose, height_m: float) -> geometry_pb2.SE3Pose:
    """body_tform_frame: the pose of odom, vision or the map in the body frame."""
    c, s = cos(frame.yaw_rad), sin(frame.yaw_rad)
    x, y = -c * frame.x_m - s * frame.y_m, s * frame.x_m - c * frame.y_m
    return se3(x, y, -height_m, -frame.yaw_rad)


def frame_tree(
    body: Body, hanging: Mapping[str, tuple[str, geometry_pb2.SE3Pose]] | None = None
) -> geometry_pb2.FrameTreeSnapshot:
    """The tree of frames; `hanging` adds child: (parent, parent_tform_child)."""
    height = height_of(body)
    edges = {
        "body": ("", se3(0, 0, 0, 0)),
        "odom": ("body", inverse(body.odom, height)),
        "vision": ("body", inverse(body.vision, height)),
        "flat_body": ("body", se3(0, 0, 0, 0)),
        "gpe": ("body", se3(0, 0, -height, 0)),
        **(hanging or {}),
    }
    tree = geometry_pb2.FrameTreeSnapshot()
    for child, (parent, transform) in edges.items():
        edge = tree.child_to_parent_edge_map[child]
        edge.parent_frame_name = parent
        edge.parent_tform_child.CopyFrom(transform)
    return tree


def pose_in_map(body: Body, frame: str, x: float, y: float, yaw_rad: float) -> Pose | None:
    """A planar pose in odom, vision or body, converted to the map; None for other frames."""
    if frame in ("body", "flat_body"):
        fx, fy, turn = 0.0, 0.0, 0.0
    elif frame in ("odom", "vision"):
        reckoned = body.odom if frame == "odom" else body.vision
        fx, fy, turn = reckoned.x_m, reckoned.y_m, reckoned.yaw_rad
    else:
        return None
    c, s = cos(-turn), sin(-turn)
    bx, by = c * (x - fx) - s * (y - fy), s * (x - fx) + c * (y - fy)
    mx, my, _ = from_body(body, (bx, by, 0.0))
    return Pose(x_m=mx, y_m=my, yaw_rad=wrapped(body.pose.yaw_rad + yaw_rad - turn))


def point_in_map(body: Body, frame: str, point: Position) -> Position | None:
    """A point in odom, vision or body, converted to the map with its height above the floor; None for
    other frames."""
    pose = pose_in_map(body, frame, point[0], point[1], 0.0)
    if pose is None:
        return None
    return (pose.x_m, pose.y_m, point[2] + (height_of(body) if frame in ("body", "flat_body") else 0.0))


def kinematics(body: Body, robot_ns: int) -> robot_state_pb2.KinematicState:
    """The kinematic state: frames and velocities, without joints."""
    message = robot_state_pb2.KinematicState(
        acquisition_timestamp=stamp(robot_ns), transforms_snapshot=frame_tree(body)
    )
    message.velocity_of_body_in_odom.CopyFrom(se3_velocity(body.odom.velocity))
    message.velocity_of_body_in_vision.CopyFrom(se3_velocity(body.vision.velocity))
    return message


def se3_velocity(planar: tuple[float, float, float]) -> geometry_pb2.SE3Velocity:
    """A velocity along x and y with a turning rate about z."""
    x, y, turn = planar
    return geometry_pb2.SE3Velocity(linear=geometry_pb2.Vec3(x=x, y=y), angular=geometry_pb2.Vec3(z=turn))
