#!/usr/bin/env bash
# up-enhsp 0.1.1 with unified-planning 1.3.0: an action that ends where it begins leaves the robot nowhere.
#
# Expected: PDDL's effects delete first and add then, so that a fact which an action both deletes and adds holds after it
#   (Fox and Long 2003, Sec. 3; VAL, Fast Downward and unified-planning's validator do it so).
# What happens: ENHSP has the fact deleted where both parameters are the same object. A tour "from a to b" with a = b is a
#   dead end for it: where only that tour helps, no plan is "proven" to exist, and where it would be the cheapest way, the
#   optimal planner (enhsp-opt, SOLVED_OPTIMALLY) takes a dearer one. unified-planning's own validator accepts the cheap one.
# Who is hurt: whoever writes searches, tours or charging trips that may return, as actions over two places.
# Seen 2026-11-28. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check unified-planning==1.3.0 up-enhsp==0.1.1
cd "$folder"
cat > show.py <<'PY'
from unified_planning.io import PDDLReader
from unified_planning.shortcuts import OneshotPlanner, PlanValidator, get_environment

get_environment().credits_stream = None
DOMAIN = """(define (domain tours) (:requirements :strips :typing :action-costs) (:types place)
 (:predicates (robot-at ?p - place) (seen) (reported))
 (:functions (total-cost) - number (tour-cost ?a ?b - place) - number)
 (:action tour :parameters (?a ?b - place) :precondition (robot-at ?a)
  :effect (and (not (robot-at ?a)) (robot-at ?b) (seen) (increase (total-cost) (tour-cost ?a ?b))))
 (:action report :parameters (?a - place) :precondition (and (robot-at ?a) (seen))
  :effect (and (reported) (increase (total-cost) 1))))"""
for places, costs in (("hall", {("hall", "hall"): 5}), ("hall sink", {("hall", "hall"): 5, ("hall", "sink"): 40})):
    every = [(a, b) for a in places.split() for b in places.split()]
    facts = " ".join(f"(= (tour-cost {a} {b}) {costs.get((a, b), 90)})" for a, b in every)
    text = f"(define (problem p) (:domain tours) (:objects {places} - place)"
    text += f" (:init (robot-at hall) (= (total-cost) 0) {facts}) (:goal (reported)) (:metric minimize (total-cost)))"
    reader = PDDLReader()
    task = reader.parse_problem_string(DOMAIN, text)
    with OneshotPlanner(name="enhsp-opt") as planner:
        answer = planner.solve(task)
    print(places, answer.status.name, [str(a) for a in answer.plan.actions] if answer.plan else None)
    cheap = reader.parse_plan_string(task, "(tour hall hall)\n(report hall)")
    with PlanValidator(name="sequential_plan_validator") as validator:
        print("  tour(hall, hall), report(hall):", validator.validate(task, cheap).status.name, "cost 6")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "hall UNSOLVABLE_PROVEN None
  tour(hall, hall), report(hall): VALID cost 6
hall sink SOLVED_OPTIMALLY ['tour(hall, sink)', 'report(sink)']
  tour(hall, hall), report(hall): VALID cost 6" ]
