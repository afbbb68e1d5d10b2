"""Benchmark: time from a house to its travel costs. The study needed 0.05 s for a mean house."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import pytest
from timings import HOLD_FIGURES

from workbench.worlds.maps.navigation import compute
from workbench.worlds.procthor.load import load_houses


@pytest.mark.slow
def test_house_to_travel_costs(procthor: Path, benchmark: Any) -> None:
    """Ten houses of all sizes in one go, without the cache."""
    houses = load_houses(procthor / "multi_room_train.jsonl.gz")[:100:10]
    compute(houses[0].plan, resolution_m=0.1, robot_radius_m=0.2)  # compiled code is loaded once

    def all_ten() -> None:
        for house in houses:
            compute(house.plan, resolution_m=0.1, robot_radius_m=0.2)

    benchmark.pedantic(all_ten, rounds=3, iterations=1)
    if HOLD_FIGURES and benchmark.stats is not None:  # None when benchmarks are switched off
        assert benchmark.stats.stats.min / len(houses) < 0.5
