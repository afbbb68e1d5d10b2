"""Task trials are paired, the same at any number of workers, and go on where they were stopped."""

from __future__ import annotations

from pathlib import Path

import msgspec
import pytest

from workbench.cli import run
from workbench.errors import InputError
from workbench.evaluation.task_experiment import (
    TaskRequest,
    TrialStore,
    plan_trials,
    run_unit,
    run_units,
    scenario_list,
    strategy_list,
    units_left,
    wanted_rows,
)
from workbench.evaluation.task_rows import TaskRow, read_rows
from workbench.evaluation.task_table import markdown, pairs, table
from workbench.evaluation.task_trials import trial_seed
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
    done = [row for unit in units_left(asked, planned.keys, [], None) for row in run_unit(unit)]
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
    units = units_left(asked, planned.keys, [], None)
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
    left = units_left(asked, planned.keys, again.rows, None)
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
    unit = units_left(asked, plan_trials(asked).keys, [], None)[0]
    (row,) = run_unit(unit)
    assert not row.success
    assert row.cost == 100
    assert (row.status, row.reason) == ("planner-failed", "it raised ValueError: no idea")


def test_the_command_says_which_planner_broke(capsys: pytest.CaptureFixture[str]) -> None:
    words = f"evaluate tasks --scenarios any-of-three -s {__name__}:Raises -n 2 --estimator counts"
    assert run(words.split()) == 0
    said = capsys.readouterr().err
    assert f"{__name__}:Raises broke in 2 of 2 trials: it raised ValueError: no idea\n" in said
    assert "oracle broke" not in said


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
