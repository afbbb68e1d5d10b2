"""Errors while a view is drawn are reported in one line, in the tab and in the log, and the view goes on."""

from __future__ import annotations

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from toy_run import toy_run

from dashboards.library.library import Library
from dashboards.model.clock import Clock
from dashboards.model.timeline import timeline_of
from dashboards.panels.markup import error_line
from dashboards.viser_app.panel.controls import Controls
from dashboards.viser_app.session import BrowserSession
from dashboards.viser_app.view_errors import ViewErrors
from dashboards.viser_app.view_state import ViewState
from workbench.errors import BadValue

SAMPLES = Path(__file__).parents[2] / "logs"


def session() -> BrowserSession:
    told: list[str] = []
    client: Any = SimpleNamespace(
        client_id=3, scene=SimpleNamespace(), add_notification=lambda title, words, **_: told.append(words), told=told
    )
    made = BrowserSession(client, Library([SAMPLES]), ViewState(runs=(0,)))
    made.clock = Clock(timelines=(timeline_of(toy_run()),))
    made._show_room_names = lambda: None  # type: ignore[method-assign]  # it asks the browser for its camera
    return made


def _until(done: Callable[[], bool]) -> None:
    end = time.monotonic() + 60
    while not done() and time.monotonic() < end:
        time.sleep(0.01)
    assert done()


def test_a_moment_that_cannot_be_drawn_is_told_and_the_next_is_shown(
    monkeypatch: pytest.MonkeyPatch, caplog: pytest.LogCaptureFixture
) -> None:
    made, told, shown = session(), [], []

    def show() -> None:
        shown.append(made.state.at)
        if made.state.at == 0.0:
            raise KeyError("a container\nthat is not there")

    monkeypatch.setattr(made, "_show", show)
    made.error_listeners.append(told.append)
    with caplog.at_level(logging.ERROR, logger="lios.dashboard"):
        made._thread.start()
        _until(lambda: bool(told))
        made.change(at=1.0)
        _until(lambda: told[-1] == "")
    made.stop()
    made._thread.join(60)
    assert not made._thread.is_alive()
    assert (shown[0], shown[-1]) == (0.0, 1.0)
    assert told[0].startswith("this moment could not be drawn: KeyError: ")
    assert told[0].endswith("(test_view_errors.py:" + told[0].rpartition(":")[2])
    assert [record.getMessage() for record in caplog.records] == [f"lios: view 3: {told[0]}"]
    assert "\n" not in told[0]


def test_a_log_that_cannot_be_read_is_told_and_leaves_the_others_open(monkeypatch: pytest.MonkeyPatch) -> None:
    made, before = session(), session().state.runs

    def fail(_: int) -> None:
        raise KeyError("a fault of ours")

    monkeypatch.setattr(made.library, "timeline", fail)
    made.open_runs((1,))
    assert made.state.runs == before
    assert made.client.told[0].startswith(f"{made.library.paths[1].name} could not be drawn: KeyError")


def test_a_settler_or_a_teller_that_fails_ends_nothing(monkeypatch: pytest.MonkeyPatch) -> None:
    made, shown, failed = session(), [], threading.Event()
    monkeypatch.setattr(made, "_show", lambda: shown.append(made.state.at))

    def fail(*_: object) -> None:
        failed.set()
        raise RuntimeError("no")

    made.settlers.append(fail)
    made.error_listeners.append(fail)
    made._thread.start()
    assert failed.wait(60), "it settles"
    made.change(at=1.0)
    _until(lambda: 1.0 in shown)
    made.stop()


def test_a_panel_that_cannot_be_drawn_says_so_and_the_next_one_is_drawn() -> None:
    controls = object.__new__(Controls)
    sent: dict[str, str] = {}
    controls._session = SimpleNamespace(view_errors=ViewErrors("1"))  # type: ignore[assignment]
    controls._set = sent.__setitem__  # type: ignore[method-assign]
    controls._draw("plan", lambda: 1 / 0)  # type: ignore[arg-type, return-value]
    controls._draw("cursor", lambda: "here")
    assert "the panel plan could not be drawn: ZeroDivisionError: division by zero" in sent["plan"]
    assert sent["cursor"] == "here"
    controls._draw("plan", lambda: "a plan")
    assert sent["plan"] == "a plan"


def test_the_log_is_told_once_while_nothing_changes(caplog: pytest.LogCaptureFixture) -> None:
    kept, told = ViewErrors("1"), []
    for error in (BadValue("x", 1, "2"), BadValue("x", 1, "2"), BadValue("y", 1, "2")):
        with kept.caught("the plan", told.append):
            raise error
    assert len(told) == 3
    assert [record.getMessage() for record in caplog.records if record.levelno == logging.ERROR] == [
        "lios: view 1: the plan could not be drawn: x is 1; it must be 2.",
        "lios: view 1: the plan could not be drawn: y is 1; it must be 2.",
    ]


def test_a_log_that_breaks_its_reader_is_left_out(monkeypatch: pytest.MonkeyPatch) -> None:
    made = session()
    monkeypatch.setattr(made.library, "timeline", lambda _: {}["nothing"])
    made.open_runs((1,))
    assert made.state.runs == (0,)
    assert "KeyError" in made.client.told[0]  # type: ignore[attr-defined]


def test_words_of_strangers_are_no_markup() -> None:
    assert "<b>" not in error_line("<b>bold</b>")
    assert error_line("") == ""
