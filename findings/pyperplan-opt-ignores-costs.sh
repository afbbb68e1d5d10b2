#!/usr/bin/env bash
# up-pyperplan 1.1.0 with unified-planning 1.3.0: pyperplan-opt calls a plan optimal that costs 9 where one costs 2.
#
# Expected: an engine without action costs refuses a task that minimises them, or SOLVED_OPTIMALLY means the least cost.
# What happens: a warning that the problem kind is not supported, then the plan of fewest actions, as SOLVED_OPTIMALLY.
# Who is hurt: whoever takes an engine by its name and believes its status; costs over the optimum look like zero.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check unified-planning==1.3.0 up-pyperplan==1.1.0
cd "$folder"
cat > show.py <<'PY'
import unified_planning as up
from unified_planning.io import PDDLReader
from unified_planning.shortcuts import OneshotPlanner, get_environment

get_environment().credits_stream = None
DOMAIN = """(define (domain walk) (:requirements :strips :action-costs) (:predicates (hall) (door) (sink))
 (:functions (total-cost) - number)
 (:action straight :parameters () :precondition (hall) :effect (and (sink) (increase (total-cost) 9)))
 (:action first :parameters () :precondition (hall) :effect (and (door) (increase (total-cost) 1)))
 (:action second :parameters () :precondition (door) :effect (and (sink) (increase (total-cost) 1))))"""
PROBLEM = """(define (problem p) (:domain walk) (:init (hall) (= (total-cost) 0)) (:goal (sink))
 (:metric minimize (total-cost)))"""
with OneshotPlanner(name="pyperplan-opt") as planner:
    answer = planner.solve(PDDLReader().parse_problem_string(DOMAIN, PROBLEM))
print(answer.status.name, [a.action.name for a in answer.plan.actions])
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "SOLVED_OPTIMALLY ['straight']" ]
