"""replayers.replay, compare, look_next and verify as functions: typed results, the same as the commands'."""

from __future__ import annotations

import csv
import json
from pathlib import Path
from threading import Timer

import pytest
from toy_logs import simulated_log

import replayers
from recorders.mcap_io.file import LogInUse, reopen
from replayers.batch import log_replayer
from replayers.batch.replays import Replays
from workbench import cli
from workbench.errors import FileMissing, UnknownName
from workbench.planning.strategies import StrategyNotLoaded

QUICK = replayers.ReplaySettings(worlds=20)


@pytest.fixture
def log(tmp_path: Path) -> Path:
    return simulated_log(tmp_path / "run.mcap", name="opt-greedy")


def test_rows_are_those_of_the_command(log: Path, capsys: pytest.CaptureFixture[str]) -> None:
    made = replayers.replay(log, ["greedy", "lios"], settings=QUICK)
    assert [row.strategy for row in made] == ["opt-greedy", "model-lios"]
    assert cli.run(["replay", str(log), "-s", "greedy,lios", "--worlds", "20", "--json"]) == 0
    rows = json.loads(capsys.readouterr().out)["rows"]
    assert [row["estimate"] for row in rows] == [o.estimate.mean for o in made if o.estimate]
    assert [row["lower"] for row in rows] == list(made.frame["lower"])
    assert len(made.steps) == sum(len(row.steps) for row in made)


def test_a_run_a_path_and_a_folder_say_the_same(log: Path) -> None:
    by = [replayers.replay(what, "greedy", settings=QUICK) for what in (replayers.read(log), str(log), log.parent)]
    assert len({next(iter(made)).key for made in by}) == 1


def test_comparison_of_results_and_of_their_folder(log: Path, tmp_path: Path) -> None:
    made = replayers.replay(log, "greedy,lios", settings=QUICK, output=tmp_path / "kept")
    (here,), (there,) = replayers.compare(made), replayers.compare(tmp_path / "kept")
    assert (here.a, here.b, here.logs) == ("opt-greedy", "model-lios", 1)
    assert (here.wins, here.least, here.most) == (there.wins, there.least, there.most)


def test_the_next_look_is_one_a_log(log: Path) -> None:
    made = replayers.replay(log, "greedy,lios", settings=QUICK)
    looks = replayers.look_next(made)
    assert len(looks) <= 1
    assert all(look.log == str(log) and look.container == look.value.container for look in looks)


def test_what_cannot_be_replayed_is_in_failed(log: Path) -> None:
    made = replayers.replay(log, ["greedy", "oracle"], settings=QUICK)
    assert [f.strategy for f in made.failed] == ["oracle"]
    assert len(made) == 1


def test_bad_names_are_refused(log: Path, tmp_path: Path) -> None:
    with pytest.raises(UnknownName, match="no strategy"):
        replayers.replay(log, "gready-ish")
    with pytest.raises(StrategyNotLoaded, match="no module not_there"):
        replayers.replay(log, "not_there:Mine")
    with pytest.raises(FileMissing):
        replayers.replay(tmp_path / "none.mcap", "greedy")


@pytest.mark.parametrize(
    "planner",
    [
        "misbehaving:Behaves",
        pytest.param("misbehaving:Raises", marks=pytest.mark.slow),
        pytest.param("misbehaving:CostsNoNumber", marks=pytest.mark.slow),
        pytest.param("misbehaving:peeking", marks=pytest.mark.slow),
    ],
)
def test_in_this_process_and_in_its_own_say_the_same(log: Path, planner: str) -> None:
    def told(in_process: bool, planner: str) -> Replays:
        settings = replayers.ReplaySettings(worlds=20, in_process=in_process)
        return replayers.replay(log, [planner], settings=settings)

    here, apart = next(iter(told(True, planner))), next(iter(told(False, planner)))
    assert (here.status, here.reason, here.key) == (apart.status, apart.reason, apart.key)
    assert here.bounds == apart.bounds


def test_a_module_that_raises_is_told_in_this_process_too(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    (tmp_path / "broken_at_import.py").write_text("raise ValueError('not today')\n")
    monkeypatch.chdir(tmp_path)
    with pytest.raises(StrategyNotLoaded, match="not today"):
        replayers.replay(log, "broken_at_import:Mine", settings=replayers.ReplaySettings(in_process=True))


def test_export_of_one_table_by_the_outputs_name(
    log: Path, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert cli.run(["export", str(log), "-o", str(tmp_path / "x.csv")]) == 0
    assert f"Wrote {tmp_path / 'x.csv'} (CSV)." in capsys.readouterr().err
    with (tmp_path / "x.csv").open() as file:
        (row,) = csv.DictReader(file)
    assert row["strategy"] == "opt-greedy"
    assert cli.run(["export", str(log), "-o", str(tmp_path / "x.csv")]) == 2
    assert cli.run(["export", str(log), "-o", str(tmp_path / "x.csv"), "-t", "actions", "--force"]) == 0
    assert (tmp_path / "x.csv").read_text().count("\n") > 2
    for more in (["-t", "runs", "-t", "actions"], ["--format", "parquet"], ["--partition-by", "place"]):
        assert cli.run(["export", str(log), "-o", str(tmp_path / "y.csv"), *more]) == 2
    assert [p.name for p in tmp_path.iterdir() if "y.csv" in p.name or ".part" in p.name] == []


def test_export_from_python_writes_every_table(log: Path, tmp_path: Path) -> None:
    done = replayers.export([log], tmp_path / "tables")
    assert set(done.rows) == {p.stem for p in (tmp_path / "tables").glob("*.parquet")}
    assert done.rows["runs"] == 1


def test_two_calls_with_one_folder_wait_for_each_other(
    log: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    replayers.replay(log, "greedy", settings=QUICK, output=tmp_path / "kept")
    (recording,) = tmp_path.glob("kept/*/*.replay.mcap")
    before = recording.read_bytes()
    (stored,) = tmp_path.glob("kept/*/*.replay.json")
    stored.unlink()
    other = reopen(recording, size=None)  # as another call that writes it at this time
    monkeypatch.setattr(log_replayer, "WRITER_PATIENCE_S", 0.0)
    with pytest.raises(LogInUse):
        replayers.replay(log, "greedy", settings=QUICK, output=tmp_path / "kept")
    monkeypatch.setattr(log_replayer, "WRITER_PATIENCE_S", 60.0)
    done = Timer(0.3, other.close)
    done.start()
    replayers.replay(log, "greedy", settings=QUICK, output=tmp_path / "kept")
    done.join()
    assert stored.exists()
    assert len(recording.read_bytes()) == len(before)
