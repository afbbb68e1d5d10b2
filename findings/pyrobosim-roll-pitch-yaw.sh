#!/usr/bin/env bash
# pyrobosim 5.0.1: roll, pitch and yaw are turned in the other order than ROS, SDF and its own trajectories turn them.
#
# Expected: Pose documents "roll angle (about X axis)" and so on, in a robot simulator that exports worlds to Gazebo and speaks
#   ROS: fixed axes, roll first (REP-103, SDF, URDF, tf: "rpy"), so that get_yaw is the heading.
# What happens: the quaternion is made by transforms3d's "rxyz", axes that turn along, yaw last about the tilted z. With one
#   angle alone all is well. With two, a banana that lies on its side (roll 90) and is turned by 90 degrees
#   points another way than asked. WorldGazeboExporter writes the same three numbers into SDF's <pose>, where they mean the
#   other order: the banana lies in Gazebo 120 degrees from where it lay. interpolate_trajectory reads them by scipy's "xyz",
#   fixed axes: the pose halfway is not halfway. get_yaw of a pose given by its quaternion is not the heading.
# Who is hurt: whoever gives objects or grasps in pyrobosim two angles or a quaternion, and compares with Gazebo or ROS.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pyrobosim==5.0.1 transforms3d==0.4.2 scipy==1.17.1 numpy==2.4.6
cd "$folder"
cat > show.py <<'PY'
import re
from contextlib import redirect_stdout
from io import StringIO
from math import acos, atan2, degrees
from pathlib import Path

import numpy as np
from pyrobosim.core.gazebo import WorldGazeboExporter
from pyrobosim.core.yaml_utils import WorldYamlLoader
from pyrobosim.utils.general import get_data_folder
from pyrobosim.utils.pose import Pose
from pyrobosim.utils.trajectory import Trajectory, interpolate_trajectory
from scipy.spatial.transform import Rotation, Slerp


def apart(a, b):
    """Angle between two rotation matrices in degrees."""
    return round(degrees(acos(min(1.0, (np.trace(a.T @ b) - 1) / 2))))


for roll, pitch, yaw in [(0, 0, 90), (90, 0, 0), (90, 0, 90), (30, 20, 60)]:
    pose = Pose(roll=roll, pitch=pitch, yaw=yaw, angle_units="degrees")
    ros = Rotation.from_euler("xyz", [roll, pitch, yaw], degrees=True).as_matrix()  # fixed axes, as in SDF, URDF and tf
    print(f"roll {roll} pitch {pitch} yaw {yaw}: from ROS's rotation by {apart(pose.get_rotation_matrix(), ros)} degrees")

world = WorldYamlLoader().from_file(get_data_folder() / "test_world.yaml")
banana = world.objects[0]
banana.set_pose(Pose(roll=90, yaw=90, angle_units="degrees"))
with redirect_stdout(StringIO()):
    exported = WorldGazeboExporter(world).export(Path.cwd()) / "test_world.sdf"
numbers = re.search(rf"<name>{banana.name}</name>\s*<pose>(.*?)</pose>", exported.read_text()).group(1).split()[3:]
gazebo = Rotation.from_euler("xyz", [float(each) for each in numbers]).as_matrix()
print("in Gazebo", [round(degrees(float(each))) for each in numbers], end=": ")
print("from pyrobosim's by", apart(banana.pose.get_rotation_matrix(), gazebo), "degrees")

quaternion = Rotation.from_euler("xyz", [30, 20, 60], degrees=True).as_quat(scalar_first=True)
pose = Pose(q=quaternion)
ahead = pose.get_rotation_matrix()[:, 0]
print("heading", round(degrees(atan2(ahead[1], ahead[0]))), "get_yaw", round(degrees(pose.get_yaw())))

first, last = (Pose(x=x, roll=0.3, pitch=pitch, yaw=yaw) for x, pitch, yaw in ((0, 0.2, 1.0), (1, -0.4, 2.5)))
middle = interpolate_trajectory(Trajectory([0.0, 1.0], [first, last]), 0.5).poses[1].get_rotation_matrix()
ends = [each.get_rotation_matrix() for each in (first, last)]
halfway = Slerp([0, 1], Rotation.from_matrix(ends))(0.5).as_matrix()
print("halfway, off by", apart(middle, halfway), "degrees; to the ends", [apart(middle, end) for end in ends])
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "roll 0 pitch 0 yaw 90: from ROS's rotation by 0 degrees
roll 90 pitch 0 yaw 0: from ROS's rotation by 0 degrees
roll 90 pitch 0 yaw 90: from ROS's rotation by 120 degrees
roll 30 pitch 20 yaw 60: from ROS's rotation by 37 degrees
in Gazebo [90, 0, 90]: from pyrobosim's by 120 degrees
heading 60 get_yaw 55
halfway, off by 14 degrees; to the ends [46, 49]" ]
