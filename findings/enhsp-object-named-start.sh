#!/usr/bin/env bash
# up-enhsp 0.1.1 with unified-planning 1.3.0: a task with an object named start has "proven" no plan.
#
# Expected: names of objects are free, as long as they are names; the plan is the same whatever places are called. And
#   UNSOLVABLE_PROVEN means that a planner proved it.
# What happens: ENHSP's lexer takes start for the time specifier ("at start"), reads no initial state and ends with
#   code 0 and without a plan; the engine reports every such end as UNSOLVABLE_PROVEN.
# Who is hurt: whoever plans for a robot that has a start pose, and tells a user that the task cannot be done.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check unified-planning==1.3.0 up-enhsp==0.1.1
cd "$folder"
cat > show.py <<'PY'
import unified_planning as up
from unified_planning.io import PDDLReader
from unified_planning.shortcuts import OneshotPlanner, get_environment

get_environment().credits_stream = None
DOMAIN = """(define (domain walk) (:requirements :strips :typing) (:types place)
 (:predicates (robot-at ?p - place))
 (:action go :parameters (?a ?b - place) :precondition (robot-at ?a)
  :effect (and (not (robot-at ?a)) (robot-at ?b))))"""
for name in ("hall", "start"):
    problem = f"(define (problem p) (:domain walk) (:objects {name} sink - place) (:init (robot-at {name}))"
    task = PDDLReader().parse_problem_string(DOMAIN, problem + " (:goal (robot-at sink)))")
    with OneshotPlanner(name="enhsp") as planner:
        answer = planner.solve(task)
    print(name, answer.status.name, [str(a) for a in answer.plan.actions] if answer.plan else None)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "hall SOLVED_SATISFICING ['go(hall, sink)']
start UNSOLVABLE_PROVEN None" ]
