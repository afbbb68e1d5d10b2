#!/usr/bin/env bash
# opencv-python-headless 4.14.0.94 and 5.0.0.93 with pupil-apriltags 1.0.4.post11: OpenCV holds AprilTags upside down.
#
# Expected: a tag of tag36h11 stands upright as the AprilTag library has it, whoever finds it. OpenCV says of its corners
#   that they go clockwise from the tag's own upper left, the library that they go round from its own lower left.
# What happens: OpenCV's upper left corner is the tag's lower right one; the marker that it draws is, for the AprilTag
#   library, turned by half a turn. Id and outline agree, so that nothing looks wrong. So it is in 16h5 and 25h9 too.
# Who is hurt: whoever mixes the two (tags printed with one and read with the other, Spot's own detections beside those of
#   a picture): grasp poses, dock poses and camera calibrations are half a turn off about the tag's normal.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
cd "$folder"
cat > show.py <<'PY'
import cv2
import numpy as np
from pupil_apriltags import Detector

SIDES = ("left", "right"), ("upper", "lower")


def place(corner):
    return f"{SIDES[1][int(corner[1] > 200)]} {SIDES[0][int(corner[0] > 200)]}"


for name in ("16h5", "25h9", "36h11"):
    family = cv2.aruco.getPredefinedDictionary(getattr(cv2.aruco, f"DICT_APRILTAG_{name}"))
    picture = np.full((400, 400), 255, np.uint8)
    picture[100:300, 100:300] = cv2.aruco.generateImageMarker(family, 3, 200)
    corners, numbers, _ = cv2.aruco.ArucoDetector(family).detectMarkers(picture)
    (tag,) = Detector(families=f"tag{name}").detect(
        picture, estimate_tag_pose=True, camera_params=(400, 400, 200, 200), tag_size=0.1
    )
    turned = round(float(np.degrees(np.arctan2(tag.pose_R[1, 0], tag.pose_R[0, 0])))) % 360
    print(
        name, int(np.ravel(numbers)[0]), tag.tag_id, "the tag's lower left: OpenCV", place(corners[0].reshape(4, 2)[3]),
        "apriltag", place(tag.corners[0]), "turned by", turned,
    )  # fmt: skip
PY
seen=$(
    for version in 4.14.0.94 5.0.0.93; do
        python3 -m venv "$folder/$version"
        "$folder/$version/bin/pip" install --quiet --disable-pip-version-check \
            "opencv-python-headless==$version" pupil-apriltags==1.0.4.post11 numpy==2.4.6
        echo "OpenCV $version"
        "$folder/$version/bin/python" -W ignore show.py
    done
)
echo "$seen"
[ "$seen" = "OpenCV 4.14.0.94
16h5 3 3 the tag's lower left: OpenCV lower left apriltag upper right turned by 180
25h9 3 3 the tag's lower left: OpenCV lower left apriltag upper right turned by 180
36h11 3 3 the tag's lower left: OpenCV lower left apriltag upper right turned by 180
OpenCV 5.0.0.93
16h5 3 3 the tag's lower left: OpenCV lower left apriltag upper right turned by 180
25h9 3 3 the tag's lower left: OpenCV lower left apriltag upper right turned by 180
36h11 3 3 the tag's lower left: OpenCV lower left apriltag upper right turned by 180" ]
