"""Task trials are paired, the same for any number of workers, and resume where they were stopped."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from workbench.cli import run
from workbench.errors import InputError
from workbench.evaluation.tasks.experiment import (
    TaskRequest,
    plan_trials,
    remaining_units,
    scenario_list,
    strategy_list,
    wanted_rows,
)
from workbench.evaluation.tasks.rows import TaskRow, read_rows
from workbench.evaluation.tasks.store import TrialStore
from workbench.evaluation.tasks.table import markdown, pairs, table
from workbench.evaluation.tasks.trials import trial_seed
from workbench.evaluation.tasks.workers import run_unit, run_units
from workbench.worlds.shipped import shipped_houses


def request(**changes: object) -> TaskRequest:
    values: dict[str, object] = {
        "houses": str(shipped_houses()),
        "split": "test",
        "scenarios": ("any-of-three",),
        "strategies": ("model-lios", "oracle"),
        "trials": 3,
        "seed": 4,
        "estimator": "counts",
        "paper_estimator": "counts",
    }
    return TaskRequest(**{**values, **changes})  # type: ignore[arg-type]


@pytest.fixture(scope="module")
def rows() -> list[TaskRow]:
    asked = request()
    planned = plan_trials(asked)
    done = [row for unit in remaining_units(asked, planned.keys, [], None) for row in run_unit(unit)]
    return wanted_rows(asked, planned.keys, done)


def plain(row: TaskRow) -> TaskRow:
    """Without what the clock says."""
    return msgspec.structs.replace(row, belief_s=(), planning_s=())


def test_every_trial_succeeds_and_the_oracle_costs_least(rows: list[TaskRow]) -> None:
    assert [row.strategy for row in rows] == ["model-lios", "oracle"] * 3
    assert all(row.success and row.status == "done" for row in rows)
    for mine, oracle in zip(rows[::2], rows[1::2], strict=True):
        assert mine.trial == oracle.trial
        assert oracle.cost <= mine.cost + 1e-6


@pytest.mark.slow
def test_the_same_numbers_with_two_workers(rows: list[TaskRow]) -> None:
    asked = request()
    planned = plan_trials(asked)
    units = remaining_units(asked, planned.keys, [], None)
    done = [row for some in run_units(units, workers=2) for row in some]
    assert [plain(r) for r in wanted_rows(asked, planned.keys, done)] == [plain(r) for r in rows]


def test_a_stopped_evaluation_goes_on(tmp_path: Path, rows: list[TaskRow]) -> None:
    asked = request()
    planned = plan_trials(asked)
    store = TrialStore(tmp_path, asked)
    store.add(rows[:3])
    store.close()
    with (tmp_path / "trials.jsonl").open("ab") as stream:
        stream.write(b'{"scenario": "any-of-thr')  # killed while writing
    again = TrialStore(tmp_path, asked)
    left = remaining_units(asked, planned.keys, again.rows, None)
    assert [[name for name, _ in unit.strategies] for unit in left] == [["oracle"], ["model-lios", "oracle"]]
    for unit in left:
        again.add(run_unit(unit))
    again.close()
    stored = wanted_rows(asked, planned.keys, read_rows(tmp_path / "trials.jsonl"))
    assert [plain(r) for r in stored] == [plain(r) for r in rows]


def test_a_disk_that_is_full_when_an_evaluation_goes_on_costs_no_trial(
    tmp_path: Path, rows: list[TaskRow], monkeypatch: pytest.MonkeyPatch
) -> None:
    store = TrialStore(tmp_path, request())
    store.add(rows[:3])
    store.close()
    before = (tmp_path / "trials.jsonl").read_bytes()
    write = Path.write_bytes

    def full(path: Path, data: bytes) -> int:
        if path.name.startswith(".trials"):
            raise OSError(28, "No space left on device")
        return write(path, data)

    monkeypatch.setattr(Path, "write_bytes", full)
    with pytest.raises(OSError, match="No space"):
        TrialStore(tmp_path, request())
    assert (tmp_path / "trials.jsonl").read_bytes() == before


def test_another_evaluation_is_not_mixed_in(tmp_path: Path, rows: list[TaskRow]) -> None:
    store = TrialStore(tmp_path, request())
    store.add(rows[:1])
    store.close()
    with pytest.raises(InputError, match="its seed is 4, not 5"):
        TrialStore(tmp_path, request(seed=5))


def test_table_and_pairs_by_hand(rows: list[TaskRow]) -> None:
    made = [
        msgspec.structs.replace(row, cost=cost, strategy=name, trial=trial, house=f"h{trial}")
        for trial, (a, b) in enumerate([(10.0, 8.0), (20.0, 20.0), (30.0, 14.0)])
        for row, name, cost in ((rows[0], "model-lios", a), (rows[0], "conditioned-lios", b))
    ]
    lines = {line["strategy"]: line for line in table(made)}
    assert lines["model-lios"]["mean_cost"] == 20
    assert lines["conditioned-lios"]["mean_cost"] == 14
    assert lines["conditioned-lios"]["wins"] == 1
    assert lines["model-lios"]["wins"] == pytest.approx(1 / 3)
    (pair,) = pairs(made)
    assert (pair["a"], pair["b"]) == ("conditioned-lios", "model-lios")
    assert pair["difference"] == -6
    assert pair["share"] == pytest.approx(-0.3)
    assert (pair["a_wins"], pair["b_wins"]) == (pytest.approx(2 / 3), 0)
    assert "ModelLIOS | 20.0" in markdown(list(lines.values()))


def test_names() -> None:
    assert scenario_list("all")[0] == "deliver-3"
    assert strategy_list("paper")[-1] == "oracle"
    assert strategy_list("ModelLIOS,model-lios@sas-lmcut") == ("model-lios", "model-lios@sas-lmcut", "oracle")
    with pytest.raises(InputError):
        strategy_list("nobody")


def test_seeds_differ_by_scenario_and_trial() -> None:
    assert len({trial_seed(s, t, 0) for s in ("deliver-3", "coffee") for t in range(50)}) == 100


def test_a_strategy_that_raises_is_a_row(rows: list[TaskRow]) -> None:
    asked = request(strategies=(f"{__name__}:Raises",), trials=1)
    unit = remaining_units(asked, plan_trials(asked).keys, [], None)[0]
    (row,) = run_unit(unit)
    assert not row.success
    assert row.cost == 100
    assert (row.status, row.reason) == ("planner-failed", "it raised ValueError: no idea")


class Raises:
    name = "raises"

    def relevant_types(self, task: object) -> tuple[str, ...]:
        return ()

    def decide(self, view: object) -> object:
        raise ValueError("no idea")


def test_the_command_answers_in_json(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = "evaluate tasks --scenarios any-of-three -s model-lios -n 2 --estimator counts --paper-estimator counts"
    code = run([*words.split(), "--record", "-o", str(tmp_path / "out"), "--json"])
    captured = capsys.readouterr()
    assert code == 0, captured.err
    answer = msgspec.json.decode(captured.out)
    assert {row["strategy"] for row in answer["rows"]} == {"model-lios", "oracle"}
    assert all(row["success_rate"] == 1 for row in answer["rows"])
    assert len(list((tmp_path / "out" / "logs" / "any-of-three").glob("*.mcap"))) == 4
    assert run(["report", str(tmp_path / "out"), "--json"]) == 0
    page = (tmp_path / "out" / "report.html").read_text()
    assert "Any-of-Three" in page
    assert "ModelLIOS" in page
    assert page.count("<figure>") >= 4
    capsys.readouterr()
    log = sorted((tmp_path / "out" / "logs" / "any-of-three").glob("*model*.mcap"))[0]
    assert run(["plan", str(log), "--decision", "1", "--json"]) == 0
    planned = msgspec.json.decode(capsys.readouterr().out)
    assert planned["status"] == "solved"
    assert planned["steps"]
    assert run(["plan", str(log), "-o", str(tmp_path / "problem")]) == 0
    assert "(:action find" in (tmp_path / "problem" / "domain.pddl").read_text()
    assert run(["plan", str(log), "--decision", "999"]) == 2


def test_bad_requests_are_one_line(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    assert run(["evaluate", "tasks", "--scenarios", "brunch"]) == 2
    assert run(["evaluate", "tasks", "--record"]) == 2
    assert run(["evaluate", "tasks", "--trials", "0"]) == 2
    assert run(["report", str(tmp_path)]) == 2
    assert capsys.readouterr().err.count("lios:") == 4


def test_no_two_trials_share_a_log(tmp_path: Path) -> None:
    """Scenario files of one name in two folders, and strategies that differ before a slash."""
    from recorders.task_trials import log_path

    scenarios = ("deliver-3", "a/tea.yaml", "b/tea.yaml", "tea.yaml", f"{'x' * 300}.yaml")
    planner = "command:/opt/planner {domain} {problem} {plan}"
    strategies = ("lios", f"model-lios@{planner}", f"opt-greedy@{planner}", "my.module:Planner", "my.module-Planner")
    paths = [log_path(tmp_path, s, 0, n) for s in scenarios for n in strategies]
    assert len(set(paths)) == len(paths)
    for path in paths:
        path.parent.mkdir(exist_ok=True)
        path.touch()
    assert log_path(tmp_path, "breakfast+coffee", 3, "model-lios").name == "0003-model-lios.mcap"


def test_a_log_stands_where_its_row_says(tmp_path: Path) -> None:
    """A plug-in calls itself one thing and is asked for by another name."""
    from recorders.task_trials import TrialRecorder, log_path

    named = f"{__name__}:Raises"
    asked = request(strategies=(named,), trials=1)
    unit = remaining_units(asked, plan_trials(asked).keys, [], TrialRecorder(folder=tmp_path))[0]
    (row,) = run_unit(unit)
    assert log_path(tmp_path, row.scenario, row.trial, row.strategy).exists()


WORDS = ["evaluate", "tasks", "--scenarios", "any-of-three", "-s", "model-lios", "-n", "2"]
WORDS += ["--paper-estimator", "counts", "--estimator"]


def test_a_mistyped_estimator_leaves_nothing_in_the_way(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = ["-o", str(tmp_path / "out")]
    assert run([*WORDS, "cuonts", *out]) == 2
    assert "Did you mean: counts" in capsys.readouterr().err
    assert not (tmp_path / "out").exists()
    assert run([*WORDS, "counts", *out]) == 0
    capsys.readouterr()


@pytest.mark.ci
def test_recording_runs_again_what_has_no_log(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    before, after = (
        run([*WORDS, "counts", "-o", str(out), "--json", *more]) or msgspec.json.decode(capsys.readouterr().out)
        for more in ([], ["--record"])
    )
    logs = list((out / "logs" / "any-of-three").glob("*.mcap"))
    assert len(logs) == 4
    costs = [
        [(row["strategy"], row["mean_cost"], row["trials"]) for row in answer["rows"]] for answer in (before, after)
    ]
    assert costs[0] == costs[1]
    assert costs[0][0][2] == 2
    first = logs[0].stat().st_mtime_ns
    logs[1].unlink()
    assert run([*WORDS, "counts", "-o", str(out), "--record"]) == 0
    assert "3 runs are done already; 1 are left" in capsys.readouterr().err
    assert logs[1].exists()
    assert logs[0].stat().st_mtime_ns == first
    assert len(read_rows(out / "trials.jsonl")) == 4, "of a trial that was run again the last row"


def test_two_evaluations_do_not_write_to_one_folder(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with TrialStore(tmp_path, request()):
        assert run([*WORDS, "counts", "--seed", "4", "-o", str(tmp_path)]) == 2
    assert "is being written by another evaluation" in capsys.readouterr().err.replace("\n", " ")
    with TrialStore(tmp_path, request()) as store:
        assert store.rows == []


@pytest.mark.ci
def test_houses_that_support_nothing_are_no_empty_table(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    out = tmp_path / "out"
    assert run(["evaluate", "tasks", "--scenarios", "deliver-60", "-s", "model-lios", "-o", str(out)]) == 2
    said = " ".join(capsys.readouterr().err.split())
    assert "no house of" in said
    assert "supports deliver-60" in said
    assert not out.exists()


def test_a_table_says_why_runs_failed(capsys: pytest.CaptureFixture[str]) -> None:
    words = ["evaluate", "tasks", "--scenarios", "any-of-three", "-s", f"{__name__}:Raises", "-n", "2"]
    assert run([*words, "--estimator", "counts"]) == 0
    said = " ".join(capsys.readouterr().err.split())
    assert f"{__name__}:Raises failed in 2 runs, 2 for this reason:" in said
    assert "it raised ValueError: no idea" in said
    assert "oracle failed" not in said
