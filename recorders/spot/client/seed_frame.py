"""Conversion between GraphNav's seed frame and the site's map frame."""

from __future__ import annotations

from bosdyn.api import geometry_pb2
from bosdyn.client.math_helpers import Quat, SE3Pose

from workbench.worlds.geometry import Pose
from workbench.worlds.sites.site import Site


def on_map(site: Site, seed_tform_body: geometry_pb2.SE3Pose) -> geometry_pb2.SE3Pose:
    """A GraphNav pose in the seed frame on the site's map."""
    seed = site.seed
    if seed == Pose(x_m=0.0, y_m=0.0):
        return seed_tform_body
    return _helper(seed).mult(SE3Pose.from_proto(seed_tform_body)).to_proto()


def in_seed(site: Site, pose: Pose) -> geometry_pb2.SE3Pose:
    """A pose of the map in the seed frame."""
    return _helper(site.seed).inverse().mult(_helper(pose)).to_proto()


def _helper(pose: Pose) -> SE3Pose:
    return SE3Pose(x=pose.x_m, y=pose.y_m, z=0.0, rot=Quat.from_yaw(pose.yaw_rad))
