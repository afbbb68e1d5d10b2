"""Benchmark: expected costs of eight candidates against an order over all containers, and of that against the
optimum.

    .venv/bin/pytest tests/benchmarks/test_full_tour_quality.py -s

prints the figures, on validation houses with the shipped counts: expected costs under the belief, not realised ones.
"""

from __future__ import annotations

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest

from workbench.beliefs.estimators import estimator
from workbench.evaluation.search.trials import queries
from workbench.evaluation.splits import Split, split_indices
from workbench.search.corrected import corrected_find_costs
from workbench.search.costs import SIMULATION_COSTS
from workbench.search.engine import expected_search
from workbench.search.policies.full_tour import FullTour
from workbench.search.policy import SearchQuery
from workbench.worlds.house import START
from workbench.worlds.knowledge import knowledge_at_start
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.procthor.load import load_houses

EXACT_UP_TO = 15


def validation_queries(procthor: Path, *, every: int) -> Iterator[SearchQuery]:
    path = procthor / "multi_room_train.jsonl.gz"
    houses = load_houses(path)
    believer = estimator("counts")
    for index in split_indices(path, Split.VALIDATION, houses=len(houses)):
        house = houses[index]
        travel = navigate(house.plan).travel
        asked = queries(house, travel)
        belief = believer.believe(knowledge_at_start(house.plan, travel, {}), asked)
        for item in asked[::every]:
            yield SearchQuery(
                item_type=item, origin=START, target=START, belief=belief, travel=travel, costs=SIMULATION_COSTS
            )


@pytest.mark.slow
def test_eight_candidates_and_the_rest_as_it_comes_cost_little_more(
    procthor: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    eight, left_out, full, exact, close = [], [], [], [], []
    for query in validation_queries(procthor, every=4):
        search = expected_search(query, belief_model="marginal", limit=8)
        only = query.belief.item_types.index(query.item_type)
        whole = corrected_find_costs(
            query.belief, query.travel, origins=(START,), targets=(START,), costs=SIMULATION_COSTS, scale=1.0
        )
        eight.append(whole.metres[only, 0, 0])
        left_out.append(search.missing)
        full.append(FullTour().search(query).cost)
        if 10 < len(query.belief.containers) <= EXACT_UP_TO:
            best = expected_search(query, belief_model="marginal", limit=EXACT_UP_TO, ranking="worth")
            exact.append(best.cost)
            close.append(full[-1])
    more, gap = sum(eight) / sum(full) - 1, sum(close) / sum(exact) - 1
    with capsys.disabled():
        print(
            f"\n{len(full)} queries: eight candidates, then the others as they come, cost {100 * more:.2f} % more "
            f"than the order over all; the object is in none of the eight with chance {np.mean(left_out):.3f}"
            f"\n{len(exact)} of 11 to {EXACT_UP_TO} containers: that order costs {100 * gap:.3f} % more than the best"
        )
    assert 0 <= more < 0.05
    assert -1e-9 <= gap < 0.005
