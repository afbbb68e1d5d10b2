"""The clock of a log that is played."""

from __future__ import annotations

import pytest

from replayers.serving.playback_clock import PlaybackClock, TimeSpan
from workbench.errors import BadValue

S = 1_000_000_000


def test_every_time_is_passed_once_and_the_end_stops_it() -> None:
    clock = PlaybackClock(5 * S, 15 * S, 5 * S, speed=2.0)
    assert clock.advance(1.0) is None
    clock.play()
    assert [clock.advance(2.0), clock.advance(0.5)] == [TimeSpan(5 * S, 9 * S), TimeSpan(9 * S, 10 * S)]
    assert clock.advance(99.0) == TimeSpan(10 * S, 15 * S)
    assert clock.ended
    assert clock.advance(1.0) is None


def test_play_at_the_end_begins_again_and_says_that_it_jumped() -> None:
    clock = PlaybackClock(0, 10 * S, 10 * S)
    assert clock.play()
    assert clock.now_ns == 0
    assert not clock.play()


def test_seek_stays_within_the_log_and_does_not_start_it() -> None:
    clock = PlaybackClock(5 * S, 15 * S, 5 * S)
    for wanted, reached in ((0, 5 * S), (7 * S, 7 * S), (99 * S, 15 * S)):
        clock.seek(wanted)
        assert clock.now_ns == reached
    assert not clock.playing


@pytest.mark.parametrize("speed", [0.0, -1.0, 1e9, float("nan")])
def test_speeds_that_make_no_sense_are_refused(speed: float) -> None:
    with pytest.raises(BadValue, match="--speed"):
        PlaybackClock(0, S, 0, speed=speed)
