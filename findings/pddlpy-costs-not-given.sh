#!/usr/bin/env bash
# pddlpy 1.2.2: a cost that the problem does not give is 0, so that the robot walks free of charge where there is no way.
#
# Expected: a numeric expression is undefined where :init gives its function no value, and an action whose cost is undefined
#   cannot be applied (Fox and Long 2003, PDDL 2.1). So planners take it, Fast Downward and Kairos among them, and so tables
#   of travel costs leave out pairs of places without a way between them. Constants of a domain are objects like any others.
# What happens: the function counts 0. The planner "ucs", which the documentation calls cost-optimal, goes from the hall to the
#   cellar for 2 and on to the kitchen, where no way leads, for nothing: cost 2 instead of 9. And where all objects are
#   constants, so that the problem has none of its own, there is "no plan": constants are then read without their types.
# Who is hurt: whoever checks or makes plans with it, or gives it to a language model as a tool: costs far too low, impossible
#   trips, and solvable tasks called unsolvable. Nothing is said.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check pddlpy==1.2.2 antlr4-python3-runtime==4.13.2 kairos-planner==1.0.6
cd "$folder"
cat > show.py <<'PY'
from pathlib import Path

import kairos
from pddlpy import DomainProblem
from pddlpy.planning import get

PLACES = "hall cellar kitchen - place"
COSTS = {("hall", "kitchen"): 9, ("hall", "cellar"): 2, ("cellar", "hall"): 2, ("kitchen", "hall"): 9}


def show(title, constants, objects, costs):
    Path("domain.pddl").write_text(
        "(define (domain d) (:requirements :strips :typing :action-costs) (:types place)"
        f" {constants} (:predicates (at ?p - place))"
        " (:functions (total-cost) - number (travel ?a ?b - place) - number)"
        " (:action move :parameters (?a ?b - place) :precondition (at ?a)"
        "  :effect (and (not (at ?a)) (at ?b) (increase (total-cost) (travel ?a ?b)))))"
    )
    values = " ".join(f"(= (travel {a} {b}) {cost})" for (a, b), cost in costs.items())
    Path("problem.pddl").write_text(
        f"(define (problem p) (:domain d) {objects} (:init (at hall) (= (total-cost) 0) {values})"
        " (:goal (at kitchen)) (:metric minimize (total-cost)))"
    )
    plan = get("ucs").solve(DomainProblem("domain.pddl", "problem.pddl"))
    steps = [list(arguments.values()) for _, arguments in plan.action_names()] if plan else "no plan"
    solved = kairos.solve("domain.pddl", "problem.pddl")
    print(f"{title}: pddlpy", *([f"{plan.cost:g}"] if plan else []), steps, end="; ")
    print("Kairos", [list(step.args) for step in solved.plan.steps], solved.stop_reason.name)


no_way = dict.fromkeys([("cellar", "kitchen"), ("kitchen", "cellar")], 1000)
show("every pair given", "", f"(:objects {PLACES})", COSTS | no_way)
show("no way from cellar to kitchen", "", f"(:objects {PLACES})", COSTS)
show("all objects are constants", f"(:constants {PLACES})", "", COSTS | no_way)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "every pair given: pddlpy 9 [['hall', 'kitchen']]; Kairos [['hall', 'kitchen']] PROVEN_OPTIMAL
no way from cellar to kitchen: pddlpy 2 [['hall', 'cellar'], ['cellar', 'kitchen']]; Kairos [['hall', 'kitchen']] PROVEN_OPTIMAL
all objects are constants: pddlpy no plan; Kairos [['hall', 'kitchen']] PROVEN_OPTIMAL" ]
