#!/usr/bin/env bash
# unified-planning 1.3.0: made a partial order, a plan loses orders that it needs, and invalid plans come out of it.
#
# Expected: SequentialPlan.convert_to(PARTIAL_ORDER_PLAN) returns a partial order "compatible with the given problem" (says its
#   docstring): in whatever order it is carried out, the plan is valid.
# What happens: an order is kept only where one action's ordinary effect writes what the other reads or writes. The fluents
#   that a simulated effect writes (which calls the user's code) are not looked at, nor the problem's state invariants: a pick
#   may come before the localisation that makes it possible, and a drawer is opened while the fridge is open. The library's
#   own validator refuses these orders.
# Who is hurt: whoever dispatches plans in parallel, as task and motion planning with simulated effects does.
#   TimeTriggeredPlan.convert_to(STN_PLAN) takes its orders from the same method.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check unified-planning==1.3.0
cd "$folder"
cat > show.py <<'PY'
from unified_planning.model import SimulatedEffect
from unified_planning.plans import PlanKind, SequentialPlan
from unified_planning.shortcuts import TRUE, And, BoolType, InstantaneousAction, Not, PlanValidator, Problem, get_environment

get_environment().credits_stream = None


def finding(name, simulated):
    """Localise, then pick what is localised."""
    problem = Problem(name)
    located, held = (problem.add_fluent(fact, BoolType(), default_initial_value=False) for fact in ("located", "held"))
    localise, pick = InstantaneousAction("localise"), InstantaneousAction("pick")
    if simulated:
        localise.set_simulated_effect(SimulatedEffect([located()], lambda *_: [TRUE()]))
    else:
        localise.add_effect(located, True)
    pick.add_precondition(located)
    pick.add_effect(held, True)
    problem.add_actions([localise, pick])
    problem.add_goal(held)
    return problem, SequentialPlan([localise(), pick()])


def opening():
    """Close the fridge, then open the drawer: never are both open."""
    problem = Problem("state invariant")
    facts = ("fridge", "drawer")
    fridge, drawer = (problem.add_fluent(fact, BoolType(), default_initial_value=fact == "fridge") for fact in facts)
    close, open_it = InstantaneousAction("close-fridge"), InstantaneousAction("open-drawer")
    close.add_effect(fridge, False)
    open_it.add_effect(drawer, True)
    problem.add_actions([close, open_it])
    problem.add_state_invariant(Not(And(fridge, drawer)))
    problem.add_goal(And(drawer, Not(fridge)))
    return problem, SequentialPlan([close(), open_it()])


for problem, plan in (finding("effect", simulated=False), finding("simulated effect", simulated=True), opening()):
    orders = plan.convert_to(PlanKind.PARTIAL_ORDER_PLAN, problem).all_sequential_plans()
    with PlanValidator(problem_kind=problem.kind, plan_kind=plan.kind) as validator:
        print(f"{problem.name}: plan {validator.validate(problem, plan).status.name}")
        for order in sorted(orders, key=str):
            print("  an order", *order.actions, validator.validate(problem, order).status.name)
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "effect: plan VALID
  an order localise pick VALID
simulated effect: plan VALID
  an order localise pick VALID
  an order pick localise INVALID
state invariant: plan VALID
  an order close-fridge open-drawer VALID
  an order open-drawer close-fridge INVALID" ]
