#!/usr/bin/env bash
# opencv-python-headless 4.14.0.94 (and 5.1): with CORNER_REFINE_APRILTAG, corners are half a pixel right of and below themselves.
#
# Expected: cornerRefinementMethod says how exactly corners are sought, not in which coordinates they are given: those of
#   OpenCV's other corners, of its calibration and of solvePnP, where the centre of the first pixel is (0, 0).
# What happens: CORNER_REFINE_APRILTAG (documented as "tag and corners detection based on the AprilTag 2 approach") keeps
#   that library's coordinates, where it is (0.5, 0.5). The AprilTag library itself, here by pyapriltags 3.4.3.1, does so
#   too (said in its issue 121, not in its readme), although its poses take OpenCV's camera matrix.
# Who is hurt: whoever gives these corners to solvePnP with a calibrated camera, to get the best of the four methods: each
#   pose is turned by half a pixel to the right and down, 1.4 mm a metre for Spot's body cameras, more than the error of a
#   corner; mixed boards or calibrations by tags and chessboards disagree. Subtracting 0.5 is the remedy.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check opencv-python-headless==4.14.0.94 pyapriltags==3.4.3.1 numpy==2.4.6
cd "$folder"
cat > show.py <<'PY'
import cv2
import numpy as np
from pyapriltags import Detector


def shown(found, true):
    return [round(float(value), 1) + 0.0 for value in np.mean(found, axis=0) - true]


# A chessboard whose first inner corner lies between pixels 99 and 100.
board = np.kron((np.indices((6, 8)).sum(axis=0) % 2 * 255).astype(np.uint8), np.ones((40, 40), np.uint8))
_, corners = cv2.findChessboardCorners(np.pad(board, 60, constant_values=255), (7, 5))
print("chessboard: first corner between pixels 99 and 100 at", [round(float(value), 1) for value in corners[0][0]])

# A tag whose black square covers the pixels 200 to 359 and 100 to 259.
known = cv2.aruco.getPredefinedDictionary(cv2.aruco.DICT_APRILTAG_36h11)
picture = np.full((480, 640), 255, np.uint8)
picture[100:260, 200:360] = cv2.aruco.generateImageMarker(known, 3, 160)
picture = cv2.GaussianBlur(picture, (0, 0), 1.0)
centre = (200 + 359) / 2, (100 + 259) / 2
for method in ("NONE", "SUBPIX", "CONTOUR", "APRILTAG"):
    settings = cv2.aruco.DetectorParameters()
    settings.cornerRefinementMethod = getattr(cv2.aruco, f"CORNER_REFINE_{method}")
    quads, numbers, _ = cv2.aruco.ArucoDetector(known, settings).detectMarkers(picture)
    print("tag", numbers.ravel().tolist(), method, "mean of the corners off by", shown(quads[0][0], centre))
for tag in Detector(families="tag36h11", quad_decimate=1.0).detect(picture):
    print("tag", [tag.tag_id], "pyapriltags off by", shown(tag.corners, centre))
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "chessboard: first corner between pixels 99 and 100 at [99.5, 99.5]
tag [3] NONE mean of the corners off by [0.0, 0.0]
tag [3] SUBPIX mean of the corners off by [0.0, 0.0]
tag [3] CONTOUR mean of the corners off by [0.0, 0.0]
tag [3] APRILTAG mean of the corners off by [0.5, 0.5]
tag [3] pyapriltags off by [0.5, 0.5]" ]
