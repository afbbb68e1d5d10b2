"""Serving without a browser: refusals, restored addresses, growing logs."""

from __future__ import annotations

import socket
import threading
import time
import urllib.error
import urllib.request
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any, ClassVar

import pytest
from hypothesis import given
from hypothesis import strategies as st
from sample_logs import write_toy_log

from dashboards.library.library import Library, NoLogsInFolder, logs_of
from dashboards.viser_app.bridge import address, execute_command, parse_query
from dashboards.viser_app.following import Follower, wait_for
from dashboards.viser_app.server import CannotListen, Dashboard, PortInUse
from dashboards.viser_app.serving import open_dashboard
from dashboards.viser_app.view_state import ViewState
from workbench.errors import BadValue, FileMissing, LiosError


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_toy_log(tmp_path_factory.mktemp("logs") / "run.mcap")


@pytest.fixture
def dashboard(log: Path) -> Iterator[Dashboard]:
    made = open_dashboard([log], port=0)
    yield made
    made.stop()


def test_a_port_in_use_is_one_clear_line(log: Path) -> None:
    with socket.socket() as taken:
        taken.bind(("127.0.0.1", 0))
        taken.listen()
        port = taken.getsockname()[1]
        with pytest.raises(PortInUse, match=rf"port {port} on 127\.0\.0\.1 is in use"):
            open_dashboard([log], port=port)


def test_an_address_of_another_machine_is_refused(log: Path) -> None:
    with pytest.raises(CannotListen):
        open_dashboard([log], host="192.0.2.1", port=0)


@pytest.mark.parametrize(("port", "at"), [(-1, 0.0), (70000, 0.0), (0, -1.0), (0, float("nan"))])
def test_numbers_out_of_range_are_refused(log: Path, port: int, at: float) -> None:
    with pytest.raises(BadValue):
        open_dashboard([log], port=port, at=at)


def test_missing_and_empty_are_refused(tmp_path: Path) -> None:
    with pytest.raises(FileMissing):
        open_dashboard([tmp_path / "no.mcap"], port=0)
    with pytest.raises(NoLogsInFolder, match=r"no \.mcap logs"):
        open_dashboard([tmp_path], port=0)


