#!/usr/bin/env bash
# bosdyn-client 5.2.0 with pillow 13.0.0: depth pictures saved by the SDK open with the bytes of every value swapped.
#
# Expected: save_images_as_files writes a depth picture as PGM so that others read the depths that the robot sent. PGM's
#   two-byte values have the most significant byte first (netpbm's pgm(5)).
# What happens: the values are written as this processor has them, least significant byte first, under a valid header:
#   1000 mm is read as 59395 mm, 2 m as 53255. Nothing is raised by either side, and the size is right.
# Who is hurt: whoever collects depth with the SDK's example and opens the files with Pillow, OpenCV, netpbm or a viewer.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check bosdyn-client==5.2.0 bosdyn-api==5.2.0 bosdyn-core==5.2.0 numpy==2.4.6 pillow==13.0.0
cd "$folder"
cat > show.py <<'PY'
import contextlib
import io

import numpy as np
from bosdyn.api import image_pb2
from bosdyn.client.image import save_images_as_files
from PIL import Image

sent = np.array([[1000, 2000, 3000], [0, 65535, 257]], dtype="<u2")
response = image_pb2.ImageResponse()
response.source.name = "depth"
image = response.shot.image
image.rows, image.cols = sent.shape
image.pixel_format, image.format = image_pb2.Image.PIXEL_FORMAT_DEPTH_U16, image_pb2.Image.FORMAT_RAW
image.data = sent.tobytes()
with contextlib.redirect_stdout(io.StringIO()):
    save_images_as_files([response], filepath=".")
print("sent", sent.tolist())
with Image.open("image-depth.pgm") as picture:
    print("read", np.asarray(picture).tolist())
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "sent [[1000, 2000, 3000], [0, 65535, 257]]
read [[59395, 53255, 47115], [0, 65535, 257]]" ]
