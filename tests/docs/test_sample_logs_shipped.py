"""The shipped logs are small, complete (except the one that is meant not to be), and reproduced when made again."""

from __future__ import annotations

import runpy
from pathlib import Path

import pytest
from console_blocks import ROOT
from mcap.reader import make_reader

from replayers.runs.run import read
from workbench import cli

LOGS = ROOT / "logs"
MAKE = runpy.run_path(str(LOGS / "make.py"))
NAMES = sorted(path.stem for path in LOGS.glob("*.mcap"))


def _repeatable(log: Path) -> list[tuple[str, int, bytes]]:
    """What the same seed must give again: every /search/ topic but the wall-clock times of planning."""
    with log.open("rb") as stream:
        messages = make_reader(stream).iter_messages()
        found = [(c.topic, m.log_time, m.data) for _, c, m in messages]
    return [row for row in found if row[0].startswith("/search/") and row[0] != "/search/timing"]


def test_all_are_there_and_small() -> None:
    spot = [f"spot-home-{home}{end}" for home in MAKE["SPOT_HOMES"] for end in MAKE["SPOT_STRATEGIES"].values()]
    assert sorted([*MAKE["SIMULATED"], "cut-off", *spot]) == NAMES
    assert all((LOGS / f"{name}.mcap").stat().st_size < 1_000_000 for name in NAMES)


@pytest.mark.parametrize("page", ["docs/log-format.md", "docs/limits.md"])
def test_pages_give_their_sizes(page: str) -> None:
    sizes = sorted(path.stat().st_size / 1000 for path in LOGS.glob("*.mcap"))
    assert f"{sizes[0]:.0f} to {sizes[-1]:.0f} kB" in (ROOT / page).read_text(encoding="utf-8")


def test_readme_names_each() -> None:
    readme = (LOGS / "README.md").read_text(encoding="utf-8")
    assert [name for name in NAMES if f"{name}.mcap" not in readme and not name.startswith("spot-home")] == []


@pytest.fixture(scope="module")
def remade(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("logs")
    MAKE["make_simulated"](folder)
    return folder


@pytest.mark.parametrize("name", sorted(MAKE["SIMULATED"]))
def test_made_again_it_is_the_same(name: str, remade: Path) -> None:
    shipped = _repeatable(LOGS / f"{name}.mcap")
    assert len(shipped) > 10
    assert _repeatable(remade / f"{name}.mcap") == shipped, "run: python logs/make.py --spot"


@pytest.mark.parametrize("name", [name for name in NAMES if name != "cut-off"])
def test_reads_as_a_whole_run(name: str) -> None:
    run = read(LOGS / f"{name}.mcap")
    assert run.complete
    assert run.outcome is not None
    assert run.outcome.status == "done"


def test_configuration_a_holds_what_the_robot_said_and_the_others_are_small() -> None:
    for name in NAMES:
        if name.startswith("spot-home"):
            with (LOGS / f"{name}.mcap").open("rb") as stream:
                summary = make_reader(stream).get_summary()
            assert summary is not None
            topics = {channel.topic for channel in summary.channels.values()}
            assert {"/camera/frontleft_fisheye", "/robot/pose", "/tf", "/map", "/search/plan"} <= topics
            assert ("/spot/robot_state" in topics) == ("/spot/image/frontleft_depth" in topics) == ("-A" in name)


@pytest.mark.slow
@pytest.mark.parametrize("name", [name for name in NAMES if name.startswith("spot-home")])
def test_a_robots_log_replays_to_the_same_decisions(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["replay", str(LOGS / f"{name}.mcap"), "--verify"]) == 0
    assert "the same" in "".join(capsys.readouterr())


def test_the_cut_one_is_salvaged(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["doctor", str(LOGS / "cut-off.mcap")]) == 3
    assert not read(LOGS / "cut-off.mcap").complete
    saved = tmp_path / "saved.mcap"
    assert cli.run(["recover", str(LOGS / "cut-off.mcap"), "-o", str(saved)]) in (0, 3)
    whole, kept = _repeatable(LOGS / "deliver-3.mcap"), _repeatable(saved)
    assert kept
    assert set(kept) <= set(whole)
    capsys.readouterr()
