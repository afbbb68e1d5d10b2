#!/usr/bin/env bash
# pyoctomap 1.2.2: the points of a map are half a voxel off where voxels stand alone, and right where they are merged.
#
# Expected: extractPointCloud ("extract point clouds for occupied and free voxels") gives the centres of voxels, as the
#   iterators over the leaves of the same tree do, and as the method of this name of octomap-python 1.10.0.0 does, whose
#   interface pyoctomap took over. A point that is given as occupied lies in an occupied voxel.
# What happens: points of voxels at the finest level are moved by half a voxel along each axis, on the edge to the next voxel:
#   searched in the tree, they are unknown. Where eight equal voxels were merged, the points are right, so that a map is
#   moved in some parts and not in others. ColorOcTree and OcTreeStamped do the same, CountingOcTree does not. (The
#   division by two of a C integer.) Free points are moved, too.
# Who is hurt: whoever plans on these points, exports them or puts them into another tree: walls are 5 cm off at 10 cm
#   resolution, a map that is read and written again wanders.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pyoctomap==1.2.2 octomap-python==1.10.0.0 numpy==2.4.6
cd "$folder"
cat > show.py <<'PY'
import subprocess
import sys

import numpy as np

ALONE = [[1.05, 0.05, 0.05]]
EIGHT = [[x, y, z] for x in (0.05, 0.15) for y in (0.05, 0.15) for z in (0.05, 0.15)]


def listed(points):
    return sorted([round(float(value), 2) for value in point] for point in points)


def show(name, module):
    for case, points in (("alone", ALONE), ("eight merged", EIGHT)):
        tree = module.OcTree(0.1)
        for point in points:
            tree.updateNode(np.array(point), True)
        occupied, _ = tree.extractPointCloud()
        print(f"{name}, {case}: first point", listed(occupied)[0])
        if name == "pyoctomap":
            found = sum(tree.search(point) is not None for point in occupied)
            leaves = [(listed([leaf.getCoordinate()])[0], round(leaf.getSize(), 2)) for leaf in tree.begin_leafs()]
            print(f"  leaves {leaves}; {found} of {len(occupied)} points are in one")


if sys.argv[1:]:  # each in its own process: both bring OctoMap's library
    show(sys.argv[1], __import__(sys.argv[2]))
else:
    for package, module in (("octomap-python", "octomap"), ("pyoctomap", "pyoctomap")):
        subprocess.run([sys.executable, __file__, package, module], check=True)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "octomap-python, alone: first point [1.05, 0.05, 0.05]
octomap-python, eight merged: first point [0.05, 0.05, 0.05]
pyoctomap, alone: first point [1.1, 0.1, 0.1]
  leaves [([1.05, 0.05, 0.05], 0.1)]; 0 of 1 points are in one
pyoctomap, eight merged: first point [0.05, 0.05, 0.05]
  leaves [([0.1, 0.1, 0.1], 0.2)]; 8 of 8 points are in one" ]
