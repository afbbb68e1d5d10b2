"""Moments of a log as the user writes them."""

from __future__ import annotations

import pytest
from sample_logs import T0

from replayers.log_tools.time_argument import moment
from workbench.errors import BadValue


def test_moments():
    assert moment("12.4", start_ns=T0, option="-S") == T0 + 12_400_000_000
    assert moment("2026-01-01T00:00:01.5Z", start_ns=0, option="-S") == T0 + 1_500_000_000
    assert moment("2026-01-01T01:00:00+01:00", start_ns=0, option="-S") == T0
    assert moment(str(T0), start_ns=5, option="-S") == T0
    assert moment("-3", start_ns=1, option="-S") == 0
    for text in ("nan", "inf", "soon", "", "1e99"):
        with pytest.raises(BadValue):
            moment(text, start_ns=0, option="-S")
