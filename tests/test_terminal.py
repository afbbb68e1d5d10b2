"""Tables: readable in 80 columns, no name broken, whole with --wide and in pipes; CSV; signed percentages."""

from __future__ import annotations

import re
from typing import Any

import pytest

from workbench import cli
from workbench.terminal import emit_table, signed_percentage, wide_tables

ROW: dict[str, Any] = {
    "strategy": "conditioned-lios-per-find",
    "status": "not-reproduced",
    "lower": 1234.5,
    "upper": 1234.5,
    "bounds": "lower and upper: outer",
    "estimate": 1234.5,
    "file": "replays/23ca32839c89-f7aeeb07/conditioned-lios.replay.mcap",
    "not opened": "DiningTable|12|12",
}


@pytest.fixture
def terminal(monkeypatch: pytest.MonkeyPatch) -> pytest.MonkeyPatch:
    monkeypatch.setenv("COLUMNS", "80")
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setenv("NO_COLOR", "1")
    monkeypatch.delenv("TERM", raising=False)
    return monkeypatch


def test_in_80_columns_names_and_numbers_are_whole(
    terminal: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    emit_table([ROW], minor=("bounds",))
    out, err = capsys.readouterr()
    out = re.sub(r"\x1b\[[0-9;]*m", "", out)
    assert max(len(line.rstrip()) for line in out.splitlines()) <= 80
    for whole in ("conditioned-lios-per-find", "not-reproduced", "1234.50"):
        assert whole in out
    assert "bounds" not in out
    assert "bounds" in err
    assert "--wide shows every column" in err


@pytest.mark.parametrize("title", ["24 houses", "a [b] of " + "many words " * 15 + "end"])
def test_the_title_is_one_line_without_trailing_blanks(title: str, capsys: pytest.CaptureFixture[str]) -> None:
    emit_table([ROW], title=title)
    lines = capsys.readouterr().out.splitlines()
    assert lines[0] == title
    assert [line for line in lines if line != line.rstrip()] == []


def test_wide_leaves_nothing_out(terminal: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    with wide_tables():
        emit_table([ROW])
    out, err = capsys.readouterr()
    assert err == ""
    assert all(heading in "".join(out.split()) for heading in ("strategy", "estimate", "file"))


def test_wide_is_taken_anywhere_on_the_line(terminal: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    terminal.setenv("COLUMNS", "40")
    shown: list[str] = []
    for line in (["solvers"], ["--wide", "solvers"], ["solvers", "--wide"]):
        with pytest.raises(SystemExit) as ended:
            cli.main(line)
        assert ended.value.code == 0
        shown.append(capsys.readouterr().out)
    assert shown[1] == shown[2]


def test_a_path_is_broken_after_a_slash_only(
    terminal: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    terminal.setenv("COLUMNS", "50")
    emit_table([{"file": ROW["file"], "status": "done"}])
    words = capsys.readouterr().out.split()
    assert "conditioned-lios.replay.mcap" in words
    assert "replays/" in words or "replays/23ca32839c89-f7aeeb07/" in words


def test_in_a_pipe_nothing_is_broken_or_left_out(capsys: pytest.CaptureFixture[str]) -> None:
    emit_table([ROW | {f"more {n}": f"x{n}" * 30 for n in range(5)}])
    out = capsys.readouterr().out
    assert "x4" * 30 in out
    assert ROW["file"] in out


@pytest.mark.parametrize(("share", "words"), [(0.137, "+13.7 %"), (-0.055, "-5.5 %"), (0.0, "+0.0 %"), (None, None)])
def test_shares_read_as_signed_percentages(share: float | None, words: str | None) -> None:
    assert signed_percentage(share) == words
