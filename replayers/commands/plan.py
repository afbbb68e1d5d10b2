"""`lios plan`: the plan, the PDDL and the SAS+ of any moment of a log."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import click

from workbench.options import Json
from workbench.parameters import Argument, Option


def plan(
    log: Annotated[Path, Argument(help="A log of a run.")],
    at: Annotated[float | None, Option("--at", help="Seconds after the start; default: the start.")] = None,
    decision: Annotated[int | None, Option("--decision", help="A decision by its number, from 1.")] = None,
    strategy: Annotated[str, Option("--strategy", "-s", help="Strategy; default: that of the run.")] = "",
    solver: Annotated[
        str, Option("--solver", help="built-in, sas-lmcut, pddl-ff-astar2, up-ENGINE, 'command:LINE', ...")
    ] = "",
    pddl: Annotated[bool, Option("--pddl", help="Print domain and problem in PDDL.")] = False,
    sas: Annotated[bool, Option("--sas", help="Print the SAS+ task.")] = False,
    everywhere: Annotated[
        bool, Option("--everywhere", help="Plan over all places, not only those that can matter.")
    ] = False,
    budget: Annotated[float, Option("--budget", min=0.0, help="Time limit of the solver in seconds.")] = 120.0,
    output: Annotated[
        Path | None,
        Option("--output", "-o", help="Folder for PDDL, SAS+ and plan.json."),
    ] = None,
    force: Annotated[bool, Option("--force", help="Replace files in the output folder.")] = False,
    json: Json = False,
) -> None:
    """Plan again at a moment of a log, and show the plan, the PDDL and the SAS+.

    Examples:

        lios plan run.mcap --at 30

        lios plan run.mcap --decision 4 --strategy pes-greedy --solver pddl-ff-astar2

        lios plan run.mcap --pddl > task.pddl

        lios plan run.mcap -o problem/
    """
    from replayers.batch.replan import replan
    from replayers.runs.run import read
    from workbench.planning.plans import PlanStatus
    from workbench.plugins import NameOrigin
    from workbench.terminal import emit_json, emit_text, patience

    with patience():
        made = replan(
            read(log),
            at=at,
            decision=decision,
            strategy=strategy,
            solver=solver,
            origin=NameOrigin.USER,
            everywhere=everywhere,
            budget_s=budget,
        )
    if output is not None:
        _write(made, output, force=force)
    if json:
        printed = {"domain": made.pddl.domain, "problem": made.pddl.problem} if pddl else {}
        emit_json(made.answer() | printed | ({"sas": made.sas.text} if sas else {}))
    elif pddl or sas:
        emit_text((made.pddl.domain + made.pddl.problem if pddl else "") + (made.sas.text if sas else ""))
    else:
        _show(made)
    if made.plan.status in (PlanStatus.TIMED_OUT, PlanStatus.SOLVER_FAILED) and not (pddl or sas):
        raise click.exceptions.Exit(1)


def _write(made: Any, folder: Path, *, force: bool) -> None:
    import msgspec

    from workbench.errors import OutputExists
    from workbench.files import make_folder, write_text
    from workbench.terminal import say

    answer = msgspec.json.format(msgspec.json.encode(made.answer()), indent=2).decode() + "\n"
    files = {
        "domain.pddl": made.pddl.domain,
        "problem.pddl": made.pddl.problem,
        "task.sas": made.sas.text,
        "plan.json": answer,
    }
    make_folder(folder)
    for name in files:
        if (folder / name).exists() and not force:
            raise OutputExists(folder / name)
    for name, text in files.items():
        write_text(folder / name, text)
    say(f"Written to {folder}: {', '.join(files)}.")


def _show(made: Any) -> None:
    from workbench.planning.plans import PlanStatus
    from workbench.terminal import emit_table, emit_text, say

    answer = made.answer()
    say(
        f"Decision {answer['decision']} of {answer['log']}: {answer['strategy']} with {answer['solver']} over "
        f"{answer['places']} of {answer['reachable']} places"
    )
    rows = [{"step": i + 1, "does": s["does"], "cost": s["cost"]} for i, s in enumerate(answer["steps"])]
    if rows:
        emit_table(rows)
    if made.plan.status is not PlanStatus.SOLVED:
        emit_text(f"{answer['status']}: {answer['note']}".rstrip(": "))
        return
    bound = answer["lower_bound"]
    quality = (
        "optimal over these places" if answer["optimal"] else f"at least {bound:.1f}" if bound else "only a plan"
    )
    emit_text(f"{answer['status']}: cost {answer['cost']:.2f}, {quality}. {answer['note']}".rstrip())
