"""The tables of `lios evaluate search --memory` and `lios evaluate tasks --memory`: what remembering saves."""

from __future__ import annotations

from collections.abc import Iterable, Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

from recorders.commands.evaluate.paired_table import PairedTable, answer_with, require_free, skipped_rows

if TYPE_CHECKING:
    from workbench.evaluation.memory.conditions import MemoryCost
    from workbench.evaluation.memory.searches import MemoryHouse
    from workbench.evaluation.memory.tasks import MemoryTrial
    from workbench.evaluation.search.report import SearchRequest
    from workbench.evaluation.tasks.experiment import TaskRequest

DEFAULT = "conditioned-lios"
"""Whose memory is measured where all policies or strategies are named."""
SHOWN = (
    "strategy",
    "condition",
    "trials",
    "without",
    "remembered",
    "saved",
    "95 %",
    "up to date saves",
    "oracle saves",
    "gap closed",
)


def show_searches(
    request: SearchRequest, rates: Path | None, output: Path | None, *, force: bool, json: bool
) -> None:
    """Run the memory experiment on searches, and print its table.

    Raises:
        InputError: a file, policy, estimator or table of rates cannot be used, or the output exists.
    """
    from recorders.earlier_runs import move_rates
    from workbench.beliefs.estimators import estimator
    from workbench.evaluation.memory.searches import MemorySearches, remembered_searches
    from workbench.evaluation.search.experiment import policies_named
    from workbench.evaluation.search.trials import ASKS_NO_BELIEF
    from workbench.plugins import NameOrigin
    from workbench.search.costs import ActionCosts

    require_free(_file(output), force=force)
    named = (DEFAULT,) if "all" in [name.lower() for name in request.policies] else request.policies
    estimator(request.estimator, origin=NameOrigin.USER)
    settings = MemorySearches(
        policies=tuple(name for name in policies_named(named) if name not in ASKS_NO_BELIEF),
        rates=move_rates(rates),
        estimator=request.estimator,
        asked=request.asked(),
        costs=ActionCosts(search=request.search_cost),
        seed=request.seed,
    )
    about = {"file": str(request.file), "split": request.split, "estimator": request.estimator}
    found = remembered_searches(request.chosen_houses(), settings)
    _show(found, about, "Searching", request.seed, output, json=json)


def show_tasks(request: TaskRequest, rates: Path | None, output: Path | None, *, force: bool, json: bool) -> None:
    """Run the memory experiment on tasks, and print its table.

    Raises:
        InputError: as show_searches.
        NoSupportingHouse: no house supports a scenario.
    """
    from recorders.earlier_runs import move_rates
    from workbench.evaluation.memory.tasks import MemoryTasks, remembered_tasks
    from workbench.evaluation.tasks.experiment import NoSupportingHouse, plan_trials

    require_free(_file(output), force=force)
    planned = plan_trials(request)
    if not planned.keys:
        raise NoSupportingHouse(request)
    named = tuple(name for name in request.strategies if name.partition("@")[0] != "oracle")
    settings = MemoryTasks(
        strategies=(DEFAULT,) if len(named) > 1 and DEFAULT in named and _all_named(named) else named,
        rates=move_rates(rates),
        estimator=request.estimator,
        assets=Path(request.assets) if request.assets else None,
    )
    about = {"file": request.houses, "split": request.house_description, "estimator": request.estimator}
    about |= {"scenarios": ", ".join(request.scenarios)}
    _show(remembered_tasks(planned.keys, settings), about, "Running", request.seed, output, json=json)


def _all_named(names: Sequence[str]) -> bool:
    from workbench.planning.strategies import STRATEGIES

    return set(names) >= {name for name in STRATEGIES if name != "oracle"}


def _file(output: Path | None) -> Path | None:
    return None if output is None else output / "memory.json"


def _show(
    results: Iterable[MemoryHouse | MemoryTrial],
    about: dict[str, Any],
    doing: str,
    seed: int,
    output: Path | None,
    *,
    json: bool,
) -> None:
    from workbench.errors import Failed
    from workbench.evaluation.memory.conditions import memory_rows
    from workbench.terminal import progress

    made = list(progress(results, title=doing))
    costs: list[MemoryCost] = [cost for result in made for cost in result.costs]
    skipped = list(dict.fromkeys((result.house, result.skipped) for result in made if result.skipped))
    if not costs:
        raise Failed(f"no trial was run: {skipped[0][1] if skipped else 'no house there has anything to find'}")
    answer = {
        "rows": memory_rows(costs, seed=seed),
        **about,
        "seed": seed,
        "skipped": skipped_rows(skipped),
    }
    answer_with(answer, PairedTable("memory of five earlier runs", SHOWN, _shown), _file(output), json=json)


def _shown(row: dict[str, Any]) -> dict[str, object]:
    from workbench.evaluation.statistics import ends_in_words
    from workbench.terminal import signed_percentage

    return {
        "strategy": row["strategy"],
        "condition": row["condition"],
        "trials": row["trials"],
        "without": row["cost_without"],
        "remembered": row["cost_remembered"],
        "saved": signed_percentage(row["saved"]),
        "95 %": ends_in_words(row["saved_ci95"], "+.1f", scale=100),
        "up to date saves": signed_percentage(row["up_to_date_saves"]),
        "oracle saves": signed_percentage(row["oracle_saves"]),
        "gap closed": signed_percentage(row["gap_closed"]),
    }
