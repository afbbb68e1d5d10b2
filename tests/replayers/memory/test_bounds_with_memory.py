"""Bounds of replays over runs that remember: the truth is inside, whatever has moved since."""

from __future__ import annotations

from itertools import product
from pathlib import Path

import pytest

from recorders.record_run import record
from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.runs.run import read
from workbench.tolerances import NEAR_COST
from workbench.worlds.procthor.load import load_house

STRATEGIES = ("opt-greedy", "pes-lios", "model-lios", "conditioned-lios")


@pytest.mark.slow
@pytest.mark.parametrize("number", [0, 2, 6])
def test_the_truth_is_inside_the_bounds_of_runs_that_remember(number: int, tmp_path: Path) -> None:
    house = load_house(f"houses:{number}")
    types = [t for t in house.item_types() if not t.startswith("Obja")]
    earlier = tmp_path / "earlier"
    earlier.mkdir()
    for day in range(3):
        sought = types[(3 * day + number) % len(types)]
        record(earlier / f"{day}.mcap", house=house, find=sought, estimator="counts", day=day)
    settings = ReplaySettings(worlds=20, with_truth=True, budget=Budget(segments=120))
    cases = list(product(("counts", "best", "people", "mixed"), (0.25, 1.0), ("opt-greedy", "conditioned-lios")))
    for seed, (believer, moved, driver) in enumerate(cases):
        log = tmp_path / f"{seed}.mcap"
        sought = types[(seed + 5) % len(types)]
        asked = {"find": sought, "strategy": driver, "estimator": believer, "seed": seed}
        record(log, house=house, memory=[earlier], moved=moved, **asked)  # type: ignore[arg-type]
        prepared = prepare_log(read(log, with_truth=True), settings)
        assert prepared.reproduction.same
        for name in STRATEGIES:
            made = replay_on(prepared, name)
            assert made.bounds is not None
            assert made.true_cost is not None
            low, high = made.bounds.lower - NEAR_COST, made.bounds.upper + NEAR_COST
            assert low <= made.true_cost <= high, (number, believer, moved, driver, name)
