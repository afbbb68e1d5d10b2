"""Concurrent callbacks of one browser: a seek is never lost, a state never half changed."""

from __future__ import annotations

import gc
import threading
from collections.abc import Iterator
from contextlib import contextmanager, suppress
from pathlib import Path
from types import SimpleNamespace
from typing import Any

import pytest
from toy_run import other_run, toy_run

from dashboards.library.library import MAX_CACHED_RUNS, Library
from dashboards.model.clock import Clock
from dashboards.model.timeline import timeline_of
from dashboards.viser_app import fitted_camera
from dashboards.viser_app.bridge import execute_command, parse_query
from dashboards.viser_app.cameras import CameraPose
from dashboards.viser_app.panel.options import Options
from dashboards.viser_app.session import BrowserSession
from dashboards.viser_app.view_state import MAX_RUNS, ViewState
from workbench.errors import BadValue

CLOCK = Clock(timelines=(timeline_of(toy_run()), timeline_of(other_run())))
SAMPLES = Path(__file__).parents[2] / "logs"


class Client(SimpleNamespace):
    """As much of a browser as a session that is not started asks for."""

    def __init__(self) -> None:
        super().__init__(client_id=1, scene=SimpleNamespace())
        self.told: list[str] = []

    def add_notification(self, title: str, words: str, **_: Any) -> None:
        self.told.append(f"{title}: {words}")


def session(**state: Any) -> BrowserSession:
    made = BrowserSession(Client(), Library([SAMPLES]), ViewState(runs=(0,), **state))  # type: ignore[arg-type]
    made.clock = CLOCK
    made._show_room_names = lambda: None  # type: ignore[method-assign]  # it asks the browser for its camera
    return made


class SlowClock(SimpleNamespace):
    """A clock that a person's seek falls into: while the view works out its next moment."""

    def __init__(self, of: BrowserSession) -> None:
        super().__init__(timelines=CLOCK.timelines)
        self._session = of
        self.seeking: threading.Thread | None = None

    @property
    def end(self) -> float:
        if self.seeking is None:
            self.seeking = threading.Thread(target=self._session.change, kwargs={"at": 3.0, "playing": False})
            self.seeking.start()
            self.seeking.join(timeout=0.2)
        return CLOCK.end


def test_a_seek_while_the_run_plays_is_not_lost() -> None:
    made = session(playing=True, at=5.0)
    clock = SlowClock(made)
    made.clock = clock  # type: ignore[assignment]
    made._advance_playback(1.0)
    assert clock.seeking is not None
    clock.seeking.join()
    assert (made.state.at, made.state.playing) == (3.0, False)


def test_play_at_the_end_begins_anew_and_pauses_in_place() -> None:
    made = session(at=CLOCK.end)
    made.toggle_playing()
    assert (made.state.at, made.state.playing) == (0.0, True)
    made.change(at=2.0)
    made.toggle_playing()
    assert (made.state.at, made.state.playing) == (2.0, False)


def test_a_view_without_runs_plays_nothing() -> None:
    made = session(playing=True, alignment="distance")
    made.clock = Clock(timelines=(), alignment="distance")
    made._advance_playback(1.0)
    assert made.state.at == 0.0


def test_who_looks_elsewhere_is_no_longer_live() -> None:
    made = session(live=True, at=CLOCK.end)
    made.change(speed=2.0)
    assert made.state.live
    made.change(at=1.0)
    assert not made.state.live


def test_no_more_runs_are_laid_over_each_other_than_fit() -> None:
    made = session()
    made.library.paths *= 2
    made.state = ViewState(runs=tuple(range(MAX_RUNS)))
    made.toggle_run(MAX_RUNS)
    assert made.state.runs == tuple(range(MAX_RUNS))
    assert f"At most {MAX_RUNS}" in made.client.told[0]
    made.toggle_run(3)
    assert 3 not in made.state.runs


def test_addresses_of_strangers_change_what_makes_sense() -> None:
    many = "&".join(f"x{i}=1" for i in range(500))
    assert parse_query(f"?at=12.5&{many}", runs=3) == {"at": 12.5}
    assert parse_query(f"?runs={'9' * 5000},1", runs=3) == {"runs": (1,)}


def test_commands_with_numbers_beyond_reason_do_nothing() -> None:
    made = session()
    before = made.state
    for words in (f"open {'9' * 5000}", "open ²", "decision 1e11", "look 1e11", f"decision {'9' * 400}"):
        with suppress(BadValue):
            execute_command(made, words)
    assert made.state == before


def test_what_the_server_sets_itself_is_nobodys_choice() -> None:
    made = session()
    options = object.__new__(Options)
    options._session = made
    options._change(SimpleNamespace(client=None), speed=8.0)  # type: ignore[arg-type]
    assert made.state.speed == 1.0
    options._change(SimpleNamespace(client=made.client), speed=8.0)  # type: ignore[arg-type]
    assert made.state.speed == 8.0


