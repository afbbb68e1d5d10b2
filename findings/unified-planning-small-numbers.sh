#!/usr/bin/env bash
# unified-planning 1.3.0 with up-enhsp 0.1.1: with a number below 1/10000 a solvable task is "proven" to have no plan.
#
# Expected: PDDLWriter writes PDDL, whose numbers are decimals (PDDL 2.1's grammar, Fox and Long 2003, has no exponents), and
#   an engine that cannot read what it was given says so (INTERNAL_ERROR).
# What happens: real constants pass through Python's str of a float, so that 0.00005 is written as 5e-05. ENHSP stops with a
#   syntax error. In an initial value that comes back as UNSOLVABLE_PROVEN, in an effect or a cost as INTERNAL_ERROR. 0.0001 is
#   written as it is, and solved. tarski 0.9.1 and pddl 0.5.1 cannot read such a file either; unified-planning's own reader
#   can, and its validator accepts the plan.
# Who is hurt: whoever has rates, probabilities or costs in small units: a battery's share a metre, wear, ppm. A sweep
#   over a parameter reports that there is no plan from a certain value on.
# Seen 2026-11-30. Exits 1 if the output changes.
set -euo pipefail
folder=$(mktemp -d)
trap 'rm -rf "$folder"' EXIT
python3 -m venv "$folder/venv"
"$folder/venv/bin/pip" install --quiet --disable-pip-version-check unified-planning==1.3.0 up-enhsp==0.1.1
cd "$folder"
cat > show.py <<'PY'
from fractions import Fraction

from unified_planning.io import PDDLWriter
from unified_planning.plans import SequentialPlan
from unified_planning.shortcuts import GE, BoolType, InstantaneousAction, OneshotPlanner, PlanValidator, Problem, RealType
from unified_planning.shortcuts import get_environment

get_environment().credits_stream = None


def task(first, share):
    """Charge until the battery has enough, then drive."""
    problem = Problem("driving")
    level = problem.add_fluent("level", RealType(), default_initial_value=first)
    there = problem.add_fluent("there", BoolType(), default_initial_value=False)
    charge, drive = InstantaneousAction("charge"), InstantaneousAction("drive")
    charge.add_increase_effect(level, share)
    drive.add_precondition(GE(level, share))
    drive.add_effect(there, True)
    problem.add_actions([charge, drive])
    problem.add_goal(there)
    return problem, SequentialPlan([charge(), drive()])


for name, first, share in (
    ("0.0001 at first", Fraction(1, 10_000), 1),
    ("0.00005 at first", Fraction(1, 20_000), 1),
    ("0.0001 a charge", 0, Fraction(1, 10_000)),
    ("0.00005 a charge", 0, Fraction(1, 20_000)),
):
    problem, plan = task(first, share)
    writer = PDDLWriter(problem)
    words = (writer.get_domain() + writer.get_problem()).replace(")", " ").split()
    written = {word for word in words if word[0].isdigit()} - {"0", "1"}
    with OneshotPlanner(name="enhsp") as planner:
        answer = planner.solve(problem)
    with PlanValidator(name="sequential_plan_validator") as validator:
        valid = validator.validate(problem, plan).status.name
    print(f"{name}: written {sorted(written)}, ENHSP {answer.status.name}; charge, drive: {valid}")
PY
seen=$("$folder/venv/bin/python" -W ignore show.py)
echo "$seen"
[ "$seen" = "0.0001 at first: written ['0.0001'], ENHSP SOLVED_SATISFICING; charge, drive: VALID
0.00005 at first: written ['5e-05'], ENHSP UNSOLVABLE_PROVEN; charge, drive: VALID
0.0001 a charge: written ['0.0001'], ENHSP SOLVED_SATISFICING; charge, drive: VALID
0.00005 a charge: written ['5e-05'], ENHSP INTERNAL_ERROR; charge, drive: VALID" ]
