#!/usr/bin/env bash
# bosdyn-client 5.2.0: the roll, pitch and yaw of a Quat are not angles of one rotation.
#
# Expected: to_yaw, to_pitch and to_roll undo from_yaw, from_pitch and from_roll, so that the three give the rotation
#   again; or the yaw is that of quat_to_eulerZYX in the same module.
# What happens: roll and pitch are Euler angles, the yaw is the twist about the vertical ("closest yaw-only"), which is
#   another angle as soon as the body both rolls and pitches: the three together are another rotation. pose_to_xyz_yaw
#   and SE2Pose.flatten give that yaw too.
# Who is hurt: whoever writes poses down as x, y, z, roll, pitch, yaw, or compares headings with those of ROS or scipy: a
#   body that is tilted by 15 degrees both ways comes out 2 degrees off, a hand that is tilted by 45 degrees 19.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bosdyn-client==5.2.0 bosdyn-api==5.2.0 bosdyn-core==5.2.0 numpy==2.4.6
cd "$folder"
cat > show.py <<'PY'
import math

from bosdyn.client.math_helpers import Quat, quat_to_eulerZYX


def rotation(yaw, pitch, roll):
    return Quat.from_yaw(yaw) * Quat.from_pitch(pitch) * Quat.from_roll(roll)


for degrees in ((30, 0, 40), (30, 15, 15), (30, 45, 45), (30, 50, -80)):
    turn = rotation(*map(math.radians, degrees))
    back = turn.to_yaw(), turn.to_pitch(), turn.to_roll()
    apart = turn.inverse() * rotation(*back)
    off = math.degrees(2 * math.atan2(math.hypot(apart.x, apart.y, apart.z), abs(apart.w)))
    print(
        degrees, "->", tuple(round(math.degrees(angle)) for angle in back), "off by", round(off), "degrees;",
        "yaw of quat_to_eulerZYX", round(math.degrees(quat_to_eulerZYX(turn)[0])),
    )  # fmt: skip
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "(30, 0, 40) -> (30, 0, 40) off by 0 degrees; yaw of quat_to_eulerZYX 30
(30, 15, 15) -> (28, 15, 15) off by 2 degrees; yaw of quat_to_eulerZYX 30
(30, 45, 45) -> (11, 45, 45) off by 19 degrees; yaw of quat_to_eulerZYX 30
(30, 50, -80) -> (73, 50, -80) off by 43 degrees; yaw of quat_to_eulerZYX 30" ]
