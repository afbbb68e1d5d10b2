"""The table of `lios evaluate search --sees`: what seeing in passing saves, over the range of sight."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Any

from recorders.commands.evaluate.paired_table import PairedTable, answer_with, require_free, skipped_rows

if TYPE_CHECKING:
    from workbench.evaluation.search.report import SearchRequest

DEFAULT = "conditioned-lios"
"""Whose searches are measured where all policies are named."""
SHOWN = ("policy", "sees", "queries", "without", "seeing", "saved", "95 %", "oracle saves", "looks", "seeing looks")


def show_sight(request: SearchRequest, sees: str, output: Path | None, *, force: bool, json: bool) -> None:
    """Run the searches with each sight radius, and print the curve.

    Raises:
        InputError: a radius, file, policy or estimator cannot be used, or the output exists.
        Failed: there was nothing to search for.
    """
    from workbench.errors import BadValue, Failed
    from workbench.evaluation.search.experiment import policies_named
    from workbench.evaluation.search.missed_looks import START_OVER
    from workbench.evaluation.search.sight_curve import (
        SightSearches,
        radii_named,
        searches_with_sight,
        sight_pairs,
        sight_rows,
    )
    from workbench.evaluation.search.trials import ORACLE
    from workbench.search.costs import ActionCosts
    from workbench.terminal import progress, say

    radii = radii_named(sees)
    file = None if output is None else output / "sight.json"
    require_free(file, force=force)
    request.experiment()
    if any(name.endswith(START_OVER) for name in request.policies):
        raise BadValue("--policies", ", ".join(request.policies), f"without {START_OVER} where --sees is given")
    everything = "all" in [name.lower() for name in request.policies]
    named = policies_named((DEFAULT,) if everything else request.policies)
    settings = SightSearches(
        policies=tuple(name for name in named if name != ORACLE),
        radii_m=radii,
        estimator=request.estimator,
        paper_estimator=request.paper_estimator,
        asked=request.asked(),
        costs=ActionCosts(search=request.search_cost),
        miss_rate=request.miss_rate,
        seed=request.seed,
    )
    made = list(progress(searches_with_sight(request.chosen_houses(), settings), title="Searching"))
    costs = [cost for result in made for cost in result.costs]
    skipped = [(result.house, result.skipped) for result in made if result.skipped]
    if not costs:
        raise Failed(f"no search was run: {skipped[0][1] if skipped else 'no house there has anything to find'}")
    answer: dict[str, Any] = {
        "rows": sight_rows(costs, seed=request.seed),
        "pairs": sight_pairs(costs, seed=request.seed),
        "file": str(request.file),
        "split": request.split,
        "estimator": request.estimator,
        "miss_rate": request.miss_rate,
        "seed": request.seed,
        "skipped": skipped_rows(skipped),
    }
    answer_with(answer, PairedTable("open furniture seen in passing", SHOWN, _shown), file, json=json)
    if not json:
        for pair in answer["pairs"]:
            say(_pair_in_words(pair))


def _pair_in_words(pair: dict[str, Any]) -> str:
    from workbench.evaluation.statistics import ends_in_words
    from workbench.terminal import signed_percentage

    ends = ends_in_words(pair["ci95"], "+.1f", scale=100)
    saves = signed_percentage(pair["b_saves_of_a"])
    return f"at {pair['sees_m']:g} m, {pair['b']} saves {saves} of what {pair['a']} costs (95 %: {ends})"


def _shown(row: dict[str, Any]) -> dict[str, object]:
    from workbench.evaluation.statistics import ends_in_words
    from workbench.terminal import signed_percentage

    return {
        "policy": row["policy"],
        "sees": f"{row['sees_m']:g} m",
        "queries": row["queries"],
        "without": row["cost_without"],
        "seeing": row["cost_seeing"],
        "saved": signed_percentage(row["saved"]),
        "95 %": ends_in_words(row["saved_ci95"], "+.1f", scale=100),
        "oracle saves": signed_percentage(row["oracle_saves"]),
        "looks": row["searches_without"],
        "seeing looks": row["searches_seeing"],
    }
