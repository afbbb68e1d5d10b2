"""Extracts markers, goals, results and poses from ROS messages of various stacks.

Message types are recognised by their fields, not by their package: stacks often fork message packages.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Any

import numpy as np

from replayers.importers.frames import matrix_of
from workbench.arrays import Floats
from workbench.log_schema.events import NANO

ACTIONLIB_SUCCEEDED, ACTION_SUCCEEDED = 3, 4
"""actionlib_msgs/GoalStatus and action_msgs/GoalStatus."""
ENDED = {"actionlib": (2, 3, 4, 5, 8), "action": (4, 5, 6)}
MOVEIT_SUCCESS = 1


@dataclass(frozen=True, slots=True)
class Marker:
    """A tag, in a frame of the bag; without a pose when tf has it."""

    number: int
    frame: str
    pose: Floats | None


@dataclass(frozen=True, slots=True)
class ActionResult:
    """How an action ended; key identifies the action where the message does."""

    key: str
    success: bool
    words: str = ""


def own_stamp(message: Any) -> tuple[int, bool]:
    """The message's own stamp in nanoseconds, and whether it has a header; of tf, its last transform's.

    A stamp of zero or below counts as 0: not set.
    """
    transforms = getattr(message, "transforms", None)
    if transforms is not None:
        return own_stamp(transforms[-1]) if len(transforms) else (0, False)
    stamp = getattr(getattr(message, "header", None), "stamp", None)
    if stamp is None:
        return 0, False
    seconds = getattr(stamp, "sec", getattr(stamp, "secs", 0))
    nanos = getattr(stamp, "nanosec", getattr(stamp, "nsecs", 0))
    return max(0, int(seconds) * NANO + int(nanos)), True


def markers(message: Any) -> Iterator[Marker]:
    """Tags of ar_track_alvar_msgs, apriltag_ros (ROS 1) and apriltag_msgs (ROS 2)."""
    header = getattr(message, "header", None)
    frame = getattr(header, "frame_id", "")
    for each in getattr(message, "markers", ()):
        stamped = each.pose
        own = stamped.header.frame_id or each.header.frame_id or frame
        yield Marker(int(each.id), own, _pose(stamped.pose))
    for each in getattr(message, "detections", ()):
        numbers = np.atleast_1d(np.asarray(each.id))
        if not len(numbers):
            continue
        posed = getattr(each, "pose", None)
        if posed is None:
            yield Marker(int(numbers[0]), frame, None)
        else:
            inner = posed.pose.pose if hasattr(posed.pose, "pose") else posed.pose
            own = getattr(getattr(posed, "header", None), "frame_id", "") or frame
            yield Marker(int(numbers[0]), own, _pose(inner))


def goal_pose(message: Any) -> tuple[str, Floats, str] | None:
    """(frame, pose, key) of a move_base goal, a PoseStamped, or the end of a Path."""
    key = str(getattr(getattr(message, "goal_id", None), "id", ""))
    if hasattr(message, "goal"):
        stamped = message.goal.target_pose
        return stamped.header.frame_id, _pose(stamped.pose), key
    if hasattr(message, "poses"):
        if not len(message.poses):
            return None
        return message.header.frame_id, _pose(message.poses[-1].pose), key
    if hasattr(message, "pose"):
        return message.header.frame_id, _pose(message.pose), key
    return None


def results(message: Any) -> Iterator[ActionResult]:
    """Ends of actions: actionlib results, status arrays of ROS 1 and ROS 2, MoveIt error codes."""
    if hasattr(message, "status_list"):
        for each in message.status_list:
            ros2 = hasattr(each, "goal_info")
            if int(each.status) in ENDED["action" if ros2 else "actionlib"]:
                key = (
                    bytes(np.asarray(each.goal_info.goal_id.uuid, dtype=np.uint8)).hex() if ros2 else each.goal_id.id
                )
                succeeded = ACTION_SUCCEEDED if ros2 else ACTIONLIB_SUCCEEDED
                yield ActionResult(str(key), int(each.status) == succeeded, f"status {int(each.status)}")
        return
    if not hasattr(message, "status"):
        return
    status = message.status
    success = int(status.status) == ACTIONLIB_SUCCEEDED
    code = getattr(getattr(getattr(message, "result", None), "error_code", None), "val", None)
    if code is not None:
        success = success and int(code) == MOVEIT_SUCCESS
    yield ActionResult(str(status.goal_id.id), success, str(status.text or f"status {int(status.status)}"))


def held(message: Any) -> bool | None:
    """Whether a spot_ros2 manipulator state says that the gripper holds something; None for other messages."""
    value = getattr(message, "is_gripper_holding_item", None)
    return None if value is None else bool(value)


def body_pose(message: Any) -> tuple[str, Floats] | None:
    """(frame, pose) of PoseStamped, PoseWithCovarianceStamped or Odometry."""
    posed = getattr(message, "pose", None)
    if posed is None:
        return None
    inner = posed.pose if hasattr(posed, "pose") else posed
    header = getattr(message, "header", None)
    return (getattr(header, "frame_id", "") or "map"), _pose(inner)


def _pose(pose: Any) -> Floats:
    return matrix_of(pose.position, pose.orientation)
