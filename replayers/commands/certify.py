"""`lios certify`: writes the certificate of what a strategy costs over a log, for readers to check on their own."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from workbench.options import Ask, Force, Json, LogEstimator
from workbench.parameters import Argument, Option


def certify(
    log: Annotated[Path, Argument(help="A log.")],
    output: Annotated[Path, Option("--output", "-o", help="The certificate, such as claim.lios.zip.")],
    strategy: Annotated[
        str, Option("--strategy", "-s", help="Strategy whose cost is certified; default: the one that was driven.")
    ] = "",
    branches: Annotated[
        int, Option("--branches", min=1, help="Number of branches to write out; the others get outer bounds.")
    ] = 5000,
    estimator: LogEstimator = "log",
    ask: Ask = False,
    force: Force = False,
    json: Json = False,
) -> None:
    """Certify what a strategy costs over a log, for others to check without this program.

    The certificate holds the log's hash, every branch of the strategy's run with its actions and their costs, and the
    worlds at both ends. tools/check_claim.py checks it against the log; it imports nothing of this project.

    Examples:

        lios certify run.mcap -s pes-lios -o claim.lios.zip && python tools/check_claim.py claim.lios.zip run.mcap
    """
    from replayers.batch.recorded_strategy import loadable_name
    from replayers.certificates.build import certificate
    from replayers.certificates.claim import open_branches, sealed, write_claim
    from replayers.counterfactual.logged_belief import may_ask_estimator
    from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
    from replayers.counterfactual.sandbox import is_foreign, loaded_once
    from replayers.runs.run import read
    from workbench.errors import OutputExists
    from workbench.planning.strategies import StrategyNotLoaded
    from workbench.plugins import NameOrigin
    from workbench.terminal import emit_json, say

    if output.exists() and not force:
        raise OutputExists(output)
    run = read(log)
    name, origin = (strategy, NameOrigin.USER) if strategy else (loadable_name(run), NameOrigin.LOG)
    may_ask = may_ask_estimator(estimator, ask=ask)
    settings = ReplaySettings(worlds=0, estimator=estimator, estimator_origin=NameOrigin.USER, ask=may_ask)
    prepared = prepare_log(run, settings, with_paths=False)
    fault = loaded_once(name)[1] if is_foreign(name, origin=origin) else None
    if fault is not None:
        raise StrategyNotLoaded(name, fault.reason)
    with prepared.planner(name, origin=origin) as planner:
        claim = certificate(prepared, planner, max_branches=branches)
    values = sealed(claim)
    write_claim(output, values, force=force)
    lower, upper = claim.lower, claim.upper
    if json:
        ends = {"lower": lower.cost, "lower_kind": lower.kind, "upper": upper.cost, "upper_kind": upper.kind}
        who = {"strategy": claim.strategy, "version": claim.strategy_version, "estimator": claim.estimator}
        names = {**who, "log": claim.log, "seal": values["seal"]}
        emit_json({"file": str(output), **names, **ends})
        return
    most = "no upper bound" if upper.cost is None else f"{upper.cost:.2f} ({upper.kind})"
    say(f"{claim.strategy}, belief of {claim.estimator}, over {claim.log}: {lower.cost:.2f} ({lower.kind}) to {most}")
    if "outer" in (lower.kind, upper.kind):
        say(f"note: {', '.join(open_branches(claim.tree))}; lios replay may have tighter bounds")
    say(f"Wrote {output}; check it: python tools/check_claim.py {output} {log}")
