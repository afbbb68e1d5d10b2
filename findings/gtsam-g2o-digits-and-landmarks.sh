#!/usr/bin/env bash
# gtsam 4.3.0: written as g2o, a map keeps six digits of its coordinates; read from g2o, it loses what it saw of landmarks.
#
# Expected: writeG2o writes poses that readG2o gives again, as other formats and other programs do; readG2o reads the file that
#   g2o writes, landmarks (VERTEX_XY) with their measurements (EDGE_SE2_XY), or says what it leaves out.
# What happens: numbers are printed with six significant digits. In a map in UTM coordinates, northings of five million, poses
#   two metres apart come back rounded to ten metres, up to 5 m off; 1.2 km from the origin it is still 3 mm.
#   Landmarks are read as variables, their measurements are not: no factor holds them, and the optimiser leaves a landmark
#   where the file began it. Nothing is said.
# Who is hurt: whoever hands maps between SLAM programs by g2o: outdoor and georeferenced ones, and maps with landmarks.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check gtsam==4.3.0 numpy==2.4.6
cd "$folder"
cat > show.py <<'PY'
from pathlib import Path

import gtsam

for name, east, north in (("house", 3.2, 4.7), ("campus", 1234.567, 987.654), ("UTM", 448123.456, 5411234.567)):
    values, graph = gtsam.Values(), gtsam.NonlinearFactorGraph()
    for number in range(3):
        values.insert(number, gtsam.Pose2(east + number, north + 2 * number, 0.0))
    gtsam.writeG2o(graph, values, "map.g2o")
    _, again = gtsam.readG2o("map.g2o")
    off = [again.atPose2(key).translation() - values.atPose2(key).translation() for key in range(3)]
    print(name, "comes back off by", *(f"({x:.3f}, {y:.3f})" for x, y in off))

Path("landmark.g2o").write_text("""\
VERTEX_SE2 0 0 0 0
VERTEX_SE2 1 1 0 0
VERTEX_XY 100 5 5
EDGE_SE2 0 1 1 0 0 100 0 0 100 0 400
EDGE_SE2_XY 0 100 3 2 100 0 100
EDGE_SE2_XY 1 100 2 2 100 0 100
""")
graph, values = gtsam.readG2o("landmark.g2o")
kinds = [type(graph.at(number)).__name__ for number in range(graph.size())]
print("of 3 variables and 3 edges:", values.size(), "variables and", len(kinds), "edge:", *kinds)
graph.add(gtsam.PriorFactorPose2(0, gtsam.Pose2(), gtsam.noiseModel.Isotropic.Sigma(3, 0.1)))
best = gtsam.LevenbergMarquardtOptimizer(graph, values).optimize()
place = best.atPoint2(next(key for key in values.keys() if key > 1))
print("landmark begun at (5, 5), seen twice at (3, 2), optimised:", [round(float(each), 3) for each in place])
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "house comes back off by (0.000, 0.000) (0.000, 0.000) (0.000, 0.000)
campus comes back off by (0.003, 0.000) (0.003, 0.000) (0.003, 0.000)
UTM comes back off by (-0.456, -4.567) (-0.456, 3.433) (-0.456, 1.433)
of 3 variables and 3 edges: 3 variables and 1 edge: BetweenFactorPose2
landmark begun at (5, 5), seen twice at (3, 2), optimised: [5.0, 5.0]" ]
