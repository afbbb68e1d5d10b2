"""A search for consistent worlds in which a strategy costs less or more than replay says of it.

Every world is built by consistent_worlds.py, independently of the replayer, and climbed from towards both ends. The
slow tests cover every estimator, strategy and scenario over the shipped houses, and some over real ones;
LIOS_CLIMB_STEPS sets the steps of each climb.
"""

from __future__ import annotations

import os
from collections import Counter
from collections.abc import Iterator
from dataclasses import dataclass, field, replace
from pathlib import Path

import numpy as np
import pytest
from consistent_worlds import (
    Ended,
    Imagined,
    LogFacts,
    RefusingWorld,
    is_consistent,
    neighbour,
    random_world,
    read_facts,
    run_in,
    world_around,
)
from sample_logs import record_run

from recorders.simulated_run import RequestedTask, Trial, record_trial, trial_for
from replayers.counterfactual.bounds.bounds import Bounds
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.replay import replay_on
from replayers.runs.run import read
from workbench.beliefs.estimators import estimator
from workbench.errors import Unsupported
from workbench.execution.loop import LoopOptions, run_task
from workbench.planning.strategies import strategy
from workbench.planning.tasks import goal_types
from workbench.plugins import NameOrigin
from workbench.worlds.house import ContainerId, ItemType
from workbench.worlds.maps.navigation import navigate
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses
from workbench.worlds.simulated import SimulatedWorld

ROOM = 1e-6
"""Sums of the same legs in another order."""

STEPS = int(os.environ.get("LIOS_CLIMB_STEPS", "14"))
"""Worlds tried in each climb; every pair is climbed upwards and downwards from five worlds."""

ESTIMATORS = ("counts", "fcnn", "best")
SCENARIOS = ("find", "deliver-3", "any-of-three", "breakfast", "coffee")
STRATEGIES = (
    "opt-greedy", "pes-greedy", "opt-lios", "pes-lios", "model-lios", "conditioned-lios", "scout-lios",
)  # fmt: skip


@dataclass(frozen=True, slots=True, kw_only=True)
class Case:
    """A log to record and the strategy to replay over it; `turn` chooses house and seed."""

    estimator: str
    scenario: str
    recorded: str
    replayed: str
    turn: int


@dataclass(slots=True, kw_only=True)
class Findings:
    """What the climbs over one (log, strategy) pair met.

    Attributes:
        claims: worlds that replay names with their cost.
        outside: worlds with a cost outside the bounds, or another one than replay says.
    """

    worlds: int = 0
    claims: int = 0
    steps: int = 0
    least: float = np.inf
    largest: float = -np.inf
    outside: list[str] = field(default_factory=list[str])


def cases(estimators: tuple[str, ...] = ESTIMATORS, scenarios: tuple[str, ...] = SCENARIOS) -> Iterator[Case]:
    """Every estimator, scenario and strategy, each over the log of another strategy, house after house."""
    for e, name in enumerate(estimators):
        for s, scenario in enumerate(scenarios):
            for k, replayed in enumerate(STRATEGIES):
                recorded = STRATEGIES[(k + 1 + s) % len(STRATEGIES)]
                yield Case(
                    estimator=name, scenario=scenario, recorded=recorded, replayed=replayed, turn=7 * s + k + 3 * e
                )


def trial_of(case: Case, houses: Path, *, count: int) -> Trial:
    """The trial to record, in the first house from the case's turn on that supports its scenario."""
    wish = RequestedTask(scenario=case.scenario)
    for k in range(count):
        house = load_house(f"{houses}:{(case.turn + k) % count}")
        try:
            return trial_for(wish, house, strategy=case.recorded, estimator=case.estimator, seed=case.turn)
        except Unsupported:
            continue
    raise AssertionError(f"no house of {houses} supports {case.scenario}")


def record_with_refusals(trial: Trial, log: Path) -> bool:
    """Records the trial again where the first container that it searches is shut, the way to the next one blocked,
    and the first item that it picks stuck; whether it does search and pick."""
    record_trial(trial, log, force=True)
    run = read(log)
    looked = [c for c in read_facts(log).certain if c not in trial.known]
    picked = [a.items[0] for a in run.actions if a.action == "pick"]
    world = RefusingWorld(
        SimulatedWorld(trial.house, navigate(trial.house.plan), known=trial.known),
        shut=dict.fromkeys(looked[:1], "the door is stuck"),
        blocked=dict.fromkeys(looked[1:2], "the way is blocked"),
        stuck=dict.fromkeys(picked[1:2], "it slips"),
    )
    events = run_task(
        world,
        strategy(str(trial.strategy), origin=NameOrigin.USER),
        estimator(trial.estimator, origin=NameOrigin.USER),
        trial.task,
        costs=trial.costs,
        seed=trial.seed,
        options=LoopOptions(stopwatch=lambda: 0.0),
    )
    record_run(
        log,
        events,
        info=run.info,
        place=run.place,
        task=trial.task,
        costs=trial.costs,
        truth=trial.house.contents,
        force=True,
    )
    return bool(looked)


