#!/usr/bin/env bash
# Fast Downward 26.6 (up-fast-downward 1.0.0) and unified-planning 1.3.0: of two costs of one action, one is counted.
#
# Expected: increase effects add up (Fox and Long 2003, PDDL 2.1: additive effects may be given several times), so that an
#   action whose effects are (increase (total-cost) (travel ?a ?b)) and (increase (total-cost) (search ?b)) costs the sum.
#   A planner that takes one alone refuses the other.
# What happens: Fast Downward keeps the last, unified-planning's PDDLReader the first as the action's cost. Of three ways
#   that cost 11, 11 and 8, the one calls the second optimal with cost 1, the other reads a metric by which the first
#   costs 1. No word of any.
# Who is hurt: whoever writes a cost as travel plus handling in two effects: "optimal" plans that are not, and costs that
#   are too low, in tables too. In one effect, :action-costs cannot add; the sum must be written into one function.
# Seen 2026-11-29. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check up-fast-downward==1.0.0 unified-planning==1.3.0
cd "$folder"
cat > show.py <<'PY'
import re
import subprocess
import sys
from pathlib import Path

import up_fast_downward
from unified_planning.io import PDDLReader

COSTS = {"fridge": (1, 10), "sink": (10, 1), "bed": (4, 4)}
Path("domain.pddl").write_text(
    "(define (domain d) (:requirements :strips :typing :action-costs) (:types place)"
    " (:predicates (robot-at ?p - place) (found))"
    " (:functions (travel ?a ?b - place) - number (search ?p - place) - number (total-cost) - number)"
    " (:action go-and-search :parameters (?a ?b - place) :precondition (robot-at ?a) :effect (and (found)"
    "  (increase (total-cost) (travel ?a ?b)) (increase (total-cost) (search ?b)))))"
)
places = {"start": (99, 99), **COSTS}
values = "".join(f" (= (travel {a} {b}) {places[b][0]})" for a in places for b in places)
values += "".join(f" (= (search {b}) {places[b][1]})" for b in places)
Path("problem.pddl").write_text(
    f"(define (problem p) (:domain d) (:objects start {' '.join(COSTS)} - place)"
    f" (:init (robot-at start) (= (total-cost) 0){values}) (:goal (found)) (:metric minimize (total-cost)))"
)
driver = Path(up_fast_downward.__file__).parent / "downward" / "fast-downward.py"
files = ("domain.pddl", "problem.pddl")
ran = subprocess.run([sys.executable, driver, *files, "--search", "astar(blind())"], capture_output=True, text=True)
place = re.search(r"go-and-search start (\w+)", Path("sas_plan").read_text()).group(1)
print("Fast Downward:", place, re.search(r"Plan cost: \d+", ran.stdout).group(), "of", sum(COSTS[place]))
print("unified-planning:", PDDLReader().parse_problem(*files).quality_metrics)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "Fast Downward: sink Plan cost: 1 of 11
unified-planning: [minimize actions-cost: {'go-and-search': travel(a, b), 'default': 0}]" ]
