"""Runs in notebooks: tables of a run, of replays and comparisons, and the offline page in a frame."""

from __future__ import annotations

import html
import sys
from pathlib import Path
from types import SimpleNamespace

import pytest
from sample_logs import record_run, toy_events, toy_info, toy_options, write_toy_log

import replayers
from dashboards.capsule.embedded import EmbeddedPage, NoNotebook
from replayers.runs.run import Run, read
from workbench.errors import BadValue


@pytest.fixture(scope="module")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    return read(write_toy_log(tmp_path_factory.mktemp("logs") / "run.mcap"))


def test_a_run_is_a_short_table(run: Run) -> None:
    shown = run._repr_html_()
    for words in ("run.mcap", "model-lios", "find Mug and bring it to start", "done", "11.0"):
        assert words in shown
    assert len(shown) < 3000
    assert "was cut off" not in shown


def test_names_from_a_log_cannot_become_markup(tmp_path: Path) -> None:
    log = tmp_path / "run.mcap"
    info = toy_info(title="<img src=x onerror=alert(1)>", place="<b>" + "x" * 300)
    record_run(log, toy_events()[:5], **{**toy_options(), "info": info})
    shown = read(log)._repr_html_()
    assert "<img" not in shown
    assert "<b>x" not in shown
    assert "was cut off" in shown


def test_replays_and_comparisons_are_tables(run: Run) -> None:
    made = replayers.replay(run, ["pes-greedy", "model-lios"], settings=replayers.ReplaySettings(worlds=5))
    shown = made._repr_html_()
    assert shown.count("<tr>") == 3
    assert "pes-greedy" in shown
    assert next(iter(made))._repr_html_().count("<tr>") == 2
    pairs = replayers.compare(made)
    assert isinstance(pairs, tuple)
    assert len(pairs) == 1
    assert pairs._repr_html_() == pairs[0]._repr_html_()
    assert "in every world" in pairs._repr_html_()


def test_the_page_stands_in_a_frame_that_cannot_reach_the_notebook(run: Run) -> None:
    frame = EmbeddedPage([run], height_px=300)._repr_html_()
    assert frame.startswith("<iframe srcdoc=")
    assert frame.count("<") == 2
    assert 'sandbox="allow-scripts allow-downloads"' in frame
    assert "height:300px" in frame
    page = html.unescape(frame.partition('srcdoc="')[2].partition('"')[0])
    assert page.lower().startswith("<!doctype html>")
    assert page.rstrip().endswith("</html>")
    with pytest.raises(BadValue, match="height_px"):
        EmbeddedPage([run], height_px=10)


def test_without_a_notebook_it_says_what_to_do(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delitem(sys.modules, "IPython", raising=False)
    with pytest.raises(NoNotebook, match="lios view"):
        run.show()
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: None))  # type: ignore[arg-type]
    with pytest.raises(NoNotebook, match=r"lios capsule .*run\.mcap -o run\.html"):
        run.show()


def test_in_a_notebook_it_is_displayed(run: Run, monkeypatch: pytest.MonkeyPatch) -> None:
    shown: list[object] = []
    kernel = SimpleNamespace(kernel=object())
    monkeypatch.setitem(sys.modules, "IPython", SimpleNamespace(get_ipython=lambda: kernel))  # type: ignore[arg-type]
    monkeypatch.setitem(sys.modules, "IPython.display", SimpleNamespace(display=shown.append))  # type: ignore[arg-type]
    run.show(run, height_px=400)
    assert isinstance(shown[0], EmbeddedPage)