def climb_both_ways(facts: LogFacts, name: str, bounds: Bounds, rng: np.random.Generator, *, steps: int) -> Findings:
    """Climbs towards both ends from the recorded truth, from a sparse and a full random world, and from those of the
    cheapest and the dearest run that replay knows; checks every world, and that those two cost what replay says."""
    found = Findings()
    starts = [random_world(facts, rng, extra=0), random_world(facts, rng, extra=2 * len(facts.open))]
    if facts.truth is not None:
        starts.append(facts.truth)
    relevant = strategy(name, origin=NameOrigin.USER).relevant_types(facts.task)
    for leaf in (bounds.cheapest, bounds.most_expensive):
        claimed = leaf and world_around(facts, {f.container: f.answer for f in leaf.filled})
        if leaf is None or claimed is None:
            continue
        starts.append(claimed)
        met = _visit(facts, claimed, name, bounds, found)
        found.claims += 1
        if abs(met.cost - leaf.cost) > ROOM:
            found.outside.append(f"replay says {leaf.cost}, it is {met.cost} ({met.status}): {leaf.filled}")
    for start in starts:
        first = _visit(facts, start, name, bounds, found)
        for up in (False, True):
            world, last = start, first
            for step in range(steps if facts.open else 0):
                other = neighbour(facts, world, last, relevant, rng, up=up)
                ended = _visit(facts, other, name, bounds, found, name_ids=step)
                found.steps += 1
                if ended.cost >= last.cost if up else ended.cost <= last.cost:
                    world, last = other, ended
    return found


def _visit(
    facts: LogFacts, world: Imagined, name: str, bounds: Bounds, found: Findings, *, name_ids: int = 0
) -> Ended:
    assert is_consistent(facts, world)
    ended = run_in(facts, world, name, name_ids=name_ids)
    found.worlds += 1
    found.least, found.largest = min(found.least, ended.cost), max(found.largest, ended.cost)
    if not bounds.lower - ROOM <= ended.cost <= bounds.upper + ROOM:
        held = {c: types for c, types in world.items() if types}
        found.outside.append(f"{ended.cost} ({ended.status}) outside [{bounds.lower}, {bounds.upper}]: {held}")
    return ended


def searched(case: Case, houses: Path, folder: Path, *, count: int, steps: int = STEPS) -> tuple[Findings, str]:
    """Records a case's log, replays its strategy and climbs; what was found, and a line about it."""
    log = folder / "run.mcap"
    trial = trial_of(case, houses, count=count)
    record_trial(trial, log, force=True)
    bounds, found = _climbed(log, case.replayed, seed=case.turn, steps=steps)
    line = (
        f"{case.estimator:6} {case.scenario:12} {trial.house.plan.name} {case.recorded}: {case.replayed} "
        f"[{bounds.lower:.2f} {bounds.lower_proof.value}, {bounds.upper:.2f} {bounds.upper_proof.value}] "
        f"replay found {bounds.least_found:.2f} to {bounds.largest_found:.2f}, "
        f"climbs {found.least:.2f} to {found.largest:.2f} in {found.worlds} worlds, {len(found.outside)} outside"
    )
    return found, line


def _climbed(log: Path, name: str, *, seed: int, steps: int) -> tuple[Bounds, Findings]:
    prepared = prepare_log(read(log), ReplaySettings(worlds=50), with_paths=False)
    made = replay_on(prepared, name, origin=NameOrigin.USER)
    assert made.bounds is not None, made.reason
    return made.bounds, climb_both_ways(read_facts(log), name, made.bounds, np.random.default_rng(seed), steps=steps)


def _report(
    all_cases: list[Case], houses: Path, folder: Path, *, count: int, capsys: pytest.CaptureFixture[str]
) -> None:
    total: Counter[str] = Counter()
    outside: list[str] = []
    for case in all_cases:
        found, line = searched(case, houses, folder, count=count)
        total.update(pairs=1, worlds=found.worlds, steps=found.steps, claims=found.claims, outside=len(found.outside))
        outside += [f"{line}: {what}" for what in found.outside]
        with capsys.disabled():
            print(f"\n{line}", end="", flush=True)
    with capsys.disabled():
        print(f"\n{dict(total)}")
    assert not outside, "\n".join(outside[:5])


