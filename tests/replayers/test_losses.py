"""Every command that draws on a damaged log says what is missing, in words and in JSON, and ends with 3."""

from __future__ import annotations

import json
from pathlib import Path

import click
import pytest
from damaged_logs import chunks_of, flip

from dashboards.commands.view import view
from replayers.mcap_io.scan import open_log
from replayers.mcap_io.summary import read_index
from replayers.runs.gaps import losses_of_logs
from workbench import cli

LOGS = Path(__file__).parents[2] / "logs"
FOUR = ("find-greedy", "find-lios", "spot-home-A", "spot-home-C")
READABLE = ("messages", "cost", "searches", "status")


def _ended_with_3(arguments: list[str], capsys: pytest.CaptureFixture[str]) -> dict[str, object]:
    """The JSON of a command that ends with 3 and says on standard error what is missing."""
    assert cli.run(arguments) == 3, arguments
    told = capsys.readouterr()
    assert "not whole" in told.err or "not whole" in told.out, arguments
    return json.loads(told.out)


@pytest.mark.parametrize("name", FOUR)
def test_a_damaged_chunk_is_told_by_list_and_export(
    name: str, tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    monkeypatch.setenv("LIOS_CACHE", "off")
    log, damaged = LOGS / f"{name}.mcap", tmp_path / "b.mcap"
    assert cli.run(["list", str(log), "--json"]) == 0
    capsys.readouterr()
    chunks = chunks_of(log)
    for number in (0, len(chunks) // 2, len(chunks) - 1):
        flip(log, damaged, number)
        row = _ended_with_3(["list", str(damaged), "--json"], capsys)["rows"][0]  # pyright: ignore
        assert row["lost"], number
        assert "1 place of the log could not be read" in row["problem"], number
        if not losses_of_logs([damaged]):
            continue  # a chunk of pictures alone: no table of events lost anything
        told = _ended_with_3(
            ["export", str(damaged), "-o", str(tmp_path / "t"), "-t", "runs", "--force", "--json"], capsys
        )
        assert told["lost"] == {str(damaged): row["lost"]}, number


def test_a_damaged_chunk_is_told_by_replay_compare_and_capsule(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    damaged = flip(LOGS / "find-lios.mcap", tmp_path / "b.mcap", 4)
    replays = ["replay", str(damaged), "-s", "opt-greedy,model-lios", "-o", str(tmp_path / "r"), "--json"]
    told = _ended_with_3([*replays, "--worlds", "0"], capsys)
    assert all(row["lost"] for row in told["rows"])  # pyright: ignore
    told = _ended_with_3(["compare", str(tmp_path / "r"), "--json"], capsys)
    ((log, lost),) = told["lost"].items()  # pyright: ignore
    assert Path(log).name == "b.mcap"
    assert "1 place of the log could not be read" in lost[0]
    told = _ended_with_3(["capsule", str(damaged), "-o", str(tmp_path / "b.html"), "--json"], capsys)
    assert told["lost"] == {str(damaged): lost}


@pytest.mark.slow
def test_a_damaged_chunk_is_told_by_render(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    damaged = flip(LOGS / "find-lios.mcap", tmp_path / "b.mcap", 4)
    assert _ended_with_3(["render", str(damaged), "-o", str(tmp_path / "b.png"), "--json"], capsys)["lost"]


def test_view_says_what_is_missing_before_the_address_and_ends_with_3(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    from dashboards.viser_app import serving

    def stop(seconds: float) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(serving.time, "sleep", stop)
    damaged = flip(LOGS / "find-lios.mcap", tmp_path / "b.mcap", 4)
    with pytest.raises(click.exceptions.Exit) as ended:
        view([damaged], port=0)
    assert ended.value.exit_code == 3
    words = capsys.readouterr().err
    assert "not whole" in words
    assert words.index("not whole") < words.index("Dashboard at")


def test_a_filtered_log_is_listed_as_not_whole(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    short = tmp_path / "short.mcap"
    assert cli.run(["log", "filter", str(LOGS / "find-lios.mcap"), "-o", str(short), "-S", "15"]) == 0
    capsys.readouterr()
    (row,) = _ended_with_3(["list", str(short), "--json"], capsys)["rows"]  # pyright: ignore
    assert any("actions" in line and "missing" in line for line in row["lost"])


def test_log_cat_ends_with_3_where_a_chunk_was_dropped(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    log = LOGS / "find-lios.mcap"
    assert cli.run(["log", "cat", str(log), "--json"]) == 0
    whole = capsys.readouterr().out.splitlines()
    damaged = flip(log, tmp_path / "b.mcap", 4)
    assert cli.run(["log", "cat", str(damaged), "--json"]) == 3
    told = capsys.readouterr()
    assert set(told.out.splitlines()) < set(whole)
    assert "Something was lost" in told.err


def test_damage_in_several_runs_of_one_file_is_listed(tmp_path: Path, capsys: pytest.CaptureFixture[str]):
    logs = [str(LOGS / f"{name}.mcap") for name in FOUR[:2]]
    both = tmp_path / "both.mcap"
    assert cli.run(["log", "merge", *logs, "-o", str(both), "--runs"]) == 0
    assert cli.run(["list", str(both), "--json"]) == 0
    capsys.readouterr()
    with open_log(both) as stream:
        assert read_index(stream) is not None
    (row,) = _ended_with_3(["list", str(flip(both, tmp_path / "b.mcap", 2)), "--json"], capsys)["rows"]  # pyright: ignore
    assert row["problem"].startswith("not whole: 1 place")