def test_places_are_forgotten_like_runs() -> None:
    library = Library([SAMPLES])
    from dataclasses import replace

    plan = CLOCK.timelines[0].plan
    for i in range(MAX_CACHED_RUNS + 5):
        library.shape(replace(plan, name=f"place {i}"))
    assert MAX_CACHED_RUNS // 2 <= len(library._shapes) <= MAX_CACHED_RUNS
    assert library.shape(replace(plan, name="place 28")) is library.shape(replace(plan, name="place 28"))


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("number", [1, 2])
def test_first_looks_go_with_their_run(number: int) -> None:
    from dashboards.model.first_stop_costs import _FIRST_LOOKS, first_looks

    timeline = timeline_of(toy_run())
    frame = timeline.decisions[number - 1]
    assert first_looks(timeline, frame) is first_looks(timeline, frame)
    gc.collect()
    kept = len(_FIRST_LOOKS)
    del timeline
    gc.collect()
    assert len(_FIRST_LOOKS) == kept - 1


def test_a_house_fits_its_window_although_the_browser_tells_of_an_older_camera(
    monkeypatch: pytest.MonkeyPatch,
) -> None:
    """The panel is docked while the page arrives: the new size comes with the camera of before the first fit."""
    made = session()
    put: list[CameraPose] = []
    monkeypatch.setattr(fitted_camera, "look", lambda _, pose: put.append(pose))
    camera = SimpleNamespace(position=(9.0, 9.0, 9.0), image_width=1600, image_height=1000)
    made.client.camera = camera  # type: ignore[misc]
    made.camera._placed.append(camera.position)
    made.look()
    camera.image_width = 1156
    made.camera.refit()
    assert len(put) == 2
    assert put[1] == made.camera.pose() != put[0]
    camera.position = put[0].position  # the last word of the browser: the second fit was overtaken
    made._settle()
    assert put[2] == made.camera.pose()
    camera.position = put[2].position
    made._settle()
    assert len(put) == 3, "it fits"
    camera.position, camera.image_width = (1.0, 2.0, 3.0), 900  # a person's own
    made.camera.refit()
    made._settle()
    assert len(put) == 3


def test_a_camera_that_never_gets_where_it_is_put_is_left_in_peace(monkeypatch: pytest.MonkeyPatch) -> None:
    made = session()
    put: list[CameraPose] = []
    monkeypatch.setattr(fitted_camera, "look", lambda _, pose: put.append(pose))
    made.client.camera = SimpleNamespace(position=(9.0, 9.0, 9.0), image_width=1600, image_height=1000)  # type: ignore[misc]
    made.camera._placed.append((9.0, 9.0, 9.0))
    made.look()
    for _ in range(50):
        made._settle()
    assert len(put) < 10


def test_a_browser_that_leaves_while_its_view_settles_leaves_no_thread(monkeypatch: pytest.MonkeyPatch) -> None:
    made = session()
    monkeypatch.setattr(made, "_show", lambda: None)
    made.settlers.append(BrowserSession.stop)
    made._thread.start()
    made._thread.join(timeout=60)
    assert not made._thread.is_alive()


def test_a_camera_that_moves_while_the_view_settles_settles_anew(monkeypatch: pytest.MonkeyPatch) -> None:
    made = session()
    monkeypatch.setattr(made, "_show", lambda: None)
    settled: list[int] = []

    def settle(of: BrowserSession) -> None:
        settled.append(len(settled))
        of.stop() if len(settled) == 2 else of.mark_unsettled()

    made.settlers.append(settle)
    made._thread.start()
    made._thread.join(timeout=60)
    assert settled == [0, 1]


def test_a_moment_is_one_message() -> None:
    """Whatever changes with it: the browser then draws once, and its panels and its house show the same moment."""
    made, sent = session(at=5.0), []

    @contextmanager
    def atomic() -> Iterator[None]:
        sent.append("begin")
        yield
        sent.append("end")

    made.client.atomic, made.client.flush = atomic, lambda: sent.append("flush")  # type: ignore[method-assign]
    made.stage = SimpleNamespace(  # type: ignore[assignment]
        show_walls=lambda _: None,
        show_occupancy=lambda _: None,
        show=lambda *_, **__: sent.append("house"),
        show_items=lambda _: sent.append("items"),
    )
    made.sensors = SimpleNamespace(show=lambda *_, **__: None)  # type: ignore[assignment]
    made._open = lambda _: None  # type: ignore[method-assign]
    made.watchers.append(lambda *_: sent.append("panels"))
    made._show()
    assert sent == ["begin", "house", "items", "panels", "end", "flush"]
