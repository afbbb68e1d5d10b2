"""The results table of the object-search experiment: rows by policy, intervals over houses, paired differences.

Two measures of improvement are in use and differ considerably: 1 - LIOS/Greedy is the saved share of Greedy's cost,
Greedy/LIOS - 1 is the excess cost of Greedy. Both are given. The share of the gap between Greedy and the oracle
that a policy closes, (Greedy - policy)/(Greedy - oracle), is comparable between sets of houses.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from workbench.arrays import Floats
from workbench.errors import BadValue
from workbench.evaluation.search.trials import ORACLE, SearchTrial
from workbench.evaluation.statistics import (
    IntervalEstimate,
    mean_with_interval,
    paired_difference,
    ratio_with_interval,
)
from workbench.tolerances import ROUNDING

GREEDY = "greedy"
KINDS = ("ai2-thor", "objaverse")


@dataclass(frozen=True, slots=True, kw_only=True)
class Costs:
    """Costs of the same queries under several policies.

    Attributes:
        policies: axis 0 of cost.
        houses, kinds: of each query.
        cost, searches, decide_s, predicted, corrected, found: shape (policies, queries); NaN where missing.

    Raises:
        BadValue: a policy lacks a trial for some query.
    """

    policies: tuple[str, ...]
    houses: tuple[str, ...]
    kinds: tuple[str, ...]
    cost: Floats
    searches: Floats
    decide_s: Floats
    predicted: Floats
    corrected: Floats
    found: Floats

    def of(self, policy: str) -> Floats:
        return self.cost[self.policies.index(policy)]

    def only(self, kind: str) -> Costs:
        """The costs of the queries of one kind of item."""
        these = np.array([k == kind for k in self.kinds], dtype=bool)
        return Costs(
            policies=self.policies,
            houses=tuple(h for h, this in zip(self.houses, these, strict=True) if this),
            kinds=(kind,) * int(these.sum()),
            cost=self.cost[:, these],
            searches=self.searches[:, these],
            decide_s=self.decide_s[:, these],
            predicted=self.predicted[:, these],
            corrected=self.corrected[:, these],
            found=self.found[:, these],
        )


def costs_of(trials: Sequence[SearchTrial]) -> Costs:
    """Trials by policy and query, policies in the order of their first trial."""
    policies = tuple(dict.fromkeys(t.policy for t in trials))
    asked = tuple(dict.fromkeys((t.house, t.item_type, t.kind) for t in trials))
    by_query = {(t.policy, t.house, t.item_type): t for t in trials}
    if len(by_query) != len(policies) * len(asked) or len(trials) != len(by_query):
        raise BadValue("search trials", len(trials), "one for every policy and query")
    rows = [[by_query[p, house, item] for house, item, _ in asked] for p in policies]

    def table(value: str) -> Floats:
        values = [[getattr(t, value) for t in row] for row in rows]
        return np.array(values, dtype=np.float64).reshape(len(policies), len(asked))

    return Costs(
        policies=policies,
        houses=tuple(house for house, _, _ in asked),
        kinds=tuple(kind for _, _, kind in asked),
        cost=table("cost"),
        searches=np.array([[len(t.order) for t in row] for row in rows], dtype=np.float64),
        decide_s=table("decide_s"),
        predicted=table("predicted"),
        corrected=table("corrected"),
        found=table("found"),
    )


def rows(costs: Costs, *, seed: int) -> list[dict[str, Any]]:
    """One row per policy.

    Args:
        seed: seed of the bootstrap; every row draws the same houses.
    """
    return [_row(costs, name, seed) for name in costs.policies]


def rows_by_kind(costs: Costs, *, seed: int) -> list[dict[str, Any]]:
    """The rows for each kind of item among the queries."""
    present = [kind for kind in KINDS if kind in costs.kinds]
    return [{"kind": kind, **row} for kind in present for row in rows(costs.only(kind), seed=seed)]


def pairs(costs: Costs, *, seed: int) -> list[dict[str, Any]]:
    """Paired differences between any two policies: cost of b minus cost of a, absolute, as a share of a's
    cost and of Greedy's."""
    return [_pair(costs, a, b, seed) for i, a in enumerate(costs.policies) for b in costs.policies[i + 1 :]]


def _row(costs: Costs, name: str, seed: int) -> dict[str, Any]:
    own, greedy, oracle = costs.of(name), costs.of(GREEDY), costs.of(ORACLE)
    place = costs.policies.index(name)
    mean = mean_with_interval(own, costs.houses, rng=np.random.default_rng(seed))
    saved = ratio_with_interval(greedy - own, greedy, costs.houses, rng=np.random.default_rng(seed))
    gap = ratio_with_interval(greedy - own, greedy - oracle, costs.houses, rng=np.random.default_rng(seed))
    searches = costs.searches[place]
    return {
        "policy": name,
        "queries": len(own),
        "found": float(costs.found[place].mean()),
        "houses": mean.clusters,
        "mean_cost": mean.value,
        "ci95": _ends(mean),
        "ci95_resamples": mean.resampled("houses", "queries"),
        "saved_of_greedy": saved.value,
        "saved_of_greedy_ci95": _ends(saved),
        "greedy_costs_more": float(greedy.sum() / own.sum() - 1),
        "oracle_gap_closed": _number(gap.value),
        "oracle_gap_closed_ci95": _ends(gap),
        "worse_than_greedy": float(np.mean(own > greedy + ROUNDING)),
        "searches": float(searches.mean()),
        "ms_a_decision": float(1000 * costs.decide_s[place].sum() / searches.sum()),
        "predicted": _mean(costs.predicted[place]),
        "realised_over_predicted": _over(own, costs.predicted[place]),
        "corrected": _mean(costs.corrected[place]),
        "realised_over_corrected": _over(own, costs.corrected[place]),
    }


def _pair(costs: Costs, a: str, b: str, seed: int) -> dict[str, Any]:
    first, second, greedy = costs.of(a), costs.of(b), costs.of(GREEDY)
    difference = paired_difference(second, first, costs.houses, rng=np.random.default_rng(seed))
    share = ratio_with_interval(second - first, greedy, costs.houses, rng=np.random.default_rng(seed))
    of_a = ratio_with_interval(second - first, first, costs.houses, rng=np.random.default_rng(seed))
    return {
        "a": a,
        "b": b,
        "b_minus_a": difference.value,
        "ci95": _ends(difference),
        "ci95_resamples": difference.resampled("houses", "queries"),
        "share_of_a": of_a.value,
        "share_of_a_ci95": _ends(of_a),
        "share_of_greedy": share.value,
        "share_of_greedy_ci95": _ends(share),
        "b_costs_more": float(np.mean(second > first + ROUNDING)),
        "b_costs_less": float(np.mean(second < first - ROUNDING)),
    }


def _ends(estimate: IntervalEstimate) -> list[float | None]:
    return [_number(estimate.lower), _number(estimate.upper)]


def _number(value: float) -> float | None:
    return float(value) if np.isfinite(value) else None


def _mean(values: Floats) -> float | None:
    return float(values.mean()) if np.isfinite(values).all() else None


def _over(realised: Floats, predicted: Floats) -> float | None:
    return float(realised.sum() / predicted.sum()) if np.isfinite(predicted).all() else None
