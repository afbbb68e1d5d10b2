"""The results table of task trials: the paper's Table I with intervals, and paired differences.

Intervals are bootstrapped over houses (statistics.py). Differences compare the same trials under two strategies.
"""

from __future__ import annotations

from collections import Counter
from collections.abc import Sequence
from typing import TYPE_CHECKING, Any

import numpy as np

from workbench.evaluation.statistics import (
    IntervalEstimate,
    ends_in_words,
    mean_with_interval,
    paired_difference,
    ratio_with_interval,
)
from workbench.evaluation.tasks.names import scenario_title, strategy_title
from workbench.evaluation.tasks.rows import TaskRow
from workbench.tolerances import NEAR_COST

if TYPE_CHECKING:
    from workbench.evaluation.tasks.experiment import PlannedTrials, TaskRequest

REFERENCE = "model-lios"
"""The reference of paired differences: the paper's own strategy."""
OURS = (
    ("conditioned-lios", "model-lios"),
    ("scout-lios", "conditioned-lios"),
    ("robust-lios", "conditioned-lios"),
)


def answer_of(request: TaskRequest, planned: PlannedTrials, rows: Sequence[TaskRow]) -> dict[str, Any]:
    """The results as plain values for JSON."""
    return {
        "houses": request.houses,
        "split": request.house_description,
        "also": list(request.also),
        "assets": request.assets or None,
        "miss_rate": request.miss_rate,
        "sees_m": request.sees_m,
        "seed": request.seed,
        "rows": table(rows, seed=request.seed),
        "pairs": pairs(rows, seed=request.seed),
        "supported": planned.houses,
        "refused": [{"scenario": s, "house": h, "lacks": why} for s, h, why in planned.refused],
    }


def table(rows: Sequence[TaskRow], *, seed: int = 0) -> list[dict[str, Any]]:
    """One row for each scenario and strategy, in the order in which they first appear."""
    answer: list[dict[str, Any]] = []
    for scenario in dict.fromkeys(row.scenario for row in rows):
        these = [row for row in rows if row.scenario == scenario]
        best = _least_cost(these)
        for strategy in dict.fromkeys(row.strategy for row in these):
            mine = [row for row in these if row.strategy == strategy]
            answer.append(_line(scenario, strategy, mine, these, best, seed))
    return answer


def pairs(rows: Sequence[TaskRow], *, seed: int = 0) -> list[dict[str, Any]]:
    """Paired differences by scenario: every strategy against the reference, and ours against one another."""
    answer: list[dict[str, Any]] = []
    for scenario in dict.fromkeys(row.scenario for row in rows):
        these = [row for row in rows if row.scenario == scenario]
        names = list(dict.fromkeys(row.strategy for row in these))
        wanted = [(name, REFERENCE) for name in names if name != REFERENCE]
        wanted += [pair for pair in OURS if pair not in wanted]
        answer += [
            _pair(scenario, a, b, these, seed)
            for a, b in wanted
            if a in names and b in names and _common(these, a, b)
        ]
    return answer


def _line(
    scenario: str, strategy: str, mine: list[TaskRow], these: list[TaskRow], best: dict[int, float], seed: int
) -> dict[str, Any]:
    rng = np.random.default_rng(seed)
    houses = [row.house for row in mine]
    cost = mean_with_interval([row.cost for row in mine], houses, rng=rng)
    seconds = np.array([b + p for row in mine for b, p in zip(row.belief_s, row.planning_s, strict=True)] or [0.0])
    done = [row for row in mine if row.success and row.predicted_cost is not None]
    predicted = np.array([row.predicted_cost or 0.0 for row in done])
    against = _pair(scenario, strategy, REFERENCE, these, seed) if _common(these, strategy, REFERENCE) else None
    return {
        "scenario": scenario,
        "strategy": strategy,
        "trials": len(mine),
        "houses": len(set(houses)),
        "success_rate": sum(row.success for row in mine) / len(mine),
        "mean_cost": cost.value,
        "ci95": list(cost.interval),
        "ci95_resamples": cost.resampled("houses", "tasks"),
        "replan_p50_s": float(np.median(seconds)),
        "replan_p95_s": float(np.quantile(seconds, 0.95)),
        "replan_max_s": float(seconds.max()),
        "decisions": float(np.mean([row.decisions for row in mine])),
        "searches": float(np.mean([row.searches for row in mine])),
        "travel_m": float(np.mean([row.travel_m for row in mine])),
        "predicted_cost": float(predicted.mean()) if done else None,
        "realised_cost": float(np.mean([row.cost for row in done])) if done else None,
        "prediction_correlation": _correlation(done),
        "wins": sum(row.cost <= best[row.trial] + NEAR_COST for row in mine) / len(mine),
        "share_proven_optimal": float(np.mean([row.optimal for row in mine])),
        "against_model_lios": against["share"] if against else None,
        "against_model_lios_ci95": against["share_ci95"] if against else None,
        "estimator": _estimator(mine),
        "reasons": _reasons(mine),
        "statuses": {s: sum(row.status == s for row in mine) for s in sorted({row.status for row in mine})},
        "planning_share": _planning_share(mine),
    }


