"""What is known at the start: seeded, and never more than the requested share."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st
from toy import toy_plan

from workbench.errors import BadValue
from workbench.execution.start import known_at_start


@given(seed=st.integers(0, 2**32 - 1), most=st.floats(0, 1))
def test_at_most_the_share_and_in_the_plans_order(seed: int, most: float) -> None:
    plan = toy_plan()
    known = known_at_start(plan, rng=np.random.default_rng(seed), max_known=most)
    order = [c.id for c in plan.containers]
    assert len(known) <= most * len(order)
    assert list(known) == sorted(set(known), key=order.index)
    assert known == known_at_start(plan, rng=np.random.default_rng(seed), max_known=most)


def test_every_number_up_to_the_share_is_drawn() -> None:
    plan = toy_plan()
    counts = {len(known_at_start(plan, rng=np.random.default_rng(seed), max_known=0.4)) for seed in range(50)}
    assert counts == {0, 1, 2}


def test_a_share_above_one_is_refused() -> None:
    with pytest.raises(BadValue, match="within"):
        known_at_start(toy_plan(), rng=np.random.default_rng(0), max_known=1.5)
