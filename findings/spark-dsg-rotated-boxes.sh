#!/usr/bin/env bash
# spark-dsg 1.1.3: a rotated bounding box intersects nothing, not even itself, and its bounds are corners of something else.
#
# Expected: BoundingBox.intersects(other) is true of boxes that share volume, and min and max are the bounds of the box in the
#   world, for each of the three types: AABB, RAABB (turned about z, as objects in Hydra's scene graphs are) and OBB.
# What happens: intersects is right between two AABBs alone; with an RAABB or OBB on either side it is always False, turned or
#   not, while compute_iou of the same pair gives the overlap. min and max are the two opposite corners of the unturned box,
#   turned: at 45 degrees the bounds of a 2 m x 1 m table are 0.7 m x 2.1 m instead of 2.1 m x 2.1 m, at 90 degrees min is
#   above max in x. corners, contains and compute_iou are right.
# Who is hurt: whoever asks a scene graph which objects touch or stand in a region ("what is on the table?"): nothing, ever.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check spark-dsg==1.1.3 numpy==2.4.6
cd "$folder"
cat > show.py <<'PY'
import numpy as np
from spark_dsg import BoundingBox, BoundingBoxType


def box(kind, degrees, x=0.0):
    """A box of 2 m by 1 m by 1 m, turned about z."""
    angle = np.radians(degrees)
    turn = np.array([[np.cos(angle), -np.sin(angle), 0], [np.sin(angle), np.cos(angle), 0], [0, 0, 1]])
    return BoundingBox(kind, np.array([2.0, 1.0, 1.0]), np.array([x, 0.0, 0.0]), turn)


def shown(values):
    return [round(float(value), 2) + 0.0 for value in values[:2]]


beside = box(BoundingBoxType.AABB, 0, x=1.0)
for kind, degrees in [("AABB", 0), ("RAABB", 0), ("RAABB", 45), ("OBB", 45), ("RAABB", 90)]:
    table = box(getattr(BoundingBoxType, kind), degrees)
    print(f"{kind} at {degrees} degrees:")
    print("  with itself: intersects", table.intersects(table), "iou", round(table.compute_iou(table), 2))
    print("  with another:", table.intersects(beside), beside.intersects(table), "iou", round(table.compute_iou(beside), 2))
    print("  min and max", shown(table.min), shown(table.max), end=", ")
    print("of its corners", shown(np.min(table.corners(), axis=0)), shown(np.max(table.corners(), axis=0)))
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "AABB at 0 degrees:
  with itself: intersects True iou 1.0
  with another: True True iou 0.33
  min and max [-1.0, -0.5] [1.0, 0.5], of its corners [-1.0, -0.5] [1.0, 0.5]
RAABB at 0 degrees:
  with itself: intersects False iou 1.0
  with another: False False iou 0.33
  min and max [-1.0, -0.5] [1.0, 0.5], of its corners [-1.0, -0.5] [1.0, 0.5]
RAABB at 45 degrees:
  with itself: intersects False iou 1.0
  with another: False False iou 0.21
  min and max [-0.35, -1.06] [0.35, 1.06], of its corners [-1.06, -1.06] [1.06, 1.06]
OBB at 45 degrees:
  with itself: intersects False iou 1.0
  with another: False False iou 0.21
  min and max [-0.35, -1.06] [0.35, 1.06], of its corners [-1.06, -1.06] [1.06, 1.06]
RAABB at 90 degrees:
  with itself: intersects False iou 1.0
  with another: False False iou 0.14
  min and max [0.5, -1.0] [-0.5, 1.0], of its corners [-0.5, -1.0] [0.5, 1.0]" ]