def _reasons(mine: list[TaskRow]) -> dict[str, int]:
    """The reasons for failures, the most frequent first."""
    return dict(Counter(row.reason for row in mine if not row.success).most_common())


def _estimator(mine: list[TaskRow]) -> str:
    """The estimator; weights of several folds count as one estimator."""
    names = sorted({row.estimator for row in mine})
    kinds = sorted({name.partition("@")[0] for name in names})
    return names[0] if len(names) == 1 else f"{', '.join(kinds)} ({len(names)} sets of weights)"


def _planning_share(mine: list[TaskRow]) -> float | None:
    """The share of time spent on planning rather than on beliefs."""
    belief, planning = sum(sum(r.belief_s) for r in mine), sum(sum(r.planning_s) for r in mine)
    return planning / (belief + planning) if belief + planning > 0 else None


def _correlation(done: list[TaskRow]) -> float | None:
    if len(done) < 3:
        return None
    predicted = np.array([row.predicted_cost for row in done], dtype=float)
    realised = np.array([row.cost for row in done])
    if predicted.std() == 0 or realised.std() == 0:
        return None
    return float(np.corrcoef(predicted, realised)[0, 1])


def _least_cost(these: list[TaskRow]) -> dict[int, float]:
    """The least cost per trial over strategies that do not know the true house."""
    best: dict[int, float] = {}
    for row in these:
        if row.strategy != "oracle":
            best[row.trial] = min(row.cost, best.get(row.trial, float("inf")))
    for row in these:
        best.setdefault(row.trial, row.cost)
    return best


def _common(these: list[TaskRow], a: str, b: str) -> bool:
    return bool({r.trial for r in these if r.strategy == a} & {r.trial for r in these if r.strategy == b})


def _pair(scenario: str, a: str, b: str, these: list[TaskRow], seed: int) -> dict[str, Any]:
    first = {row.trial: row for row in these if row.strategy == a}
    second = {row.trial: row for row in these if row.strategy == b}
    trials = sorted(first.keys() & second.keys())
    costs_a = np.array([first[t].cost for t in trials])
    costs_b = np.array([second[t].cost for t in trials])
    houses = [first[t].house for t in trials]
    difference = paired_difference(costs_a, costs_b, houses, rng=np.random.default_rng(seed))
    share: IntervalEstimate = ratio_with_interval(costs_a - costs_b, costs_b, houses, rng=np.random.default_rng(seed))
    return {
        "scenario": scenario,
        "a": a,
        "b": b,
        "trials": len(trials),
        "difference": difference.value,
        "ci95": list(difference.interval),
        "ci95_resamples": difference.resampled("houses", "tasks"),
        "share": share.value,
        "share_ci95": list(share.interval),
        "a_wins": float((costs_a < costs_b - NEAR_COST).mean()),
        "b_wins": float((costs_b < costs_a - NEAR_COST).mean()),
    }


def markdown(lines: Sequence[dict[str, Any]]) -> str:
    """The table in the paper's layout: one row per strategy, and cost and success per scenario."""
    scenarios = list(dict.fromkeys(line["scenario"] for line in lines))
    strategies = list(dict.fromkeys(line["strategy"] for line in lines))
    cells = {(line["scenario"], line["strategy"]): line for line in lines}
    head = "| Strategy | " + " | ".join(f"{_cell(scenario_title(s))} cost | Succ." for s in scenarios) + " |"
    out = [head, "|---|" + "---:|---:|" * len(scenarios)]
    for strategy in strategies:
        words = [_cell(strategy_title(strategy))]
        for scenario in scenarios:
            line = cells.get((scenario, strategy))
            if line is None:
                words += ["-", "-"]
                continue
            words += [
                f"{line['mean_cost']:.1f} [{ends_in_words(line['ci95']).replace(' to ', ', ')}]",
                f"{100 * line['success_rate']:.0f} %",
            ]
        out.append("| " + " | ".join(words) + " |")
    return "\n".join(out) + "\n"


def _cell(name: str) -> str:
    """A name escaped for a Markdown table: a planner's command line may contain a cell separator."""
    return name.replace("|", "\\|")
