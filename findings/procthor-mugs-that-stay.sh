#!/usr/bin/env bash
# procthor 0.0.1.dev2: two of the five mugs of ProcTHOR's asset database cannot be picked up, and so in 22 other types.
#
# Expected: the type of an object says what can be done with it. The package's own placement-annotations.json says of Mug,
#   Fork or Apple isPickupable, by type, and so do tasks ("find a mug, any instance serves").
# What happens: each of these types has assets that came from RoboTHOR, whose primaryProperty is Static or Moveable instead
#   of CanPickup. The house generator (generation/small_objects.py) draws from a type's assets without asking, and nothing
#   in a house's JSON tells such a mug from others but its assetId.
# Who is hurt: whoever evaluates object search or tasks in ProcTHOR houses by type: a find counts of a mug that the
#   database says cannot be picked up, so that success differs from that of the same task in the simulator.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check --no-deps procthor==0.0.1.dev2
cd "$folder"
cat > show.py <<'PY'
import importlib.util
import json
from pathlib import Path

# The files alone: the package imports a simulator.
databases = Path(importlib.util.find_spec("procthor").submodule_search_locations[0]) / "databases"
assets = json.loads((databases / "asset-database.json").read_text())
by_type = json.loads((databases / "placement-annotations.json").read_text())["isPickupable"]
types = others = 0
for name, of_type in assets.items():
    stay = [asset["assetId"] for asset in of_type if asset.get("primaryProperty") != "CanPickup"]
    if by_type.get(name) and stay:
        types, others = types + 1, others + sum(not asset.startswith("RoboTHOR_") for asset in stay)
        if 5 * len(stay) >= 2 * len(of_type):
            print(name, len(stay), "of", len(of_type), *stay)
print(types, "types that are pickupable have assets that are not;", others, "of these assets are not RoboTHOR's")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "BasketBall 1 of 2 RoboTHOR_basketball_rhode_island_novelty_v
ButterKnife 1 of 2 RoboTHOR_butter_knife_ai2_1_v
Fork 1 of 2 RoboTHOR_fork_ai2_v
Mug 2 of 5 RoboTHOR_mug_ai2_1_v RoboTHOR_mug_ai2_2_v
23 types that are pickupable have assets that are not; 0 of these assets are not RoboTHOR's" ]
