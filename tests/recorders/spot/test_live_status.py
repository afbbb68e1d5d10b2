"""The status of a session: what it says, where it is written, and its line on a terminal."""

from __future__ import annotations

import io
from pathlib import Path

import msgspec
import pytest
from spot_help import messages, placed, robot
from test_operator_keys import terminal

from recorders.spot.client.time_source import RunningClock
from recorders.spot.record_session import SessionPlan, record_session
from recorders.spot.run.status_line import CLEAR_LINE, StatusLine
from recorders.spot.session.live_status import status_words
from recorders.spot.session.session import Rates
from recorders.spot.session.topics import SESSION_STATUS, SessionStatus
from recorders.spot.simulated.faults import FaultKind
from workbench.log_schema.events import Stamp

FINE = SessionStatus(
    stamp=Stamp(sec=1, nsec=0),
    battery_percent=81.4,
    localized=True,
    silent_s=0.1,
    tags=("WaterBottle|1",),
    dropped=0,
    disk_free_mb=12_345,
    doing="go to bed",
)


def test_what_is_wrong_comes_first_in_words() -> None:
    assert status_words(FINE) == "next: go to bed | battery 81 % | sees WaterBottle|1 | 12.3 GB free"
    bad = msgspec.structs.replace(
        FINE, localized=False, silent_s=4.2, dropped=7, tags=tuple("abcde"), battery_percent=-1.0, doing=""
    )
    said = "NO ANSWER for 4 s | NOT LOCALISED | 7 messages DROPPED | sees a, b, c and 2 more | 12.3 GB free"
    assert status_words(bad) == said


def test_a_recording_tells_its_status_in_the_log_and_to_who_shows_it(tmp_path: Path) -> None:
    shown: list[SessionStatus] = []
    rates = Rates(images_hz=0, grid_hz=0, status_hz=10)
    with robot(clock=RunningClock(speed_up=10)) as (spot, connection):
        with spot.state.alive() as state:
            state.localized = True
        plan = SessionPlan(site=placed()[0], rates=rates, for_s=1.5, show_status=shown.append)
        record_session(connection, plan, tmp_path / "s.mcap")
    written = [msgspec.json.decode(m[3], type=SessionStatus) for m in messages(tmp_path / "s.mcap", SESSION_STATUS)]
    assert written == shown
    last = written[-1]
    assert last.localized
    assert 0 < last.battery_percent <= 100
    assert last.disk_free_mb > 0
    assert last.silent_s < 1.0
    assert "tag 540" in last.tags, "the map's fiducial hangs at the start"


def test_an_outage_and_a_lost_localisation_are_in_the_status(tmp_path: Path) -> None:
    shown: list[SessionStatus] = []
    with robot(clock=RunningClock()) as (spot, connection):

        def show(status: SessionStatus) -> None:
            shown.append(status)
            if len(shown) == 3:
                spot.inject(FaultKind.DROPPED, for_s=2.0)

        rates = Rates(images_hz=0, grid_hz=0, status_hz=10)
        record_session(
            connection, SessionPlan(site=placed()[0], rates=rates, for_s=1.6, show_status=show), tmp_path / "s.mcap"
        )
    assert not any(status.localized for status in shown)
    assert shown[2].silent_s < 0.5
    assert shown[-1].silent_s > 0.7


def test_messages_scroll_above_the_line_and_an_open_question_hides_it() -> None:
    stream = io.StringIO()
    line = StatusLine(stream, lambda: 40)
    line.write("hello\n")
    line.show(FINE)
    cut = status_words(FINE)[:39]
    assert stream.getvalue() == f"hello\n{cut}"
    line.write("noted\n")
    assert stream.getvalue() == f"hello\n{cut}{CLEAR_LINE}noted\n{cut}"
    line.write("Open it? [y/n] ")
    line.show(FINE)
    assert stream.getvalue().endswith(f"{CLEAR_LINE}Open it? [y/n] ")
    line.write("\n")
    assert stream.getvalue().endswith(cut)
    unknown = StatusLine(io.StringIO(), lambda: 0)
    unknown.show(FINE)
    assert unknown._stream.getvalue() == status_words(FINE)  # type: ignore[attr-defined]
    line.close()
    assert stream.getvalue().endswith(CLEAR_LINE)


@pytest.mark.slow
def test_a_terminal_shows_battery_tags_and_what_comes_next(tmp_path: Path) -> None:
    arguments = (
        "spot",
        "run",
        "--estimator",
        "counts",
        "--strategy",
        "pes-greedy",
        "--own-estop",
        "--images-hz",
        "0",
    )
    options = ("--furniture-open", "--look", "1", "-o", str(tmp_path / "run.mcap"))
    with terminal(*arguments, *options, folder=tmp_path, speed_up=5) as (screen, _):
        screen.wait_for("next: ")
        screen.wait_for("battery ")
        screen.type("p")
        screen.wait_for("Pause: the robot stands")
        screen.type("g")
        screen.wait_for("may go on")
        screen.type(" ")
        assert screen.result() == 0
    assert "stopped by key" in screen.shown