def test_a_file_that_is_no_log_is_refused_and_in_a_folder_left_out(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    bad = tmp_path / "bad.mcap"
    bad.write_bytes(b"not a log")
    with pytest.raises(LiosError):
        open_dashboard([bad], port=0)
    with pytest.raises(LiosError):
        open_dashboard([tmp_path], port=0)
    (tmp_path / "good.mcap").write_bytes(log.read_bytes())
    open_dashboard([tmp_path], port=0).stop()
    assert "Left out" in capsys.readouterr().err


def test_a_truncated_log_is_shown_as_far_as_it_goes(log: Path, tmp_path: Path) -> None:
    cut = tmp_path / "cut.mcap"
    cut.write_bytes(log.read_bytes()[:-600])
    timeline = Library([cut]).timeline(0)
    assert not timeline.run.complete
    assert timeline.decisions


def test_only_this_machine_is_served_by_default(dashboard: Dashboard) -> None:
    assert dashboard.url.startswith("http://127.0.0.1:")
    with urllib.request.urlopen(dashboard.link(), timeout=5) as answer:
        assert b"<html" in answer.read().lower()


@pytest.mark.parametrize(
    "path", ["/../../../../etc/passwd", "/%2e%2e/%2e%2e/etc/passwd", "/run.mcap", "//etc/passwd"]
)
def test_no_file_can_be_read_through_the_server(dashboard: Dashboard, path: str) -> None:
    cookie = f"lios-dashboard-{dashboard.server.get_port()}={dashboard.token}"
    with pytest.raises(urllib.error.HTTPError) as refused:
        urllib.request.urlopen(urllib.request.Request(dashboard.url + path, headers={"Cookie": cookie}), timeout=5)
    assert refused.value.code == 404
    refused.value.close()


def test_the_same_log_twice_is_one_log(log: Path) -> None:
    assert len(Library([log, log, log.parent]).paths) == 1
    assert logs_of([log.parent]) == [log]


def test_an_address_restores_what_it_says() -> None:
    state = ViewState(runs=(2, 0), at=12.5, alignment="distance", focus="Mug & <b>", walls="none", follow=True)
    again = parse_query("?" + address(state, None), runs=3)
    assert again == {
        "runs": (2, 0),
        "at": 12.5,
        "alignment": "distance",
        "focus": "Mug & <b>",
        "walls": "none",
        "follow": True,
    }


def test_an_address_cannot_name_what_is_not_there() -> None:
    assert parse_query("?runs=7,-1,x,1,1&at=nan&clock=mood&walls=../etc", runs=2) == {"runs": (1,)}


@given(st.text(max_size=60))
def test_any_address_is_survived(query: str) -> None:
    changes = parse_query(query, runs=3)
    assert all(r < 3 for r in changes.get("runs", ()))  # type: ignore[attr-defined]
    ViewState(runs=(0,))
    assert float(str(changes.get("at", 0.0))) >= 0.0


class _Session:
    """What obey needs of a session; remembers what was asked."""

    def __init__(self) -> None:
        self.asked: list[Any] = []
        self.listers: dict[str, object] = {}
        self.library = SimpleNamespace(paths=(1, 2, 3))
        self.clock = SimpleNamespace(end=15.0, decisions=lambda: (0.0, 4.0, 7.0))

    def change(self, **changes: object) -> None:
        self.asked.append(changes)

    def open_runs(self, runs: tuple[int, ...]) -> None:
        self.asked.append(("open", runs))

    def toggle_run(self, run: int) -> None:
        self.asked.append(("overlay", run))

    def open_container(self, index: int) -> None:
        self.asked.append(("look", index))


@pytest.mark.parametrize(
    ("words", "asked"),
    [
        ("seek 4.5", {"at": 4.5, "playing": False}),
        ("4.5", {"at": 4.5, "playing": False}),
        ("seek 99", {"at": 15.0, "playing": False}),
        ("decision 2", {"at": 4.0, "playing": False}),
        ("open 1,2", ("open", (1, 2))),
        ("overlay 2 ", ("overlay", 2)),
        ("look 3", ("look", 3)),
        ("address ?at=3", {"at": 3.0}),
    ],
)
def test_commands_of_the_page(words: str, asked: object) -> None:
    session = _Session()
    execute_command(session, words)  # type: ignore[arg-type]
    assert session.asked == [asked]


@given(st.text(max_size=40))
def test_any_command_is_survived(words: str) -> None:
    with suppress(BadValue):
        execute_command(_Session(), words)  # type: ignore[arg-type]


@pytest.mark.parametrize("words", ["mug", "decision 99", "decision", "fly 3", "open", "open x"])
def test_words_that_mean_nothing_are_answered(words: str) -> None:
    session = _Session()
    with pytest.raises(BadValue, match="Go to"):
        execute_command(session, words)  # type: ignore[arg-type]
    assert session.asked == []


def test_a_log_that_grows_is_read_again(log: Path, tmp_path: Path) -> None:
    whole = log.read_bytes()
    growing = tmp_path / "growing.mcap"
    growing.write_bytes(whole[: len(whole) // 2])
    library = Library([growing])
    shown = threading.Event()
    follower = Follower(library, lambda: [SimpleNamespace(reread=shown.set)])  # type: ignore[list-item]
    try:
        growing.write_bytes(whole)
        assert shown.wait(60)
        assert library.timeline(0).run.complete
    finally:
        follower.stop()


def test_a_log_that_comes_later_is_waited_for(log: Path, tmp_path: Path) -> None:
    later = tmp_path / "later.mcap"
    threading.Timer(0.3, lambda: later.write_bytes(log.read_bytes())).start()
    began = time.monotonic()
    assert wait_for(later, patience_s=60)
    assert time.monotonic() - began >= 0.25
    assert not wait_for(tmp_path / "never.mcap", patience_s=0.2)


def test_ctrl_c_right_after_the_address_stops_it_as_asked(monkeypatch: pytest.MonkeyPatch) -> None:
    from dashboards.viser_app import serving

    said: list[str] = []
    stopped: list[bool] = []

    class Dashboard:
        lost: ClassVar[dict[str, tuple[str, ...]]] = {}

        def link(self) -> str:
            return "http://127.0.0.1:1/?token=abc"

        def stop(self) -> None:
            stopped.append(True)

    def say(words: str) -> None:
        said.append(words)
        if words.startswith("Dashboard at"):
            raise KeyboardInterrupt

    monkeypatch.setattr(serving, "open_dashboard", lambda *_, **__: Dashboard())
    monkeypatch.setattr(serving, "say", say)
    serving.show_until_stopped([], host="127.0.0.1", port=0, at=0.0, follow=False)
    assert said == ["Dashboard at http://127.0.0.1:1/?token=abc (Ctrl-C stops it).", "Stopped."]
    assert stopped == [True]
