#!/usr/bin/env bash
# evo 1.38.1: projected into the XZ plane, a heading beyond 90 degrees is folded back, and heading errors vanish.
#
# Expected: --project_to_plane xz (the ground plane of camera frames, as in KITTI's ground truth) keeps the heading, the turn
#   about Y, as xy keeps the turn about Z ("forcing to angle around normal", says the code).
# What happens: the turn about Y is taken from Euler angles, where it is the middle one, which is never beyond 90 degrees: 100
#   degrees become 80, 180 become 0. An estimate of 80 for 100 degrees has an error of 0 instead of 20; relative errors of 30
#   become 10 and the other way round. In the XY plane all is well. Nothing is said.
# Who is hurt: whoever evaluates planar visual odometry by evo_ape or evo_rpe with -r angle_deg --project_to_plane xz: on any
#   route that turns back, headings of the reference and of the estimate are wrong.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check evo==1.38.1 numpy==2.4.6
cd "$folder"
export HOME=$folder  # evo writes its settings there
cat > show.py <<'PY'
import numpy as np
from evo.core.metrics import APE, RPE, PoseRelation
from evo.core.trajectory import Plane, PosePath3D

AXES = {Plane.XZ: 1, Plane.XY: 2}


def path(axis, headings):
    """Poses on a line, turned about one axis."""
    poses = []
    for number, heading in enumerate(np.radians(headings)):
        pose, (first, second) = np.eye(4), [i for i in range(3) if i != axis]
        sine = np.sin(heading) * (1 if axis == 1 else -1)
        pose[first, first] = pose[second, second] = np.cos(heading)
        pose[first, second], pose[second, first] = sine, -sine
        pose[0, 3] = number
        poses.append(pose)
    return PosePath3D(poses_se3=poses)


def error(reference, estimate):
    metrics = APE(PoseRelation.rotation_angle_deg), RPE(PoseRelation.rotation_angle_deg)
    for metric in metrics:
        metric.process_data((reference, estimate))
    return [[round(float(value)) for value in metric.error] for metric in metrics]


for plane, axis in AXES.items():
    reference, estimate = path(axis, [0, 60, 100, 180]), path(axis, [0, 70, 80, 150])
    before = error(reference, estimate)
    reference.project(plane)
    estimate.project(plane)
    print(plane.name, "absolute and relative error", *before, "projected", *error(reference, estimate))
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "XZ absolute and relative error [0, 10, 20, 30] [10, 30, 10] projected [0, 10, 0, 30] [10, 10, 30]
XY absolute and relative error [0, 10, 20, 30] [10, 30, 10] projected [0, 10, 20, 30] [10, 30, 10]" ]
