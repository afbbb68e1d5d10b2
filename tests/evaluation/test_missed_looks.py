"""The search experiment where looks miss: every policy finds what exists, at the cost of the closed loop."""

from __future__ import annotations

import json
from dataclasses import replace
from pathlib import Path

import msgspec
import pytest
from toy import toy_house, toy_travel

from recorders.task_trials import TrialRecorder
from replayers.batch.verify import verify
from replayers.runs.run import read
from workbench.beliefs.estimators import estimator
from workbench.cli import run as lios
from workbench.errors import BadValue
from workbench.evaluation.search.experiment import Experiment, policies_named, run_experiment
from workbench.evaluation.search.missed_looks import MissedLooks, search_with_misses
from workbench.evaluation.search.strategies import strategy_of
from workbench.evaluation.tasks.experiment import TaskRequest
from workbench.evaluation.tasks.store import DifferentEvaluation, TrialStore
from workbench.evaluation.tasks.trials import trial_keys
from workbench.evaluation.tasks.workers import Unit, run_unit
from workbench.execution.events import ContainerObserved
from workbench.execution.loop import outcome_of, run_task
from workbench.log_schema.sight_json import sight_from_settings
from workbench.planning.strategies import strategy
from workbench.planning.tasks import find_task
from workbench.search.costs import ROBOT_COSTS, SIMULATION_COSTS
from workbench.search.policies.registry import policy
from workbench.worlds.house import START, ItemType
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.perception import missing_at
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses
from workbench.worlds.simulated import SimulatedWorld

MUG = ItemType("Mug")
EVERY = ("greedy", "conditioned-lios", "robust-lios")


@pytest.mark.ci_but(2)
@pytest.mark.parametrize("costs", [SIMULATION_COSTS, ROBOT_COSTS], ids=["free looks", "looks cost"])
@pytest.mark.parametrize("name", EVERY)
def test_the_closed_loop_makes_the_same_looks_at_the_same_cost(name: str, costs) -> None:  # type: ignore[no-untyped-def]
    house = load_house(f"{shipped_houses()}:2")
    navigation, believer = navigate(house.plan), estimator("counts")
    planner = strategy(strategy_of(name) or "")
    item = house.item_types()[3]
    for seed in range(3):
        trial = search_with_misses(
            house,
            navigation.travel,
            item,
            policy(name),
            None if name == "greedy" else believer,
            costs=costs,
            misses=MissedLooks(rate=0.6, seed=seed),
        )
        world = SimulatedWorld(house, navigation, miss_rate=0.6, seed=seed)
        task = replace(find_task(item, START), available=(item,))
        events = list(run_task(world, planner, believer, task, costs=costs, perception=missing_at(0.6)))
        assert trial.order == tuple(e.container for e in events if isinstance(e, ContainerObserved))
        assert trial.cost == pytest.approx(outcome_of(events).cost, abs=1e-9)
        assert trial.found


def test_starting_over_forgets_what_was_seen() -> None:
    """The toy house: the first look into the mug's container misses; then all five are searched as at first."""
    seed = next(s for s in range(99) if len(toy_trial(s, start_over=False).order) > 5)
    over = toy_trial(seed, start_over=True)
    assert over.policy == "greedy@start-over"
    assert sorted(over.order[:5]) == sorted(c.id for c in toy_house().plan.containers)
    assert len(over.order) > 5
    assert over.found


def toy_trial(seed: int, *, start_over: bool):  # type: ignore[no-untyped-def]
    misses = MissedLooks(rate=0.5, seed=seed, start_over=start_over)
    house, travel = toy_house(), toy_travel()
    return search_with_misses(house, travel, MUG, policy("greedy"), None, costs=SIMULATION_COSTS, misses=misses)


def test_policies_are_paired_and_the_oracle_misses_nothing() -> None:
    names = policies_named(["robust-lios", "conditioned-lios@start-over"], looks_miss=True)
    assert names == ("greedy", "conditioned-lios@start-over", "robust-lios", "oracle")
    made = Experiment(policies=names, estimator="counts", paper_estimator="counts", miss_rate=0.5, seed=3)
    seeds = {name: made.misses_of(name, "toy", MUG).seed for name in names}
    assert len(set(seeds.values())) == 1
    (result,) = run_experiment(made, [toy_house()], asked={"toy": (MUG,)})
    assert [t.policy for t in result.trials] == list(names)
    assert all(t.found for t in result.trials)
    assert len(result.trials[-1].order) == 1


