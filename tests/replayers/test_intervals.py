"""Intervals of the run tree: over shipped logs, the bounds are nested in the budget."""

from __future__ import annotations

from itertools import pairwise
from pathlib import Path

import pytest

from replayers.counterfactual.bounds.bounds import Bounds, Budget
from replayers.counterfactual.bounds.branch_and_bound import bounds_of
from replayers.counterfactual.relevance import Assumptions
from replayers.counterfactual.replay import PreparedLog, ReplaySettings, prepare_log, run_tree_of
from replayers.counterfactual.results import Proof
from replayers.runs.run import read
from workbench.planning.strategies import strategy

LOGS = Path(__file__).parents[2] / "logs"
ROUNDING = 1e-9


def prepared(name: str, assumptions: Assumptions) -> PreparedLog:
    return prepare_log(read(LOGS / f"{name}.mcap"), ReplaySettings(worlds=0, assumptions=assumptions))


def bounded(log: PreparedLog, name: str, segments: int) -> Bounds:
    return bounds_of(run_tree_of(log, strategy(name)), budget=Budget(segments=segments, finish=0))


@pytest.mark.parametrize("assumptions", [Assumptions(), Assumptions(inventory=False), Assumptions(misses=1)])
@pytest.mark.parametrize(
    ("log", "name"),
    [
        ("find-greedy", "opt-greedy"),
        ("find-greedy", "opt-lios"),
        ("deliver-3", "opt-greedy"),
        ("deliver-3", "conditioned-lios"),
        ("breakfast", "model-lios"),
    ],
)
def test_bounds_are_nested_in_the_budget(log: str, name: str, assumptions: Assumptions) -> None:
    """A child's own outer bound can be looser than what its parent's leaves of it."""
    on = prepared(log, assumptions)
    made = [bounded(on, name, segments) for segments in (0, 1, 2, 3, 5, 8, 13, 20, 30)]
    for before, after in pairwise(made):
        assert after.lower >= before.lower - ROUNDING
        assert after.upper <= before.upper + ROUNDING
        assert after.least_found <= before.least_found + ROUNDING
        assert after.largest_found >= before.largest_found - ROUNDING


def test_a_search_that_will_not_end_within_its_budget_ends_early() -> None:
    """Three times as many segments left the same upper bound."""
    tree = run_tree_of(prepared("deliver-3", Assumptions()), strategy("scout-lios"))
    bounds = bounds_of(tree, budget=Budget(segments=400))
    assert bounds.upper == pytest.approx(1024.9799, abs=1e-4)
    assert bounds.upper_proof is Proof.STRAIGHT
    assert bounds.segments < 60
