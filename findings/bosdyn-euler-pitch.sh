#!/usr/bin/env bash
# bosdyn-client 5.2.0: quat_to_eulerZYX calls every pitch beyond 57.3 degrees 90 degrees, and takes the roll away.
#
# Expected: the Euler angles of a rotation give the rotation again; only at the pole itself, where yaw and roll turn
#   about the same axis, may one of the two be chosen.
# What happens: the bound for the pole, 0.9999, looks like one of a sine, but is compared with the angle, in radians:
#   from 57.3 degrees on, pitch comes out as 90 degrees, roll as 0 and yaw as a mixture. Nothing is raised.
# Who is hurt: whoever logs or aims the hand or its camera by angles: a camera that looks down by 60 degrees is written
#   down as looking straight down, and a sweep jumps by 30 degrees from one stamp to the next.
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
    turns = Quat.from_yaw(math.radians(yaw)), Quat.from_pitch(math.radians(pitch)), Quat.from_roll(math.radians(roll))
    return turns[0] * turns[1] * turns[2]


for degrees in ((20, 57, 10), (20, 58, 10), (20, 60, 10), (20, -60, 10)):
    back = [math.degrees(angle) for angle in quat_to_eulerZYX(rotation(*degrees))]
    apart = rotation(*degrees).inverse() * rotation(*back)
    off = math.degrees(2 * math.atan2(math.hypot(apart.x, apart.y, apart.z), abs(apart.w)))
    print(degrees, "->", tuple(round(angle) for angle in back), "off by", round(off), "degrees")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "(20, 57, 10) -> (20, 57, 10) off by 0 degrees
(20, 58, 10) -> (14, 90, 0) off by 32 degrees
(20, 60, 10) -> (14, 90, 0) off by 30 degrees
(20, -60, 10) -> (26, -90, 0) off by 30 degrees" ]