def test_the_cases_cover_every_estimator_scenario_and_strategy() -> None:
    made = list(cases())
    assert len(made) >= 100
    assert len({(c.estimator, c.scenario, c.replayed) for c in made}) == len(made)
    assert {(c.estimator, c.scenario, c.replayed) for c in made} == {
        (e, s, k) for e in ESTIMATORS for s in SCENARIOS for k in STRATEGIES
    }
    assert all(c.recorded != c.replayed for c in made)


def test_no_world_lies_outside_over_one_log(tmp_path: Path) -> None:
    """What drove the run costs the same in every world met; another strategy's worlds differ, within its bounds."""
    log = tmp_path / "run.mcap"
    case = Case(estimator="counts", scenario="find", recorded="opt-lios", replayed="pes-greedy", turn=1)
    record_trial(trial_of(case, shipped_houses(), count=24), log)
    bounds, same = _climbed(log, case.recorded, seed=0, steps=1)
    assert bounds.exact
    assert same.largest - same.least <= ROOM
    bounds, other = _climbed(log, case.replayed, seed=0, steps=2)
    assert not bounds.exact
    assert other.largest - other.least > ROOM
    assert same.steps == 2 * 5
    assert other.steps == 4 * 5
    assert (same.claims, other.claims) == (2, 2)
    assert not same.outside
    assert not other.outside


def test_worlds_that_break_the_log_are_told_apart(tmp_path: Path) -> None:
    """By hand: contents where the robot looked, a listed type nowhere, and a type that the task rules out."""
    log = tmp_path / "run.mcap"
    case = Case(estimator="counts", scenario="deliver-3", recorded="model-lios", replayed="", turn=1)
    trial = trial_of(case, shipped_houses(), count=24)
    asked = goal_types(trial.task.goal)[0]
    without = {c: tuple(i for i in items if i.type != asked) for c, items in trial.house.contents.items()}
    listed = tuple(t for t in trial.task.available if t != asked)
    house, task = replace(trial.house, contents=without), replace(trial.task, available=listed)
    record_trial(replace(trial, house=house, task=task), log)
    facts = read_facts(log)
    world = dict(random_world(facts, np.random.default_rng(0), extra=0))
    assert is_consistent(facts, world)
    looked = next(iter(facts.certain))
    assert not is_consistent(facts, {**world, ContainerId(looked): (ItemType("Mug"),)})
    assert not is_consistent(facts, {**world, facts.open[0]: (asked,)})
    assert not is_consistent(facts, dict.fromkeys(world, ()))


@pytest.mark.slow
@pytest.mark.timeout(7200)
@pytest.mark.parametrize("scenario", SCENARIOS)
@pytest.mark.parametrize("name", ESTIMATORS)
def test_no_world_lies_outside_over_the_shipped_houses(
    name: str, scenario: str, tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    of_both = [c for c in cases() if (c.estimator, c.scenario) == (name, scenario)]
    _report(of_both, shipped_houses(), tmp_path, count=24, capsys=capsys)


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_no_world_lies_outside_where_actions_were_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    """A shut container, a blocked one, and an item that cannot be picked, over logs of deliveries and breakfasts."""
    log = tmp_path / "run.mcap"
    refused, worlds = Counter[str](), 0
    for case in list(cases(scenarios=("deliver-3", "breakfast")))[::3]:
        if not record_with_refusals(trial_of(case, shipped_houses(), count=24), log):
            continue
        facts = read_facts(log)
        refused.update(shut=len(facts.shut), blocked=len(facts.blocked), stuck=len(facts.stuck))
        bounds, found = _climbed(log, case.replayed, seed=case.turn, steps=max(1, STEPS // 2))
        assert not found.outside, f"{case} {bounds.lower} {bounds.upper}: {found.outside[:3]}"
        worlds += found.worlds
    assert all(refused[kind] for kind in ("shut", "blocked", "stuck"))
    with capsys.disabled():
        print(f"\nrefused: {dict(refused)}, {worlds} worlds")


@pytest.mark.slow
@pytest.mark.timeout(7200)
def test_no_world_lies_outside_over_real_houses(
    tmp_path: Path, procthor: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    real = [c for c in cases(scenarios=("deliver-3", "breakfast", "find")) if c.turn % 3 == 0]
    _report(real, procthor / "multi_room_train.jsonl.gz", tmp_path, count=100, capsys=capsys)
