#!/usr/bin/env bash
# pyastar2d 1.1.4: a diagonal step costs no more than a straight one: straight ahead, the "shortest path" zigzags 39 % longer.
#
# Expected: of a grid whose cells all cost 1, astar_path(allow_diagonal=True) ("8-connectivity", "shortest path") gives a path
#   that is shortest on the floor: a diagonal step is 1.41 cells long. Walls (infinite weights) are not passed through.
# What happens: a step costs the weight of the cell that it enters, whatever its direction, and the heuristic is the larger of
#   the two distances. So all paths of 40 steps to a cell 40 columns away are equal, and a zigzag of 55.7 cells is given where
#   40 lie in a line. Diagonal steps also pass between two wall cells that touch at their corners: a wall drawn as a diagonal
#   line, as in any rotated map, holds nothing back.
# Who is hurt: whoever takes travel distances or robot paths from it: search costs 39 % too high in one direction and right in
#   another, routes through walls. nano-astar 0.1.2 (octile) gives 40 and finds the wall closed.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pyastar2d==1.1.4 nano-astar==0.1.2 numpy==2.4.6
cd "$folder"
cat > show.py <<'PY'
from math import hypot

import nano_astar
import numpy as np
import pyastar2d


def metres(path):
    """Length on the floor in cells, or that there is no path."""
    if path is None:
        return "no path"
    steps = np.diff(np.asarray(path, dtype=int), axis=0)
    return f"{len(steps)} steps, {sum(hypot(*step) for step in steps):.1f} cells"


def show(title, occupied, start, goal):
    weights = np.where(occupied, np.inf, 1).astype(np.float32)
    path = pyastar2d.astar_path(weights, start, goal, allow_diagonal=True)
    other = nano_astar.astar(occupied.astype(np.uint8), start, goal, heuristic="octile")
    print(f"{title}: pyastar2d {metres(path)}; nano-astar {metres(None if other is None else other[0])}")


floor = np.zeros((41, 41), dtype=bool)
show("empty floor, 40 ahead", floor, (20, 0), (20, 40))
show("empty floor, 40 ahead and 5 aside", floor, (18, 0), (23, 40))
show("empty floor, 40 along the diagonal", floor, (0, 0), (40, 40))
wall = np.fliplr(np.eye(41, dtype=bool))
show("behind a diagonal wall", wall, (0, 0), (40, 40))
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "empty floor, 40 ahead: pyastar2d 40 steps, 55.7 cells; nano-astar 40 steps, 40.0 cells
empty floor, 40 ahead and 5 aside: pyastar2d 40 steps, 54.5 cells; nano-astar 40 steps, 42.1 cells
empty floor, 40 along the diagonal: pyastar2d 40 steps, 56.6 cells; nano-astar 40 steps, 56.6 cells
behind a diagonal wall: pyastar2d 41 steps, 57.2 cells; nano-astar no path" ]
