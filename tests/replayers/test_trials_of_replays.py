"""The figures of `lios evaluate replay`, by hand; and its choice of tasks."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path
from typing import Any

import pytest

from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.durations import Durations
from replayers.counterfactual.prepared_log import ReplaySettings
from replayers.evaluation import trials
from replayers.evaluation.metrics import summary
from replayers.evaluation.trials import (
    Counterfactual,
    MeasurementSettings,
    ReplayTask,
    SkippedTask,
    counterfactuals,
    tasks_for,
)
from workbench.cli import run as lios
from workbench.errors import BadValue
from workbench.execution.events import ActionEnded
from workbench.planning.plans import PlanStep
from workbench.worlds.house import START
from workbench.worlds.shipped import shipped_houses


def counted(
    lower: float, upper: float, true: float, *, pit: tuple[float, float], mass: float, house: str = "h"
) -> Counterfactual:
    return Counterfactual(
        estimator="counts", house=house, scenario="find", seed=0, recorded="a", strategy="b",
        true_cost=true, true_status="done",
        status="undetermined", lower=lower, upper=upper, lower_proof="exact", upper_proof="exact", complete=True,
        estimate=(lower + upper) / 2, interval=(lower, upper - 1), pit=pit, mass=mass,
        lower_if_beliefs_stand=lower, upper_if_beliefs_stand=upper, open=3, stretches=5,
    )  # fmt: skip


def test_by_hand_coverage_is_over_what_is_not_exact() -> None:
    """Two of three are not exact: one truth in the closed interval, one beyond its end but within the bounds."""
    found = [
        counted(10, 10, 10, pit=(0.0, 1.0), mass=1.0),
        counted(10, 20, 12, pit=(0.0, 0.5), mass=0.96),
        counted(10, 20, 20, pit=(1.0, 1.0), mass=0.92),
    ]
    answer = summary(found)
    assert answer["inside_bounds"] == 1.0
    assert answer["exact"] == pytest.approx(1 / 3)
    assert answer["interval_coverage"] == pytest.approx(0.45)
    assert answer["interval_coverage_closed"] == 0.5
    assert answer["interval_mass"] == pytest.approx(0.94)
    assert answer["pit"] == pytest.approx((0.1, 0.1, 0.1, 0.1, 0.1, 0.0, 0.0, 0.0, 0.0, 0.5))
    assert answer["pit_distance"] == pytest.approx(0.49)
    assert answer["not_exact"] == 2
    outside = summary([*found, counted(10, 20, 21, pit=(1.0, 1.0), mass=0.9)])
    assert outside["inside_bounds"] == 0.75


def test_the_interval_of_coverage_draws_whole_houses() -> None:
    """All of one house covered, none of the other: one house says nothing of how houses vary, two say all is open."""
    found = [counted(1, 2, 1, pit=(0.4, 0.6), mass=1.0, house="a") for _ in range(5)]
    found += [counted(1, 2, 1, pit=(0.0, 0.01), mass=1.0, house="b") for _ in range(5)]
    answer = summary(found)
    assert answer["interval_coverage"] == 0.5
    assert answer["interval_coverage_ci95"] == (0.0, 1.0)
    assert summary([])["interval_coverage_ci95"] is None


def test_houses_that_cannot_support_a_scenario_are_passed_over() -> None:
    """Some of the shipped houses have no coffee machine, kettle or pot."""
    tasks = tasks_for(None, "all", ("coffee",), count=12, per_task=2, seed=0)
    assert len(tasks) == 6
    assert {place.scenario for place in tasks} == {"coffee"}
    with pytest.raises(BadValue, match="scenarios"):
        tasks_for(None, "all", (), count=12, per_task=2, seed=0)


@pytest.mark.slow
def test_the_command_measures_cooking(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    arguments = ["--scenarios", "breakfast", "-n", "2", "-s", "opt-greedy,model-lios", "--budget", "20"]
    arguments += ["--estimator", "counts"]
    assert lios(["evaluate", "replay", *arguments, "--worlds", "20", "--json", "-o", str(tmp_path / "c.csv")]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["counterfactuals"] == 2
    assert answer["inside_bounds"] == 1.0
    assert "lower_if_beliefs_stand" in (tmp_path / "c.csv").read_text()


def test_by_hand_the_spread_of_a_predicted_duration() -> None:
    """Two moves that err by 3 s and a look that errs by 4 s, each on its own: the root of 9 + 9 + 16."""
    counted = dict.fromkeys(("move", "look", "manipulation"), 2)
    durations = Durations(residual_s={"move": 3.0, "look": 4.0, "manipulation": 0.0}, samples=counted)
    acts = [acted(action) for action in ("move", "move", "search", "pick")]
    assert durations.spread_s(acts) == pytest.approx(34**0.5)


def acted(action: str) -> ActionEnded:
    step = PlanStep(action=action, origin=START, target=START)
    return ActionEnded(stamp_ns=1, decision=1, index=1, start_ns=0, step=step, cost=0.0, success=True)


def test_all_three_estimators_are_measured_unless_others_are_named(capsys: pytest.CaptureFixture[str]) -> None:
    assert lios(["evaluate", "replay", "-n", "2", "-s", "opt-greedy,pes-greedy", "--dry-run"]) == 0
    assert "by each of 3 estimators" in capsys.readouterr().err
    arguments = ["--scenarios", "find", "-n", "2", "-s", "opt-greedy,model-lios", "--worlds", "20", "--json"]
    assert lios(["evaluate", "replay", *arguments]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert [row["estimator"] for row in answer["by_estimator"]] == ["fcnn", "counts", "best"]
    assert [row["counterfactuals"] for row in answer["by_estimator"]] == [2, 2, 2]
    assert [row["inside_bounds"] for row in answer["by_estimator"]] == [1.0, 1.0, 1.0]
    assert lios(["evaluate", "replay", *arguments, "--estimator", "nobody"]) == 2


def test_logs_recorded_with_misses_are_replayed_with_as_many() -> None:
    """In this house a robot whose looks miss half of what is there overlooks one of the items that it seeks."""
    place = ReplayTask(house=f"{shipped_houses()}:10", scenario="find", seed=5)
    plan = MeasurementSettings(
        tasks=(place,),
        strategies=("opt-greedy", "model-lios"),
        settings=ReplaySettings(worlds=0, budget=Budget(segments=100)),
        miss_rate=0.5,
    )
    made = [c for c in counterfactuals(plan) if isinstance(c, Counterfactual)]
    assert len(made) == 2
    assert [c.misses for c in made] == [1, 1]
    assert all(c.inside for c in made)
    assert (summary(made)["misses"], summary(made)["with_misses"]) == (1.0, 1.0)
    told = replace(plan, miss_rate=0.0)
    sure = [c for c in counterfactuals(told) if isinstance(c, Counterfactual)]
    assert [c.true_cost for c in made] == [c.true_cost for c in sure], "the truth overlooks nothing"
    assert {c.misses for c in sure} == {0}


def test_a_unit_of_work_is_one_recorded_log_and_carries_its_own_task_alone(monkeypatch: pytest.MonkeyPatch) -> None:
    place = ReplayTask(house=f"{shipped_houses()}:10", scenario="find", seed=5)
    nowhere = ReplayTask(house=f"{shipped_houses()}:10", scenario="no-such-scenario", seed=5)
    plan = MeasurementSettings(
        tasks=(nowhere, place), strategies=("opt-greedy", "pes-greedy"), settings=ReplaySettings(worlds=4)
    )
    units: list[tuple[ReplayTask, MeasurementSettings, str]] = []

    def in_this_process(work: Any, given: Any, **_: object) -> Any:
        units.extend(given)
        return map(work, units)

    monkeypatch.setattr(trials, "run_in_order", in_this_process)
    made = list(counterfactuals(plan))
    assert [(unit[0], unit[2]) for unit in units] == [(task, name) for task in plan.tasks for name in plan.strategies]
    assert {unit[1].tasks for unit in units} == {()}
    assert [type(one) for one in made] == [SkippedTask, Counterfactual, Counterfactual]
    units.clear()
    assert made[1:] == list(counterfactuals(replace(plan, tasks=(place,))))
    first, second = (one for one in made if isinstance(one, Counterfactual))
    assert (first.recorded, first.strategy) == (second.strategy, second.recorded) == plan.strategies
    assert first.pit is not None


def test_a_rate_out_of_range_is_refused(capsys: pytest.CaptureFixture[str]) -> None:
    assert lios(["evaluate", "replay", "--miss-rate", "1"]) == 2
    assert "miss rate" in capsys.readouterr().err
