#!/usr/bin/env bash
# unified-planning 1.3.0 with tarski 0.9.1 and up-enhsp 0.1.1: converted either way, a task loses its costs without a word.
#
# Expected: interop.convert_problem_from_tarski and convert_problem_to_tarski keep what both libraries can express (tarski has
#   costs of actions and a metric, and reads both from PDDL), and refuse the rest, as they refuse durative actions.
# What happens: both drop the costs and the metric. Of a PDDL file that tarski has read, and whose move it knows the cost of, the
#   converted task has none: the optimal planner takes the way of cost 9 instead of that of cost 4. There and back, state
#   invariants are gone, too, and the plan that they forbid is valid. Nothing is raised or warned. unified-planning's own reader
#   keeps the costs.
# Who is hurt: whoever reads or changes tasks with tarski and solves them with unified-planning's engines, or the other way.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check unified-planning==1.3.0 tarski==0.9.1 up-enhsp==0.1.1
cd "$folder"
cat > show.py <<'PY'
from tarski.io import FstripsReader
from unified_planning.interop import convert_problem_from_tarski, convert_problem_to_tarski
from unified_planning.io import PDDLReader
from unified_planning.plans import SequentialPlan
from unified_planning.shortcuts import And, BoolType, InstantaneousAction, MinimizeActionCosts, Not, OneshotPlanner
from unified_planning.shortcuts import PlanValidator, Problem, get_environment

get_environment().credits_stream = None
DOMAIN = """(define (domain rooms) (:requirements :strips :typing :action-costs) (:types room)
 (:predicates (at ?r - room)) (:functions (total-cost) - number (dist ?a ?b - room) - number)
 (:action move :parameters (?a ?b - room) :precondition (at ?a)
  :effect (and (not (at ?a)) (at ?b) (increase (total-cost) (dist ?a ?b)))))"""
LONG = {("hall", "bath"): 9, ("bath", "hall"): 9}
ROOMS = ("hall", "den", "bath")
DISTANCES = " ".join(f"(= (dist {a} {b}) {LONG.get((a, b), 2)})" for a in ROOMS for b in ROOMS)
TASK = f"""(define (problem p) (:domain rooms) (:objects {" ".join(ROOMS)} - room) 
 (:init (at hall) (= (total-cost) 0) {DISTANCES}) (:goal (at bath)) (:metric minimize (total-cost)))"""

reader = FstripsReader(raise_on_error=True)
reader.parse_domain_string(DOMAIN)
reader.parse_instance_string(TASK)
print("tarski has move's cost:", reader.problem.actions["move"].cost, "and a metric:", reader.problem.plan_metric is not None)
ways = Problem("ways")
there, half = (ways.add_fluent(fact, BoolType(), default_initial_value=False) for fact in ("there", "half"))
straight, first, second = (InstantaneousAction(name) for name in ("straight", "first", "second"))
straight.add_effect(there, True)
first.add_effect(half, True)
second.add_precondition(half)
second.add_effect(there, True)
ways.add_actions([straight, first, second])
ways.add_goal(there)
ways.add_quality_metric(MinimizeActionCosts({straight: 9, first: 2, second: 2}))
for name, problem in (
    ("PDDL, read by unified-planning", PDDLReader().parse_problem_string(DOMAIN, TASK)),
    ("PDDL, read by tarski and converted", convert_problem_from_tarski(get_environment(), reader.problem)),
    ("costs of unified-planning", ways),
    ("costs, there and back", convert_problem_from_tarski(get_environment(), convert_problem_to_tarski(ways))),
):
    with OneshotPlanner(name="enhsp-opt") as planner:
        answer = planner.solve(problem)
    print(f"{name}: {len(problem.quality_metrics)} metric, {answer.status.name}, {len(answer.plan.actions)} actions")

kitchen = Problem("kitchen")
fridge, drawer = (kitchen.add_fluent(fact, BoolType(), default_initial_value=fact == "fridge") for fact in ("fridge", "drawer"))
close, open_it = InstantaneousAction("close-fridge"), InstantaneousAction("open-drawer")
close.add_effect(fridge, False)
open_it.add_effect(drawer, True)
kitchen.add_actions([close, open_it])
kitchen.add_state_invariant(Not(And(fridge, drawer)))
kitchen.add_goal(And(drawer, Not(fridge)))
again = convert_problem_from_tarski(get_environment(), convert_problem_to_tarski(kitchen))
for name, problem in (("invariant", kitchen), ("invariant, there and back", again)):
    plan = SequentialPlan([problem.action("open-drawer")(), problem.action("close-fridge")()])
    with PlanValidator(problem_kind=problem.kind, plan_kind=plan.kind) as validator:
        print(f"{name}: both open for a while is {validator.validate(problem, plan).status.name}")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "tarski has move's cost: dist(?a, ?b) and a metric: True
PDDL, read by unified-planning: 1 metric, SOLVED_OPTIMALLY, 2 actions
PDDL, read by tarski and converted: 0 metric, SOLVED_SATISFICING, 1 actions
costs of unified-planning: 1 metric, SOLVED_OPTIMALLY, 2 actions
costs, there and back: 0 metric, SOLVED_SATISFICING, 1 actions
invariant: both open for a while is INVALID
invariant, there and back: both open for a while is VALID" ]