ASKED = [*["evaluate", "search", "--estimator", "counts", "--no-figures", "--miss-rate", "0.3", "-p"]]
NAMES = "robust-lios,conditioned-lios,conditioned-lios@start-over"


def test_the_command_compares_robust_lios_with_the_others(capsys: pytest.CaptureFixture[str]) -> None:
    assert lios([*ASKED, NAMES, "--queries", "2", "--json"]) == 0
    answer = json.loads(capsys.readouterr().out)
    assert answer["miss_rate"] == 0.3
    assert [row["found"] for row in answer["rows"]] == [1.0] * 5
    pair = next(p for p in answer["pairs"] if (p["a"], p["b"]) == ("conditioned-lios@start-over", "robust-lios"))
    costs = {row["policy"]: row["mean_cost"] for row in answer["rows"]}
    assert pair["share_of_a"] == pytest.approx(costs["robust-lios"] / costs["conditioned-lios@start-over"] - 1)


@pytest.mark.slow
def test_searches_are_recorded_but_for_those_that_start_over(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    assert lios([*ASKED, NAMES, "--queries", "3", "--record", "-o", str(tmp_path)]) == 0
    assert "robust-lios against conditioned-lios@start-over: " in capsys.readouterr().err
    assert len(list(tmp_path.rglob("*.mcap"))) == 3 * 4


@pytest.mark.parametrize(("rate", "said"), [("1", "miss rate"), ("-0.1", "miss rate"), ("nan", "--miss-rate")])
@pytest.mark.parametrize("of", ["search", "tasks"])
def test_a_rate_out_of_range_is_one_line(of: str, rate: str, said: str, capsys: pytest.CaptureFixture[str]) -> None:
    assert lios(["evaluate", of, "--miss-rate", rate]) == 2
    assert said in capsys.readouterr().err


def test_starting_over_is_for_looks_that_miss() -> None:
    with pytest.raises(BadValue, match="--miss-rate"):
        policies_named(["conditioned-lios@start-over"])


def test_tasks_with_misses_draw_them_alike_and_are_recorded(tmp_path: Path) -> None:
    """Each log is reproduced with its misses; the looks of the oracle, which never miss, are plain ones."""
    key = trial_keys("any-of-three", str(shipped_houses()), (6,), trials=1, seed=4)[0]
    unit = Unit(
        key=key,
        strategies=(("conditioned-lios", "counts"), ("robust-lios", "counts"), ("oracle", "counts")),
        miss_rate=0.5,
        event_hook=TrialRecorder(folder=tmp_path),
    )
    rows = run_unit(unit)
    assert all(row.success for row in rows)
    for row in rows:
        run = read(TrialRecorder(folder=tmp_path).log_of(row))
        looks = [o.look for o in run.observations if not o.known_at_start]
        assert all(look is None for look in looks) == (row.strategy == "oracle")
        assert row.strategy == "oracle" or verify(run).same
    settings_ = TaskRequest(
        houses="h", split="all", scenarios=("any-of-three",), strategies=("robust-lios",), trials=1, seed=0,
        estimator="counts", paper_estimator="counts",
    )  # fmt: skip
    with TrialStore(tmp_path / "out", settings_) as store:
        store.add(rows[:1])
    for changed in ({"miss_rate": 0.1}, {"sees_m": 2.5}):
        with pytest.raises(DifferentEvaluation, match=next(iter(changed))):
            TrialStore(tmp_path / "out", msgspec.structs.replace(settings_, **changed))


def test_tasks_with_sight_see_in_passing_and_are_recorded(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    words = ["evaluate", "tasks", "--scenarios", "any-of-three", "-s", "conditioned-lios", "--estimator", "counts"]
    words += ["-n", "1", "--sees", "2.5", "--miss-rate", "0.3", "--record", "-o", str(tmp_path), "--json"]
    assert lios(words) == 0
    answer = json.loads(capsys.readouterr().out)
    assert (answer["sees_m"], answer["miss_rate"]) == (2.5, 0.3)
    (log,) = tmp_path.rglob("*conditioned-lios.mcap")
    run = read(log)
    assert sight_from_settings(run.settings) == 2.5
    assert any(o.passing is not None for o in run.observations)
    assert verify(run).same
    assert lios([*words[:-1], "--memory"]) == 2
    assert lios([*words, "--sees", "-1"]) == 2
