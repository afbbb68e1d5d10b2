#!/usr/bin/env bash
# pyrobosim 5.0.1: of a ROS map only pure black is a wall, and what it saves for ROS is half a cell off.
#
# Expected: OccupancyGrid.from_file reads the YAML and PGM of map_server ("compatible with ROS tools"): by negate and the two
#   thresholds, darkness above 0.65 is a wall, between the thresholds unknown. A saved grid covers what the world's does.
# What happens: from_file keeps the thresholds and reads no pixel by them. It renames the values 0, 254 and 205; is_occupied
#   asks for exactly 1. Walls of any other dark grey (drawn by hand, scaled, saved by Cartographer or as JPEG) are free, and
#   so is what is unknown; with negate: 1 free space and walls change places. Nothing is said, and A* plans through walls.
#   save_to_file: a cell holds the occupancy of its lower left corner, and map_server takes the origin for a corner of the
#   first cell, so that free space in the file reaches into walls above and to the right by up to a cell.
# Who is hurt: whoever plans in pyrobosim on a map of a real place, or drives by a map that it saved.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pyrobosim==5.0.1 numpy==2.4.6
cd "$folder"
cat > show.py <<'PY'
from pathlib import Path

import numpy as np
import yaml
from PIL import Image
from pyrobosim.core.world import World
from pyrobosim.navigation.occupancy_grid import OccupancyGrid

BLACK, GREY, UNKNOWN, FREE = 0, 60, 205, 254


def read(negate, *row):
    """One row of pixels as pyrobosim reads it, and by the rule of map_server."""
    values = [255 - value for value in row] if negate else row
    Image.fromarray(np.array([values], dtype=np.uint8)).save("map.pgm")
    about = {"image": "map.pgm", "resolution": 0.05, "origin": [0, 0, 0], "negate": negate}
    Path("map.yaml").write_text(yaml.dump({**about, "occupied_thresh": 0.65, "free_thresh": 0.196}))
    grid = OccupancyGrid.from_file(Path(), "map")
    darkness = [value / 255 if negate else 1 - value / 255 for value in values]
    rule = ["wall" if dark > 0.65 else "free" if dark < 0.196 else "unknown" for dark in darkness]
    seen = ["wall" if grid.is_occupied((column, 0)) else "free" for column in range(len(row))]
    print("negate", negate, "map_server:", *rule, "; pyrobosim:", *seen)


for negate in (0, 1):
    read(negate, BLACK, GREY, UNKNOWN, FREE)

world = World()
world.add_room(name="room", footprint=[(-1.03, -1.03), (1.03, -1.03), (1.03, 1.03), (-1.03, 1.03)])
grid = OccupancyGrid.from_world(world, resolution=0.1, xlim=(-1.5, 1.5), ylim=(-1.5, 1.5))
grid.save_to_file(Path().resolve(), "saved")
about = yaml.safe_load(Path("saved.yaml").read_text())
free = np.asarray(Image.open("saved.pgm")).max(axis=0) == FREE
left, right = np.flatnonzero(free)[[0, -1]] * about["resolution"] + about["origin"][0]
print(f"room from -1.03 to 1.03 m; free by the saved map from {left:.2f} to {right + about['resolution']:.2f} m")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "negate 0 map_server: wall wall unknown free ; pyrobosim: wall free free free
negate 1 map_server: wall wall unknown free ; pyrobosim: free free free wall
room from -1.03 to 1.03 m; free by the saved map from -1.00 to 1.10 m" ]
