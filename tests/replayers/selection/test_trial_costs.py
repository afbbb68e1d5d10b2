"""What one log tells of each strategy, also of one that has no replay."""

from __future__ import annotations

from math import inf
from pathlib import Path

import numpy as np
import pytest
from known_costs import trial

import replayers
from replayers.selection.trial_costs import trial_costs

LOG = Path(__file__).resolve().parents[3] / "logs" / "find-lios.mcap"


def test_replays_of_one_log_become_bounds_and_differences() -> None:
    made = replayers.replay(LOG, ["lios", "greedy"], settings=replayers.ReplaySettings(worlds=20))
    records = list(made)
    names = (records[0].strategy, records[1].strategy, "broken")
    told = trial_costs(records, names, limit=400.0)
    assert told.driven == records[0].recorded_strategy == records[0].strategy
    assert told.exact[0]
    assert told.lower[0] == pytest.approx(records[0].recorded_cost)
    assert (told.lower[2], told.upper[2], told.expected[2]) == (0.0, inf, 400.0)
    assert np.isinf(told.max_difference[2, :2]).all()
    assert told.max_difference[0, 1] + told.max_difference[1, 0] >= -1e-9
    assert told.drawn is None


def test_bounds_the_wrong_way_round_are_refused() -> None:
    with pytest.raises(ValueError, match="above its upper"):
        trial([5, 1], [4, 2])
