"""`lios evaluate solvers`: every solver on the first decisions of task trials, with its plans validated."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.options import MOST, Houses, Json
from workbench.parameters import Option


def solvers(
    houses: Houses = None,
    scenarios: Annotated[
        str, Option("--scenarios", help="Names separated by commas.")
    ] = "deliver-3,breakfast,coffee",
    names: Annotated[
        str,
        Option("--solvers", help="all, or names separated by commas: sas-lmcut, up-symk-opt, 'command:LINE', ..."),
    ] = "all",
    trials: Annotated[int, Option("--trials", "-n", min=1, max=MOST, help="Problems of each scenario.")] = 3,
    budget: Annotated[float, Option("--budget", min=0.1, help="Time for one plan in seconds.")] = 30.0,
    seed: Annotated[int, Option("--seed", min=0, help="Seed of houses, tasks and starts.")] = 0,
    json: Json = False,
) -> None:
    """Compare solvers: status, cost over the optimum, seconds, and whether a validator accepts their plans.

    Each problem is a trial's first decision, priced as by ModelLIOS. Optima are computed by sas-lmcut.

    Examples:

        lios evaluate solvers --scenarios deliver-3 --solvers built-in,sas-ff-astar2,up-enhsp

        lios evaluate solvers --trials 5 --budget 60 --json
    """
    from dataclasses import asdict

    from workbench.errors import BadValue
    from workbench.evaluation.solvers import compare_solvers, first_problem, versions
    from workbench.evaluation.tasks.trials import prepare_trial, supported_houses, trial_keys
    from workbench.planning.solvers.external import engines_here
    from workbench.planning.solvers.registry import SOLVERS, installed_solver
    from workbench.plugins import NameOrigin
    from workbench.terminal import emit_json, emit_table, emit_text, progress
    from workbench.worlds.procthor.load import load_houses
    from workbench.worlds.shipped import shipped_houses

    chosen = [*SOLVERS, *(f"up-{engine}" for engine in engines_here() or ())]
    if names != "all":
        chosen = [name.strip() for name in names.split(",") if name.strip()]
    asked = [name.strip() for name in scenarios.split(",") if name.strip()]
    if not chosen or not asked:
        raise BadValue("--solvers and --scenarios", f"{names!r}, {scenarios!r}", "at least one name each")
    for name in ("sas-lmcut", *chosen):
        installed_solver(name, origin=NameOrigin.USER)
    path = str(houses or shipped_houses())
    indices = tuple(range(len(load_houses(Path(path)))))
    problems = {}
    for scenario in asked:
        fit, _ = supported_houses(scenario, path, indices, seed=seed)
        keys = trial_keys(scenario, path, fit, trials=trials, seed=seed)
        found = [first_problem(prepare_trial(key)) for key in keys]
        problems[scenario] = [problem for problem in found if problem is not None]
        if not problems[scenario]:
            raise BadValue("--scenarios", scenario, "a scenario that these houses support, other than a single find")
    rows = list(
        compare_solvers(problems, chosen, budget_s=budget, progress=lambda pairs: progress(pairs, title="Planning"))
    )
    if json:
        emit_json({"rows": [asdict(row) for row in rows], "versions": versions()})
        return
    emit_table([asdict(row) for row in rows], title="Solvers")
    emit_text(", ".join(f"{package} {number}" for package, number in versions().items()))
