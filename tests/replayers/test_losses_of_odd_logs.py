"""A command over several logs says what is wrong with one of them, and does its work on the others."""

from __future__ import annotations

import json
import shutil
from pathlib import Path
from typing import Any

import pytest

from dashboards.library.same_place import read_together
from replayers.memory.collect import read_history
from workbench import cli
from workbench.errors import LiosError, Malformed

LOGS = Path(__file__).parents[2] / "logs"


@pytest.fixture
def folder(tmp_path: Path) -> Path:
    """A run, and what crashed laptops and cameras leave beside it: no bytes, other bytes, no run."""
    from mcap.writer import Writer

    (tmp_path / "logs").mkdir()
    shutil.copy(LOGS / "find-lios.mcap", tmp_path / "logs" / "m.mcap")
    (tmp_path / "logs" / "a-empty.mcap").touch()
    (tmp_path / "logs" / "z-other.mcap").write_bytes(b"no log at all")
    with open(tmp_path / "logs" / "b-camera.mcap", "wb") as stream:
        writer = Writer(stream)
        writer.start(profile="", library="other")
        writer.add_message(writer.register_channel("/t", "json", 0), 1, b"{}", 1)
        writer.finish()
    return tmp_path / "logs"


def _json(arguments: list[str], capsys: pytest.CaptureFixture[str], *, code: int) -> dict[str, Any]:
    capsys.readouterr()
    assert cli.run([*arguments, "--json"]) == code
    return json.loads(capsys.readouterr().out)


def test_doctor_examines_the_others(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    logs = [str(path) for path in sorted(folder.iterdir())]
    rows = _json(["doctor", *logs, "nowhere.mcap"], capsys, code=2)["rows"]
    assert [row["verdict"] for row in rows] == ["no-log", "fine", "fine", "no-log", "no-log"]
    assert {tuple(row) for row in rows} == {tuple(rows[1])}, "every row has the same fields"
    assert cli.run(["doctor", *logs]) == 2
    told = capsys.readouterr()
    assert "m.mcap: fine, 332 messages" in told.out
    assert "a-empty.mcap: it is empty" in told.err
    assert "z-other.mcap: it is no MCAP file" in told.err


def test_doctor_of_one_file_that_is_no_log_says_so_in_one_line(
    folder: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["doctor", str(folder / "a-empty.mcap"), "--json"]) == 2
    assert capsys.readouterr().out == ""


def test_verify_verifies_the_others_and_ends_with_3(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    answer = _json(["replay", str(folder), "--verify"], capsys, code=3)
    assert [(Path(row["log"]).name, row["same"]) for row in answer["rows"]] == [("m.mcap", True)]
    assert {Path(log).name for log in answer["not_verified"]} == {"a-empty.mcap", "b-camera.mcap", "z-other.mcap"}
    assert cli.run(["replay", str(folder / "a-empty.mcap"), "--verify"]) == 2


@pytest.mark.parametrize(
    "option",
    [
        "--misses=1",
        "--estimator=counts",
        "--output=out",
        "--worlds=0",
        "--seed=3",
        "--look-next",
        "--unique",
        "--with-truth",
        "--memory=logs",
        "--write=best",
        "--upload=s3://bucket/",
        "--in-process",
        "--scheduler=local",
    ],
)
def test_verify_refuses_what_has_no_effect_on_it(option: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert cli.run(["replay", str(LOGS / "find-lios.mcap"), "--verify", option]) == 2
    assert f"{option.partition('=')[0]} is" in capsys.readouterr().err
    assert not Path("out").exists()


def test_what_is_drawn_together_leaves_out_what_is_no_run(folder: Path, capsys: pytest.CaptureFixture[str]) -> None:
    together = read_together([folder])
    assert [t.run.path.name for t in together.timelines] == ["m.mcap"]
    assert {Path(log).name for log in together.left_out} == {"a-empty.mcap", "b-camera.mcap", "z-other.mcap"}
    assert capsys.readouterr().err.count("Left out: ") == 3
    with pytest.raises(LiosError):
        read_together([folder / "m.mcap", folder / "z-other.mcap"])  # named itself: a mistake of the caller
    (folder / "m.mcap").unlink()
    with pytest.raises(Malformed):
        read_together([folder])


def test_capsule_of_a_folder_names_what_it_left_out(
    folder: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    answer = _json(["capsule", str(folder), "-o", str(tmp_path / "c.html")], capsys, code=3)
    assert (answer["runs"], len(answer["left_out"])) == (1, 3)


def test_a_memory_leaves_out_what_is_no_run(folder: Path) -> None:
    history = read_history([folder])
    assert [Path(run.log).name for run in history.runs] == ["m.mcap"]
    assert sum(note.startswith("not remembered: ") for note in history.notes) == 3
    with pytest.raises(LiosError):
        read_history([folder / "m.mcap", folder / "a-empty.mcap"])


@pytest.mark.parametrize("workers", ["1", "2", "4"])
def test_copies_of_a_log_are_replayed_under_their_own_names(
    workers: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    """Their replays are kept in one place, where two processes would write at once."""
    for name in ("1.mcap", "2.mcap"):
        shutil.copy(LOGS / "find-lios.mcap", tmp_path / name)
    shutil.copy(LOGS / "find-greedy.mcap", tmp_path / "0.mcap")
    for name in ("3.mcap", "4.mcap"):
        (tmp_path / name).touch()
    of = ["replay", str(tmp_path), "-s", "opt-greedy,pes-lios", "--worlds", "0", "-j", workers]
    rows = _json([*of, "-o", str(tmp_path / "out")], capsys, code=0)["rows"]
    names = [Path(row["log"]).name for row in rows]
    assert names == ["0.mcap", "0.mcap", "1.mcap", "1.mcap", "2.mcap", "2.mcap", "3.mcap", "4.mcap"]
    assert [row["lower"] for row in rows[2:4]] == [row["lower"] for row in rows[4:6]]
    assert "4.mcap: it is empty" in rows[-1]["reason"]
    whole = [str(tmp_path / f"{n}.mcap") for n in range(3)]
    assert cli.run(["select", *whole, "-s", "opt-greedy,pes-lios", "--worlds", "0", "-j", workers]) == 0
    told = capsys.readouterr()
    assert "2 trials in 1 place" in told.out + told.err
    assert "1.mcap, 2.mcap are of one run and say the same; it counts once" in told.err
    (tmp_path / "1.mcap").rename(tmp_path / "5.mcap")
    again = _json([*of, "-o", str(tmp_path / "out")], capsys, code=0)["rows"]
    assert {Path(row["log"]).name for row in again} == {"0.mcap", "2.mcap", "3.mcap", "4.mcap", "5.mcap"}


def test_compare_says_why_there_is_nothing_to_compare(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = str(tmp_path / "out")
    of = ["replay", str(LOGS / "find-lios.mcap"), "--worlds", "0", "-o", out, "-s"]
    assert cli.run([*of, "opt-greedy"]) == 0
    capsys.readouterr()
    assert cli.run(["compare", out]) == 0
    assert "opt-greedy is the only strategy here" in capsys.readouterr().err
    assert cli.run(["compare", out, "--fail-if", "opt-greedy > pes-lios"]) == 2
    assert "no strategy 'pes-lios' in these replays" in capsys.readouterr().err
