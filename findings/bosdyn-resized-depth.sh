#!/usr/bin/env bash
# bosdyn-client 5.2.0: a depth picture that was asked for at half size has no points.
#
# Expected: build_image_request(..., resize_ratio=0.5) and depth_image_to_pointcloud of the same SDK fit together: the
#   lens is scaled with the picture.
# What happens: the function takes rows and columns from the source, which keeps the full size, and not from the picture;
#   it raises IndexError (and a lens that is not scaled would put points of a resized picture off their rays).
# Who is hurt: whoever records depth over a slow link, and readers of such logs.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bosdyn-client==5.2.0 bosdyn-api==5.2.0 bosdyn-core==5.2.0 numpy==2.4.6
cd "$folder"
cat > show.py <<'PY'
import numpy as np
from bosdyn.api import image_pb2
from bosdyn.client.image import depth_image_to_pointcloud


def answer(columns, rows):
    response = image_pb2.ImageResponse()
    source, image = response.source, response.shot.image
    source.cols, source.rows, source.depth_scale = 8, 6, 1000
    source.image_type = image_pb2.ImageSource.IMAGE_TYPE_DEPTH
    lens = source.pinhole.intrinsics
    lens.focal_length.x = lens.focal_length.y = 4
    lens.principal_point.x, lens.principal_point.y = 3.5, 2.5
    image.cols, image.rows = columns, rows
    image.pixel_format, image.format = image_pb2.Image.PIXEL_FORMAT_DEPTH_U16, image_pb2.Image.FORMAT_RAW
    image.data = np.full((rows, columns), 1000, dtype="<u2").tobytes()
    return response


print(len(depth_image_to_pointcloud(answer(8, 6))))
try:
    print(len(depth_image_to_pointcloud(answer(4, 3))))
except IndexError:
    print("IndexError")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "48
IndexError" ]
