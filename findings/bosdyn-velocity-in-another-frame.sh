#!/usr/bin/env bash
# bosdyn-client 5.2.0: in another frame, a Spot that turns on the spot moves sideways, the faster the further from its start.
#
# Expected: robot_state.proto says of velocity_of_body_in_vision (and of ..._in_odom) that it is expressed in that frame and
#   that "the linear velocity is applied at the origin of the body frame". Such a velocity in another frame is turned, and
#   nothing else. frame_helpers has express_se3_velocity_in_new_frame and express_se2_velocity_in_new_frame to convert it.
# What happens: they multiply by the adjoint of the transform. That is for twists, whose linear velocity is that of the point
#   at the frame's own origin. To the linear velocity they add the turning rate times the distance between the two origins:
#   0.5 rad/s 20 m from where vision began is 10 m/s sideways. The docstrings ("velocity of a in b") do not tell.
# Who is hurt: whoever converts Spot's velocities between vision, odom and body by the SDK's helpers, as for the twist of an
#   odometry message: beside the start all is well, and the error grows with the walk and with drift.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bosdyn-client==5.2.0 bosdyn-api==5.2.0 bosdyn-core==5.2.0
cd "$folder"
cat > show.py <<'PY'
from bosdyn.api import geometry_pb2
from bosdyn.client.frame_helpers import express_se2_velocity_in_new_frame, express_se3_velocity_in_new_frame
from bosdyn.client.math_helpers import Quat, SE3Pose


def snapshot(**x):
    """A robot that looks along the x axis of each frame, x metres from its origin."""
    tree = geometry_pb2.FrameTreeSnapshot()
    tree.child_to_parent_edge_map["body"].SetInParent()
    for name, ahead in x.items():
        edge = tree.child_to_parent_edge_map[name]
        edge.parent_frame_name = "body"
        edge.parent_tform_child.CopyFrom(SE3Pose(-ahead, 0, 0, Quat()).to_proto())
    return tree


motions = {
    "walking": (0.5, 0.0),
    "turning on the spot": (0.0, 0.5),
}
for metres, drift in ((0, 0), (20, 1)):
    tree = snapshot(vision=metres, odom=metres - drift, flat_body=0)
    for name, (ahead, rate) in motions.items():
        velocity = geometry_pb2.SE3Velocity(linear=geometry_pb2.Vec3(x=ahead), angular=geometry_pb2.Vec3(z=rate))
        flat = geometry_pb2.SE2Velocity(linear=geometry_pb2.Vec2(x=ahead), angular=rate)
        answers = {frame: express_se3_velocity_in_new_frame(tree, "vision", frame, velocity) for frame in ("body", "odom")}
        answers["flat_body"] = express_se2_velocity_in_new_frame(tree, "vision", "flat_body", flat)
        shown = (f"{frame} {answer.linear.x:.1f} {answer.linear.y:.1f}" for frame, answer in answers.items())
        print(f"{metres} m", name, *shown, sep="; ")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "0 m; walking; body 0.5 0.0; odom 0.5 0.0; flat_body 0.5 0.0
0 m; turning on the spot; body 0.0 0.0; odom 0.0 0.0; flat_body 0.0 0.0
20 m; walking; body 0.5 0.0; odom 0.5 0.0; flat_body 0.5 0.0
20 m; turning on the spot; body 0.0 10.0; odom 0.0 0.5; flat_body 0.0 10.0" ]
