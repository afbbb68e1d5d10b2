"""A decision is looked up by a moment within its run only."""

from __future__ import annotations

from pathlib import Path

import pytest

from replayers.runs.run import read
from replayers.runs.state_at import decision_at
from workbench.errors import BadValue

LOG = Path(__file__).parents[2] / "logs" / "deliver-3.mcap"


@pytest.mark.parametrize(("seconds", "decision"), [(0, 1), (149.3, 14), (149.4, 14)])
def test_a_moment_of_the_run_has_its_decision(seconds: float, decision: int) -> None:
    assert decision_at(read(LOG), seconds) == decision


@pytest.mark.parametrize("seconds", [-1, 149.5, 9999])
def test_a_moment_outside_of_the_run_is_refused(seconds: float) -> None:
    with pytest.raises(BadValue, match=r"within the run, 0 to 149\.3 seconds"):
        decision_at(read(LOG), seconds)
