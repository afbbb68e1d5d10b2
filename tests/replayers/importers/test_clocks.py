"""One clock is used for a bag; clocks that give no order of events are refused."""

from __future__ import annotations

from pathlib import Path

import pytest

from replayers.importers.clocks import BagClock, BrokenClocks, ClockName, ClockSurvey
from workbench.log_schema.events import NANO

WALL = 1_767_000_000
BAG = Path("a.bag")


def chosen(times: list[tuple[float, float]], requested: ClockName | None = None, *, zeros: int = 0) -> BagClock:
    """The clock of a topic with (record, header) times in seconds."""
    survey = ClockSurvey()
    for record, header in times:
        survey.add("/tf", round(record * NANO), round(header * NANO))
    return survey.choose(BAG, requested, 0, zeros)


def test_headers_are_used_where_the_clocks_agree() -> None:
    clock = chosen([(WALL + i + 0.3, WALL + i) for i in range(10)])
    assert (clock.name, clock.note) == ("header", "")
    assert clock.time_of((WALL + 2) * NANO, (WALL + 1) * NANO) == (WALL + 1) * NANO
    assert clock.time_of((WALL + 2) * NANO, 0) == (WALL + 2) * NANO


def test_headers_in_simulated_time_give_way_to_record_times_and_that_is_told() -> None:
    times: list[tuple[float, float]] = [(WALL + i, 100 + i) for i in range(10)]
    clock = chosen(times)
    assert clock.name == "record"
    assert "s apart: record times are used throughout (--clock header" in clock.note
    assert clock.time_of((WALL + 5) * NANO, 105 * NANO) == (WALL + 5) * NANO


def test_with_header_clock_messages_without_a_stamp_are_shifted_to_it() -> None:
    clock = chosen([(WALL + i, 100 + i) for i in range(10)], "header")
    assert clock.name == "header"
    assert clock.time_of((WALL + 5) * NANO, 0) == 105 * NANO
    assert clock.time_of((WALL + 5) * NANO, 104 * NANO) == 104 * NANO
    assert clock.time_of((WALL + 5) * NANO, WALL * NANO) == 105 * NANO, "a stamp of the other clock"


def test_stamps_of_zero_are_told_and_replaced_by_the_time_of_recording() -> None:
    clock = chosen([(WALL, 0), (WALL + 1, WALL + 1), (WALL + 2, WALL + 2)], zeros=1)
    assert clock.time_of(WALL * NANO, 0) == WALL * NANO
    assert "header stamps of zero (1)" in clock.note


def test_latched_messages_and_stale_stamps_never_lie_before_the_run() -> None:
    clock = chosen([(WALL + i, WALL + i) for i in range(10)])
    hour_ago = (WALL - 3600) * NANO
    assert clock.time_of(hour_ago, hour_ago, latched=True) >= (WALL - 1) * NANO
    assert clock.time_of((WALL + 3) * NANO, hour_ago) == (WALL + 3) * NANO


def test_a_header_clock_that_jumps_back_is_not_used() -> None:
    times: list[tuple[float, float]] = [(WALL + i, WALL + i - (30 if i > 5 else 0)) for i in range(10)]
    assert chosen(times).name == "record"
    with pytest.raises(BrokenClocks, match=r"jump back 1 time .*--clock record"):
        chosen(times, "header")


def test_a_record_clock_that_was_set_back_is_refused() -> None:
    """Two stretches of time in the order of their record times lie over one another."""
    times = sorted([(WALL + i, WALL + i) for i in range(10)] + [(WALL + i + 0.5, WALL + i + 100) for i in range(10)])
    with pytest.raises(BrokenClocks, match="record clock was set back"):
        chosen(list(times))


def test_never_a_run_of_56_years() -> None:
    """A recorder whose clock was set while it ran."""
    with pytest.raises(BrokenClocks, match=r"gap of \d+ days"):
        chosen([(0.5, 0), *[(WALL + i, WALL + i) for i in range(10)]])
