#!/usr/bin/env bash
# opencv-python-headless 4.14.0.94 and 5.0.0.93: no dictionary of OpenCV's aruco module holds the tags of ar_track_alvar.
#
# Expected: what is often said, that OpenCV's aruco also reads ALVAR's tags (5 by 5 squares, as DICT_5X5_* are).
# What happens: none of its dictionaries reads one of the 256 tags of that size with its number, be the border one square
#   wide (OpenCV's default) or two (ALVAR's). A few are read with a wrong number. With a dictionary made from ALVAR's
#   encoding and markerBorderBits = 2, all are read.
# Who is hurt: whoever takes DICT_5X5_1000 for a robot's ALVAR tags: nothing is found, or another object's tag.
# The encoding: https://github.com/ros-perception/ar_track_alvar, Marker.cpp (MarkerData::SetContent), Bitset.cpp.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
cat > show.py <<'PY'
import cv2
import numpy as np


def block(n):
    a, b, c, d = (n >> 3) & 1, (n >> 2) & 1, (n >> 1) & 1, n & 1
    seven = [a ^ b ^ d, a ^ c ^ d, a, b ^ c ^ d, b, c, d]
    return [*seven, sum(seven) % 2]


def code(number):
    bits = iter([*block(number >> 4), *block(number & 15)])
    rows = [[column % 2 if row == 2 else int(row < 2) if column == 2 else next(bits) for column in range(5)]
            for row in range(5)]  # fmt: skip
    return 1 - np.array(rows, np.uint8)


def picture(number):
    return np.kron(np.pad(np.pad(code(number) * 255, 2), 2, constant_values=255), np.ones((20, 20), np.uint8))


def read(dictionary, border):
    settings = cv2.aruco.DetectorParameters()
    settings.markerBorderBits = border
    detector, right, wrong = cv2.aruco.ArucoDetector(dictionary, settings), 0, 0
    for number in range(256):
        _, found, _ = detector.detectMarkers(picture(number).astype(np.uint8))
        if found is not None:
            right += int(np.ravel(found)[0] == number)
            wrong += int(np.ravel(found)[0] != number)
    return right, wrong


for name in ("5X5_1000", "ARUCO_ORIGINAL", "4X4_1000", "APRILTAG_16h5", "APRILTAG_25h9"):
    known = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_{name}"))
    print(name, *(f"border {border}: {right} right, {wrong} wrong;" for border in (1, 2)
                  for right, wrong in [read(known, border)]))  # fmt: skip
codes = np.concatenate([cv2.aruco.Dictionary.getByteListFromBits(code(number)) for number in range(256)])
print("from ALVAR's encoding, border 2: %d right, %d wrong" % read(cv2.aruco.Dictionary(codes, 5, 1), 2))
PY
seen=$(
    for version in 4.14.0.94 5.0.0.93; do
        python3 -m venv "$folder/$version"
        "$folder/$version/bin/pip" install --quiet --disable-pip-version-check \
            "opencv-python-headless==$version" numpy==2.4.6
        echo "OpenCV $version"
        "$folder/$version/bin/python" -W ignore show.py
    done
)
echo "$seen"
[ "$seen" = "OpenCV 4.14.0.94
5X5_1000 border 1: 0 right, 0 wrong; border 2: 0 right, 4 wrong;
ARUCO_ORIGINAL border 1: 0 right, 0 wrong; border 2: 0 right, 0 wrong;
4X4_1000 border 1: 0 right, 14 wrong; border 2: 0 right, 0 wrong;
APRILTAG_16h5 border 1: 0 right, 6 wrong; border 2: 0 right, 0 wrong;
APRILTAG_25h9 border 1: 0 right, 0 wrong; border 2: 0 right, 0 wrong;
from ALVAR's encoding, border 2: 256 right, 0 wrong
OpenCV 5.0.0.93
5X5_1000 border 1: 0 right, 0 wrong; border 2: 0 right, 4 wrong;
ARUCO_ORIGINAL border 1: 0 right, 0 wrong; border 2: 0 right, 0 wrong;
4X4_1000 border 1: 0 right, 14 wrong; border 2: 0 right, 0 wrong;
APRILTAG_16h5 border 1: 0 right, 6 wrong; border 2: 0 right, 0 wrong;
APRILTAG_25h9 border 1: 0 right, 0 wrong; border 2: 0 right, 0 wrong;
from ALVAR's encoding, border 2: 256 right, 0 wrong" ]
