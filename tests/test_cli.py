"""The edge of the command line: exit codes, one-line errors, help that lists every command."""

from __future__ import annotations

import re
import threading
import time
from collections.abc import Callable
from importlib.metadata import entry_points
from pathlib import Path

import pytest

from workbench import cli, terminal
from workbench.errors import BadValue, Failed, LiosError, UnknownName
from workbench.terminal import counted, emit_table, patience, say, wide_tables


def _entries() -> list[str]:
    return sorted(entry.name for entry in entry_points(group="lios.commands"))


@pytest.mark.parametrize("name", _entries())
def test_every_command_loads_and_explains_itself(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run([*name.split("."), "--help"]) == 0
    shown = capsys.readouterr().out
    assert "cannot be loaded" not in shown
    assert "Examples:" in shown, "help without an example"
    assert f"lios {name.replace('.', ' ')}" in shown


def test_long_work_is_told_on_a_terminal_only(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    with patience("still at work", after_s=0.0):
        time.sleep(0.05)
    assert capsys.readouterr().err == ""
    monkeypatch.setenv("FORCE_COLOR", "1")
    said = threading.Event()
    monkeypatch.setattr(terminal, "say", lambda words: (say(words), said.set()))
    with patience("still at work", after_s=0.0):
        assert said.wait(60)
    assert "still at work" in capsys.readouterr().err
    with patience("still at work", after_s=60.0):
        pass
    assert capsys.readouterr().err == ""


def on_a_terminal(columns: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> list[str]:
    """A table as a terminal of so many columns shows it."""
    monkeypatch.setenv("COLUMNS", str(columns))
    monkeypatch.setenv("TTY_COMPATIBLE", "1")
    monkeypatch.setenv("NO_COLOR", "1")
    rows = [
        {"strategy": "conditioned-lios", "status": "undetermined", "bounds": "both sides reached", "upper": 1234.5},
        {"strategy": "lios", "status": "done", "bounds": "exact", "upper": 2.0},
    ]
    with wide_tables():
        emit_table(rows)
    shown = re.sub(r"\x1b\[[0-9;]*m", "", capsys.readouterr().out)
    return [line.rstrip() for line in shown.splitlines()]


def test_a_table_that_fits_has_rules(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> None:
    assert "│ conditioned-lios │ undetermined │ both sides reached │ 1234.50 │" in on_a_terminal(
        100, monkeypatch, capsys
    )


@pytest.mark.parametrize("columns", [64, 56, 48, 40, 30])
def test_nothing_of_a_table_is_cut_off_on_a_narrow_terminal(
    columns: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    lines = on_a_terminal(columns, monkeypatch, capsys)
    assert max(map(len, lines)) <= columns
    everything = "".join("".join(lines).split())
    assert "…" not in everything
    assert sum(line.count("1234.50") for line in lines) == 1, "a number is never broken"
    if columns >= 56:
        assert "undetermined" in everything


def test_help_groups_commands(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["--help"]) == 0
    shown = capsys.readouterr().out
    for panel, names in cli.PANELS.items():
        assert f"{panel}:" in shown
        for name in names:
            assert f"  {name}" in shown


@pytest.mark.parametrize("group", sorted(cli.ORDER_WITHIN))
def test_a_group_lists_its_commands_in_the_order_of_use(group: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert {name.partition(".")[2] for name in _entries() if name.startswith(f"{group}.")} == set(
        cli.ORDER_WITHIN[group]
    )
    assert cli.run([group, "--help"]) == 0
    shown = capsys.readouterr().out.partition("Commands:")[2]
    places = [shown.index(f"\n  {name} ") for name in cli.ORDER_WITHIN[group]]
    assert places == sorted(places)


@pytest.mark.parametrize("words", [["record", "-h"], ["help", "record"], ["help", "evaluate", "search"], ["help"]])
def test_help_is_found_where_people_look(words: list[str], capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(words) == 0
    named = " ".join(word for word in words if word not in ("help", "-h"))
    assert capsys.readouterr().out.startswith(f"Usage: lios {named}".rstrip())


def test_a_misspelt_command_names_the_nearest(capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["repaly"]) == 2
    said = capsys.readouterr().err
    assert "replay" in said
    assert said.count("\n") == 1


@pytest.mark.parametrize(
    ("error", "code"),
    [
        (BadValue("cost", -1, "at least 0"), 2),
        (UnknownName("strategy", "gredy", ["greedy", "lios"]), 2),
        (Failed("it failed"), 1),
        (RuntimeError("a bug"), 1),
        (OSError(28, "No space left on device", "run.mcap"), 2),
        (OSError(28, "No space left on device"), 1),
        (OSError(2, "No such file or directory", "none/x"), 2),
        (OSError(13, "Permission denied", "theirs/out"), 2),
        (OSError(30, "Read-only file system", "mounted/out"), 2),
        (KeyboardInterrupt(), 1),
    ],
)
def test_errors_become_one_line_and_an_exit_code(
    error: BaseException, code: int, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    class Broken:
        def main(self, **_: object) -> None:
            raise error

    monkeypatch.setattr(cli, "app", Broken)
    assert cli.run(["anything"]) == code
    said = capsys.readouterr().err
    assert said.count("\n") == 1
    assert "Traceback" not in said


def test_debug_shows_the_traceback(monkeypatch: pytest.MonkeyPatch) -> None:
    class Broken:
        def main(self, **_: object) -> None:
            raise Failed("it failed")

    monkeypatch.setattr(cli, "app", Broken)
    with pytest.raises(LiosError):
        cli.run(["anything"], debug=True)


def test_an_unknown_name_lists_the_nearest_and_stays_short() -> None:
    message = str(UnknownName("item type", "mugg", ["Mug", "Bread", "Bed"], where="toy"))
    assert message == "no item type 'mugg' in toy. Did you mean: Mug."
    assert len(str(UnknownName("item type", "x" * 10_000, ["Mug"]))) < 200


def test_what_is_said_is_said_as_it_is(capsys: pytest.CaptureFixture[str]) -> None:
    """An address such as houses:-1: is no emoji, and [red] no colour."""
    emit_table([{"house": "houses:-1: [red]x", "cost": 1.0}])
    say("broken:X: houses:-1: [red]x[/red]")
    told = capsys.readouterr()
    assert "houses:-1: [red]x" in told.out
    assert told.err == "broken:X: houses:-1: [red]x[/red]\n"


def test_the_help_of_a_group_shows_its_commands_together(capsys: pytest.CaptureFixture[str]) -> None:
    """evaluate replay is no neighbour of replay."""
    for group in ("evaluate", "houses", "spot"):
        assert cli.run([group, "--help"]) == 0
        shown = capsys.readouterr().out
        assert "Commands:" in shown
        assert not any(f"{panel}:" in shown for panel in cli.PANELS)


def test_a_file_where_a_folder_is_needed_is_bad_input(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    (tmp_path / "file").write_text("")

    class Broken:
        def __init__(self, make: Callable[[], object]) -> None:
            self.make = make

        def main(self, **_: object) -> None:
            self.make()

    for make, part in (
        ((tmp_path / "file").mkdir, "it is a file"),
        ((tmp_path / "file" / "below" / "more").mkdir, "file: it is a file"),
        (tmp_path.read_bytes, "it is a folder"),
    ):
        said: list[str] = []
        monkeypatch.setattr(cli, "app", lambda make=make: Broken(make))
        monkeypatch.setattr(cli, "say", said.append)
        assert cli.run(["anything"]) == 2
        assert part in said[0]


def test_things_are_counted_as_people_count() -> None:
    assert [counted(n, "container") for n in (0, 1, 2)] == ["0 containers", "1 container", "2 containers"]
