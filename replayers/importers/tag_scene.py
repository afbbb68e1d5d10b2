"""A tag of a bag as a Foxglove scene, as a Spot session draws it: for viewers and for the draft of a survey."""

from __future__ import annotations

from foxglove_schemas_protobuf.CubePrimitive_pb2 import CubePrimitive
from foxglove_schemas_protobuf.KeyValuePair_pb2 import KeyValuePair
from foxglove_schemas_protobuf.Pose_pb2 import Pose
from foxglove_schemas_protobuf.Quaternion_pb2 import Quaternion
from foxglove_schemas_protobuf.SceneEntity_pb2 import SceneEntity
from foxglove_schemas_protobuf.SceneUpdate_pb2 import SceneUpdate
from foxglove_schemas_protobuf.Vector3_pb2 import Vector3
from google.protobuf.duration_pb2 import Duration

from recorders.foxglove.scene import timestamp
from replayers.importers.frames import quaternion_of
from workbench.arrays import Floats

SIDE_M = 0.15
LIFETIME_S = 3


def tag_scene(number: int, map_tform_tag: Floats, stamp_ns: int) -> SceneUpdate:
    """The scene of one tag on the map, its pose as a matrix of shape (4, 4)."""
    x, y, z, w = quaternion_of(map_tform_tag)
    place = (float(each) for each in map_tform_tag[:3, 3])
    pose = Pose(position=Vector3(**dict(zip("xyz", place, strict=True))), orientation=Quaternion(x=x, y=y, z=z, w=w))
    entity = SceneEntity(
        timestamp=timestamp(stamp_ns),
        frame_id="map",
        id=f"tag/{number}",
        lifetime=Duration(seconds=LIFETIME_S),
        metadata=[KeyValuePair(key="tag", value=str(number))],
        cubes=[CubePrimitive(pose=pose, size=Vector3(x=SIDE_M, y=SIDE_M, z=0.02))],
    )
    return SceneUpdate(entities=[entity])
