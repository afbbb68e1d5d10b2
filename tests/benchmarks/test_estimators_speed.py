"""Benchmark: time of the belief about a whole house, once its names are encoded. The aim is under 5 ms.

    .venv/bin/pytest tests/benchmarks/test_estimators_speed.py --benchmark-enable

One round asks about every item type of a shipped house of middle size in all its containers, before the first look.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

from workbench.beliefs.estimators import ESTIMATORS, estimator
from workbench.evaluation.beliefs.metrics import missing_types, partial_knowledge
from workbench.worlds.procthor.load import load_houses
from workbench.worlds.shipped import shipped_houses


@pytest.mark.parametrize("name", sorted(ESTIMATORS))
def test_the_belief_about_a_whole_house(name: str, benchmark: Any) -> None:
    houses = sorted(load_houses(shipped_houses()), key=lambda h: len(h.plan.containers) * len(h.item_types()))
    house = houses[len(houses) // 2]
    knowledge = partial_knowledge(house, seen_share=0.0, rng=np.random.default_rng(0))
    items = missing_types(house, knowledge)
    belief = benchmark(estimator(name).believe, knowledge, items)
    assert belief.probability.shape == (len(items), len(house.plan.containers))
