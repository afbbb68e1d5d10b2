"""Ghosts in the dashboard: what is refused, what the panel says, and that their runs come into the library."""

from __future__ import annotations

import time
from math import inf
from pathlib import Path

import pytest
from sample_logs import write_toy_log

from dashboards.library.library import Library
from dashboards.palette import run_colour
from dashboards.panels.live.ghosts import ghosts
from dashboards.viser_app.ghost_watch import ghosts_named
from dashboards.viser_app.serving import open_dashboard
from replayers.live.ghost_bounds import GhostBounds, GhostReport
from replayers.live.ghosts import Ghosts
from replayers.runs.run import read
from workbench.cli import run
from workbench.errors import BadValue, LiosError, UnknownName


@pytest.fixture(scope="module")
def log(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_toy_log(tmp_path_factory.mktemp("logs") / "run.mcap")


def test_names_are_spelt_out_once(log: Path) -> None:
    assert ghosts_named("PesGreedy, pes-greedy,lios", [log], follow=True) == ("pes-greedy", "model-lios")


def test_ghosts_need_one_log_that_is_followed(log: Path) -> None:
    for logs, follow in (([log], False), ([log, log], True), ([log.parent], True)):
        with pytest.raises(BadValue, match="--follow and one log"):
            ghosts_named("pes-greedy", logs, follow=follow)


def test_what_is_no_ghost_is_refused_before_anything_is_served(log: Path) -> None:
    with pytest.raises(UnknownName, match="pes-gredy"):
        open_dashboard([log], port=0, follow=True, ghosts="pes-gredy")
    with pytest.raises(BadValue, match="need not know"):
        ghosts_named("oracle", [log], follow=True)
    with pytest.raises(BadValue):
        ghosts_named(" , ", [log], follow=True)


def test_a_log_without_a_map_is_refused(tmp_path: Path) -> None:
    from mcap.writer import Writer

    bare = tmp_path / "bare.mcap"
    with bare.open("wb") as stream:
        writer = Writer(stream)
        writer.start()
        writer.finish()
    with pytest.raises(LiosError, match="holds no run"):
        open_dashboard([bare], port=0, follow=True, ghosts="pes-greedy")


def test_the_panel_says_what_is_proven_and_what_is_not(log: Path) -> None:
    driven = GhostBounds(strategy="a", driven=True, lower=43.7, upper=43.7)
    wide = GhostBounds(strategy="<b>", lower=1.0, upper=inf, outer=True, least_extra=-inf, most_extra=42.7)
    broken = GhostBounds(strategy="c", trouble="it raised <i>")
    report = GhostReport(bounds=(driven, wide, broken), line="Open: <a>.", note="Bounds began anew.", decisions=3)
    shown = str(ghosts(report, {"a": run_colour(0)}))
    assert "Open: &lt;a&gt;." in shown
    assert "a</span>" in shown or "a <small>(driven)" in shown
    assert "~1.0" in shown
    assert "- to 42.7" in shown
    assert "&lt;b&gt;" in shown
    assert "it raised &lt;i&gt;" in shown
    assert "Bounds began anew." in shown
    assert "too wide for the time" in shown
    assert ghosts(None, {}) == ""
    assert "first replay" in str(ghosts(GhostReport(), {}))


def test_the_row_of_the_driven_run_and_the_panel_have_one_figure_once_it_has_ended() -> None:
    """A robot is charged what it walked, 59.1; its replay walks the ways of the map, as the ghosts do."""
    log = Path(__file__).resolve().parents[2] / "logs" / "spot-home-A-conditioned-lios.mcap"
    report = Ghosts(log, ("model-lios",)).next_round()
    assert report is not None
    shown = str(ghosts(report, {}))
    outcome = read(log).outcome
    assert outcome is not None
    assert f'<td class="n">{outcome.cost:.1f}</td><td class="n">{outcome.cost:.1f}</td>' in shown
    assert shown.count("60.0") == 3, "the replay beside the driven run's name, and the ghost's two bounds"
    plain = GhostBounds(strategy="a", driven=True, lower=43.72, upper=43.72, charged=43.721)
    assert "replayed 43.7" not in str(ghosts(GhostReport(bounds=(plain,)), {}))


def test_a_log_that_is_awaited_is_no_run_until_it_is_there(log: Path, tmp_path: Path) -> None:
    library = Library([log])
    later = tmp_path / "later.mcap"
    (index,) = library.expect_logs([later])
    assert library.is_expected(index)
    assert [row.index for row in library.rows()] == [0]
    later.write_bytes(log.read_bytes())
    assert not library.is_expected(index)
    assert [row.index for row in library.rows()] == [0, 1]
    assert library.timeline(index).run.path == later


@pytest.mark.slow
def test_ghosts_come_into_the_library_with_their_bounds(log: Path) -> None:
    dashboard = open_dashboard([log], port=0, follow=True, ghosts="pes-greedy")
    try:
        watch = dashboard.ghosts
        assert watch is not None
        library = watch.library
        end = time.monotonic() + 120
        while not (library.ghosts is not None and library.ghosts.bounds and not library.is_expected(watch.runs[0])):
            assert time.monotonic() < end, "no ghost came"
            time.sleep(0.05)
        assert library.timeline(watch.runs[0]).run.info.strategy == "pes-greedy"
    finally:
        dashboard.stop()


def test_the_command_line_says_it_in_one_line(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["view", str(log), "--ghosts", "pes-greedy"]) == 2
    assert "it must be given with --follow and one log" in capsys.readouterr().err
