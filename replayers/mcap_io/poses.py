"""The robot's poses in a log."""

from __future__ import annotations

from collections.abc import Iterable
from typing import TYPE_CHECKING

from workbench.log_schema.codec import UndecodableMessage
from workbench.log_schema.events import POSE_TOPIC

if TYPE_CHECKING:
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame


def poses_in(found: Iterable[tuple[int, bytes]]) -> list[tuple[int, PoseInFrame]]:
    """Every foxglove.PoseInFrame with its log time, in nanoseconds.

    Raises:
        UndecodableMessage: one that is none.
    """
    from foxglove_schemas_protobuf.PoseInFrame_pb2 import PoseInFrame
    from google.protobuf.message import DecodeError

    try:
        return [(stamp, PoseInFrame.FromString(data)) for stamp, data in found]
    except DecodeError as error:
        raise UndecodableMessage(POSE_TOPIC, str(error)) from error
