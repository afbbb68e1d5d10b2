"""Outputs that cannot be written: bad input, one line that names the place, and nothing there is changed."""

from __future__ import annotations

import os
from pathlib import Path

import pytest

from workbench.cli import run as lios
from workbench.errors import CannotCreate, WrongKind
from workbench.files import file_to_replace, target_of, write_atomically, write_text

LOGS = Path(__file__).resolve().parents[1] / "logs"
LOG, OTHER, CUT = (str(LOGS / f"{name}.mcap") for name in ("find-lios", "find-greedy", "cut-off"))
FILES = {
    "record": (["record", "--find", "mug", "--force"], ".mcap"),
    "recover": (["recover", CUT, "--force"], ".mcap"),
    "filter": (["log", "filter", LOG, "--force"], ".mcap"),
    "merge": (["log", "merge", LOG, OTHER, "--force"], ".mcap"),
    "lines": (["log", "convert", LOG, "--force"], ".jsonl"),
    "certify": (["certify", LOG, "-s", "greedy", "--force"], ".zip"),
    "learn-moves": (["learn-moves", LOG, OTHER, "--force"], ".csv"),
    "houses": (["houses", "generate", "-n", "1", "--force"], ".jsonl"),
}
FOLDERS = {
    "plan": ["plan", LOG, "--decision", "1", "--force"],
    "replay": ["replay", LOG, "-s", "greedy", "--worlds", "0"],
    "figures": ["figures", LOG, "--force"],
    "export": ["export", LOG, "--force"],
    "site": ["site", "from-log", str(LOGS / "spot-home-A.mcap")],
    "new": ["new", "planner", "foo", "--force"],
}
QUICK = ("record", "filter", "learn-moves", "plan", "new")
"""Cases of each kind that run in `make test`; the others take longer and run in CI."""


def _marked(name: str) -> object:
    return name if name in QUICK else pytest.param(name, marks=pytest.mark.ci)


@pytest.fixture(autouse=True)
def places(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.chdir(tmp_path)
    Path("afile").write_bytes(b"mine")
    Path("circle").symlink_to("circle")


@pytest.mark.parametrize("place", ["/proc/nobody/x", "afile/x", "circle/x", "n" * 300])
@pytest.mark.parametrize("name", [_marked(name) for name in (*FILES, *FOLDERS)])
def test_a_place_where_nothing_can_be_made_is_bad_input(
    name: str, place: str, capsys: pytest.CaptureFixture[str]
) -> None:
    command, suffix = FILES[name] if name in FILES else (FOLDERS[name], "")
    assert lios([*command, "-o", f"{place}{suffix}"]) == 2
    (line,) = capsys.readouterr().err.splitlines()
    assert line.startswith("lios: ")
    assert any(part in line for part in (place[:100], place.partition("/")[0] or "/proc/nobody")), line
    assert sorted(os.listdir()) == ["afile", "circle"]
    assert Path("afile").read_bytes() == b"mine"


@pytest.mark.parametrize("name", [name for name in FILES if name not in ("record", "houses", "learn-moves")])
def test_a_pipe_is_left_as_it_is(name: str, capsys: pytest.CaptureFixture[str]) -> None:
    command, suffix = FILES[name]
    place = Path(f"pipe{suffix}")
    os.mkfifo(place)
    assert lios([*command, "-o", str(place)]) == 2
    assert "it is a device or a pipe, and no file" in capsys.readouterr().err
    assert place.is_fifo()


def test_a_link_is_followed_by_copies_of_logs(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    (tmp_path / "elsewhere").mkdir()
    Path("link.mcap").symlink_to(tmp_path / "elsewhere" / "run.mcap")
    for _ in range(2):
        assert lios(["log", "filter", LOG, "-o", "link.mcap", "--force"]) == 0
        assert Path("link.mcap").is_symlink()
        assert (tmp_path / "elsewhere" / "run.mcap").stat().st_size > 1000


def test_where_a_draft_may_take_a_place() -> None:
    Path("to-nowhere").symlink_to("later")
    assert target_of(Path("to-nowhere")).name == "later"
    assert file_to_replace(Path("afile")) == Path("afile")
    with pytest.raises(WrongKind):
        file_to_replace(Path())
    for place in ("circle", "/dev/null"):
        with pytest.raises(CannotCreate):
            file_to_replace(Path(place))
    with pytest.raises(OSError, match="symbolic links"):
        write_atomically(Path("circle"), b"")
    assert Path("circle").is_symlink()


@pytest.mark.skipif(not Path("/dev/full").is_char_device(), reason="this system has no full device")
def test_want_of_room_is_told_with_the_name_of_the_file(capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(OSError, match="No space left") as full:
        write_text(Path("/dev/full"), "x")
    assert full.value.filename == "/dev/full"
    assert lios(["learn-moves", LOG, OTHER, "-o", "/dev/full", "--force"]) == 2
    assert capsys.readouterr().err.startswith("lios: /dev/full: No space left on device")
    assert Path("/dev/full").is_char_device()


def test_what_is_there_already_stays_whole_where_only_a_part_is_new(capsys: pytest.CaptureFixture[str]) -> None:
    Path("problem").mkdir()
    Path("problem/plan.json").write_text("mine")
    assert lios(["plan", LOG, "--decision", "1", "-o", "problem"]) == 2
    assert "--force" in capsys.readouterr().err
    assert os.listdir("problem") == ["plan.json"]
