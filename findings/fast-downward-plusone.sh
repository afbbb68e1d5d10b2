#!/usr/bin/env bash
# Fast Downward 26.6 (up-fast-downward 1.0.0): cost_type=plusone of a search does not reach its heuristic.
#
# Expected: PDDLStream's ff-astar2 puts plus-one costs on the search and on the heuristic; an option cost_type of the
#   search that uses the heuristic looks like both.
# What happens: the heuristic keeps its own costs; eval_modify_costs changes them. The older transform= of heuristics,
#   which published search strings still use, is refused. On a task where all costs are 0, the heuristic of the start
#   is 0 in the one and the number of steps in the other.
# Who is hurt: whoever carries a published search over to a newer release: another, milder search runs under its name.
# Seen 2026-11-28. Exits 1 if the output changes.
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

driver = Path(up_fast_downward.__file__).parent / "downward" / "fast-downward.py"
Path("domain.pddl").write_text(
    "(define (domain d) (:requirements :strips :action-costs) (:predicates (a) (b) (c))"
    " (:functions (total-cost) - number)"
    " (:action one :parameters () :precondition (a) :effect (and (b) (increase (total-cost) 0)))"
    " (:action two :parameters () :precondition (b) :effect (and (c) (increase (total-cost) 0))))"
)
Path("problem.pddl").write_text(
    "(define (problem p) (:domain d) (:init (a) (= (total-cost) 0)) (:goal (c)) (:metric minimize (total-cost)))"
)
for search in (
    "let(h,ff(),eager_greedy([h],cost_type=plusone))",
    "let(h,eval_modify_costs(ff(),cost_type=plusone),eager_greedy([h],cost_type=plusone))",
    "eager_greedy([ff(transform=adapt_costs(plusone))])",
):
    ran = subprocess.run(
        [sys.executable, str(driver), "domain.pddl", "problem.pddl", "--search", search], capture_output=True, text=True
    )
    value = re.search(r"Initial heuristic value for .*: (\d+)", ran.stdout)
    print(value.group(1) if value else f"refused, exit code {ran.returncode}")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "0
2
refused, exit code 33" ]
