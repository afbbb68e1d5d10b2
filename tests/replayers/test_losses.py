"""Every command that draws on a damaged log says what is missing, in words and in JSON, and ends with 3."""

from __future__ import annotations

import json
from collections.abc import Sequence
from pathlib import Path
from typing import Any

import click
import pytest
from damaged_logs import chunks_of, flip
from mcap.opcode import Opcode

from dashboards.commands.view import view
from replayers.mcap_io.records import HEAD
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
        if not losses_of_logs([damaged]).lost:
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


def _cuts(data: bytes, numbers: Sequence[int]) -> list[tuple[int, int | None]]:
    """Lengths at which a log may have been cut off, before, inside and at the end of each kind of its records, with
    the opcode of the record that is torn, if any; -1 for those after the end of the data.

    Of each kind the records of some numbers are taken, counted from 1."""
    cuts: list[tuple[int, int | None]] = []
    seen: dict[int, int] = {}
    at, ended = 8, False
    while at < len(data) - 8:
        opcode, length = HEAD.unpack_from(data, at)
        end = at + HEAD.size + length
        seen[opcode] = seen.get(opcode, 0) + 1
        if seen[opcode] in numbers:
            cuts += [(cut, -1 if ended else None if cut == at else opcode) for cut in (at, at + 5, end - 2)]
        at, ended = end, ended or opcode == Opcode.DATA_END
    return [*cuts, (at, -1), (at + 4, -1)]


@pytest.mark.parametrize(
    ("name", "numbers"),
    [
        pytest.param("find-lios", (1,), marks=pytest.mark.ci),
        pytest.param("find-lios", (2, 3, 9), marks=pytest.mark.slow),
        pytest.param("spot-home-A", (1, 2, 5), marks=pytest.mark.slow),
    ],
)
def test_all_commands_agree_on_a_log_that_was_cut_off_anywhere(
    name: str,
    numbers: Sequence[int],
    tmp_path: Path,
    capsys: pytest.CaptureFixture[str],
    monkeypatch: pytest.MonkeyPatch,
):
    """They end with 3 where a record had to be dropped; the doctor also where only the end is missing."""
    monkeypatch.setenv("LIOS_CACHE", "off")
    whole, log, saved = (LOGS / f"{name}.mcap").read_bytes(), tmp_path / "cut.mcap", tmp_path / "saved.mcap"

    def told(*words: str) -> tuple[int, dict[str, Any]]:
        code = cli.run([*words, "--json"])
        out = capsys.readouterr().out
        return code, json.loads(out) if out.startswith("{") and words[0] != "log" else {}

    for cut, torn in _cuts(whole, numbers):
        log.write_bytes(whole[:cut])
        dropped, ended = torn in (Opcode.CHUNK, Opcode.ATTACHMENT, Opcode.METADATA), torn == -1
        code, recovered = told("recover", str(log), "-o", str(saved), "--force")
        assert (code, recovered["lossy"]) == ((3, True) if dropped else (0, False)), (cut, torn)
        assert recovered["end_missing"] is not ended, (cut, torn)
        for one in (log, saved):
            code, found = told("doctor", str(one))
            assert (code, found["verdict"]) == ((0, "fine") if ended else (3, "lossy")), (cut, torn, one)
        for copy in (["cat"], ["filter", "-o", str(saved), "--force"], ["convert", "-o", str(saved), "--force"]):
            assert told("log", copy[0], str(log), *copy[1:])[0] == (3 if dropped else 0), (cut, torn, copy)
        assert told("info", str(log))[0] == (3 if dropped else 0), (cut, torn)
        code, listed = told("list", str(log))
        (row,) = listed["rows"]
        lacks = bool(row["run_id"]) and recovered["attachments"] < 3
        assert (code, bool(row["lost"])) == ((3, True) if dropped or lacks else (0, False)), (cut, torn, row)
        assert (row["cut_off"], bool(row["problem"])) == (not ended, not ended), (cut, torn, row)
        code, exported = told("export", str(log), "-o", str(tmp_path / "t"), "-t", "runs", "--force")
        assert code == (2 if not row["run_id"] else 3 if dropped or lacks else 0), (cut, torn)
        if row["run_id"]:
            assert exported["cut_off"] == ([] if ended else [str(log)]), (cut, torn)
            assert exported["lost"] == ({str(log): row["lost"]} if row["lost"] else {}), (cut, torn)


@pytest.mark.parametrize(("size", "code"), [(6328, 2), (60_000, 3), (88_655, 0)])
def test_replay_figures_and_capsule_of_a_cut_log_end_as_list_and_export_do(
    size: int, code: int, tmp_path: Path, capsys: pytest.CaptureFixture[str]
):
    """With 2 where there is no run to replay or to draw: what was cut is the place, the task or the settings."""
    log = tmp_path / "cut.mcap"
    log.write_bytes((LOGS / "find-lios.mcap").read_bytes()[:size])
    for words in (
        ["replay", str(log), "-s", "opt-greedy", "--worlds", "0"],
        ["figures", str(log), "-o", str(tmp_path / "figures"), "--format", "png"],
        ["capsule", str(log), "-o", str(tmp_path / "run.html")],
    ):
        assert cli.run(words) == code, words
        told = capsys.readouterr().err
        assert ("not whole" in told) is (code == 3), (words, told)
        assert ("cut off" in told) is (code == 3), (words, told)


def test_a_missing_end_is_told_and_ends_with_0(
    tmp_path: Path, capsys: pytest.CaptureFixture[str], monkeypatch: pytest.MonkeyPatch
):
    """Nothing had to be dropped of a log that was cut off between two records."""
    monkeypatch.chdir(tmp_path)  # a long path would break the words of a table
    log, chunk = Path("cut.mcap"), chunks_of(LOGS / "find-lios.mcap")[9]
    end = chunk.chunk_start_offset + chunk.chunk_length + chunk.message_index_length
    log.write_bytes((LOGS / "find-lios.mcap").read_bytes()[:end])
    for words in (
        ["export", str(log), "-o", str(tmp_path / "runs.csv")],
        ["capsule", str(log), "-o", str(tmp_path / "run.html")],
        ["replay", str(log), "-s", "opt-greedy", "--worlds", "0"],
        ["list", str(log)],
    ):
        assert cli.run(words) == 0, words
        told = capsys.readouterr()
        assert "cut off" in told.err + told.out, words
