"""Where is GraphNav's seed frame on the site's map? A survey says it when the two were not made together."""

from __future__ import annotations

from typing import Any

from bosdyn.client.math_helpers import Quat, SE3Pose

from workbench.worlds.geometry import Pose
from workbench.worlds.site import Site


def on_map(site: Site, seed_tform_body: Any) -> Any:
    """A GraphNav pose (bosdyn.api.SE3Pose in the seed frame) on the site's map."""
    seed = site.seed
    if seed == Pose(x_m=0.0, y_m=0.0):
        return seed_tform_body
    return (_helper(seed) * SE3Pose.from_proto(seed_tform_body)).to_proto()


def in_seed(site: Site, pose: Pose) -> Any:
    """A pose of the map as bosdyn.api.SE3Pose in the seed frame."""
    return (_helper(site.seed).inverse() * _helper(pose)).to_proto()


def _helper(pose: Pose) -> SE3Pose:
    return SE3Pose(x=pose.x_m, y=pose.y_m, z=0.0, rot=Quat.from_yaw(pose.yaw_rad))
