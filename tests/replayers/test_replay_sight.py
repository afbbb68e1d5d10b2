"""Replay over logs of a robot that sees in passing: bounds against every consistent world, run in the simulator.

The toy house has five containers, four of them open furniture. Every filling of those that the log neither searched
nor saw is built as a house, and the strategy is run in it with the same sight.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, product
from pathlib import Path

import pytest
from toy import TABLE, item, toy_house

from recorders.simulated_run import RequestedTask, Trial, record_trial, trial_events, trial_for
from replayers.batch.verify import verify
from replayers.counterfactual.prepared_log import PreparedLog, ReplaySettings, prepare_log
from replayers.counterfactual.relevance import Assumptions
from replayers.counterfactual.replay import replay_on
from replayers.counterfactual.results import Proof
from replayers.runs.run import read
from workbench.execution.events import RunStatus
from workbench.execution.loop import outcome_of
from workbench.planning.tasks import AllOf, Delivered, Task, find_task
from workbench.worlds.house import START, ContainerId, House, Item, ItemType, LocationId
from workbench.worlds.procthor.load import load_house
from workbench.worlds.shipped import shipped_houses

MUG, BOOK = ItemType("Mug"), ItemType("Book")
FIND = find_task(MUG, START)
BOTH = replace(
    FIND,
    goal=AllOf(parts=(Delivered(item_type=MUG, at=LocationId(TABLE)), Delivered(item_type=BOOK, at=START))),
)
STRATEGIES = ("opt-greedy", "pes-greedy", "opt-lios", "model-lios", "conditioned-lios", "sight-lios")


def recorded(folder: Path, task: Task, radius_m: float, strategy: str) -> tuple[Trial, PreparedLog]:
    trial = Trial(house=toy_house(), task=task, strategy=strategy, estimator="counts", sees_m=radius_m)
    path = folder / "run.mcap"
    record_trial(trial, path, force=True)
    return trial, prepare_log(read(path), ReplaySettings(worlds=0))


def consistent_houses(trial: Trial, ground: PreparedLog, types: tuple[ItemType, ...]) -> Iterator[House]:
    """Every house in which the containers that nobody saw hold some of these types, each at most once."""
    subsets = [c for n in range(len(types) + 1) for c in combinations(types, n)]
    left = ground.evidence.open
    for filled in product(subsets, repeat=len(left)):
        contents: dict[ContainerId, tuple[Item, ...]] = dict(trial.house.contents)
        for container, held in zip(left, filled, strict=True):
            contents[container] = tuple(item(f"{t}|{container.replace('|', '')}") for t in held)
        yield House(plan=trial.house.plan, contents=contents)


@pytest.mark.ci_but(4)
@pytest.mark.parametrize("radius_m", [0.9, 1.6, 2.5])
@pytest.mark.parametrize(("task", "types"), [(FIND, (MUG,)), (BOTH, (MUG, BOOK))], ids=["find", "both"])
@pytest.mark.parametrize("driver", ["opt-greedy", "conditioned-lios"])
def test_bounds_are_those_of_all_consistent_worlds(
    tmp_path: Path, driver: str, task: Task, types: tuple[ItemType, ...], radius_m: float
) -> None:
    trial, ground = recorded(tmp_path, task, radius_m, driver)
    houses = list(consistent_houses(trial, ground, types))
    for strategy in STRATEGIES:
        bounds = replay_on(ground, strategy).bounds
        assert bounds is not None
        costs = [outcome_of(list(trial_events(replace(trial, house=h, strategy=strategy)))).cost for h in houses]
        assert bounds.lower <= min(costs) + 1e-6, strategy
        assert bounds.upper >= max(costs) - 1e-6, strategy
        if bounds.lower_proof is Proof.EXACT:
            assert bounds.lower == pytest.approx(min(costs)), strategy
        if bounds.upper_proof is Proof.EXACT:
            assert bounds.upper == pytest.approx(max(costs)), strategy
        if task is FIND:
            assert bounds.complete
            assert bounds.exact == (max(costs) - min(costs) <= 1e-6)


@pytest.mark.parametrize("misses", [1, 2])
@pytest.mark.parametrize(("task", "types"), [(FIND, (MUG,)), (BOTH, (MUG, BOOK))], ids=["find", "both"])
def test_with_overlooked_items_bounds_are_those_of_all_worlds_with_so_many_more(
    tmp_path: Path, task: Task, types: tuple[ItemType, ...], misses: int
) -> None:
    """What was seen in passing may hold more, as what was looked into; what was in view from the start may not."""
    trial, _ = recorded(tmp_path, task, 1.6, "opt-greedy")
    run = read(tmp_path / "run.mcap")
    assert any(o.passing is not None and not o.known_at_start for o in run.observations)
    ground = prepare_log(run, ReplaySettings(worlds=0, assumptions=Assumptions(misses=misses)))
    looked = tuple(sorted({ContainerId(o.container) for o in run.observations if not o.known_at_start}))
    cells = [(c, t) for c in looked for t in types]
    chosen = [overlooked for n in range(misses + 1) for overlooked in combinations(cells, n)]
    houses = [
        House(
            plan=house.plan,
            contents={
                c: (*items, *(item(f"{t}|more{c.replace('|', '')}") for at, t in overlooked if at == c))
                for c, items in house.contents.items()
            },
        )
        for house in consistent_houses(trial, ground, types)
        for overlooked in chosen
    ]
    trusting = prepare_log(run, ReplaySettings(worlds=0))
    for strategy in ("opt-greedy", "conditioned-lios"):
        bounds, believed = replay_on(ground, strategy).bounds, replay_on(trusting, strategy).bounds
        assert bounds is not None
        assert believed is not None
        costs = [outcome_of(list(trial_events(replace(trial, house=h, strategy=strategy)))).cost for h in houses]
        assert bounds.lower <= min(costs) + 1e-6, strategy
        assert bounds.upper >= max(costs) - 1e-6, strategy
        if task is BOTH:
            assert min(costs) < believed.lower - 1e-6 or max(costs) > believed.upper + 1e-6, strategy
        if bounds.lower_proof is Proof.EXACT:
            assert bounds.lower == pytest.approx(min(costs)), strategy
        if bounds.upper_proof is Proof.EXACT:
            assert bounds.upper == pytest.approx(max(costs)), strategy


def test_the_recorded_run_is_reproduced_and_another_way_asks_for_what_nobody_saw(tmp_path: Path) -> None:
    path = tmp_path / "run.mcap"
    house = load_house(f"{shipped_houses()}:3")
    trial = trial_for(RequestedTask(find="book"), house, strategy="conditioned-lios", estimator="counts")
    trial = replace(trial, sees_m=2.5)
    end = record_trial(trial, path)
    run = read(path, with_truth=True)
    assert verify(run).same
    ground = prepare_log(run, ReplaySettings(with_truth=True, worlds=20))
    own = replay_on(ground, "conditioned-lios")
    assert own.exact
    assert own.cost == pytest.approx(end.cost)
    for strategy in ("opt-greedy", "model-lios", "sight-lios"):
        made = replay_on(ground, strategy)
        assert made.bounds is not None
        truth = outcome_of(list(trial_events(replace(trial, strategy=strategy)))).cost
        assert made.true_cost == pytest.approx(truth)
        assert made.bounds.lower - 1e-6 <= truth <= made.bounds.upper + 1e-6
        if made.status is RunStatus.UNDETERMINED:
            assert made.unseen in ground.evidence.open


def test_what_comes_into_view_on_a_move_is_undetermined_where_nobody_saw_it(tmp_path: Path) -> None:
    """A greedy robot passes tables that the recorded way did not: the run over the log alone stops there."""
    house = load_house(f"{shipped_houses()}:0")
    trial = trial_for(RequestedTask(find="book"), house, strategy="conditioned-lios", estimator="counts")
    trial = replace(trial, sees_m=2.5)
    path = tmp_path / "run.mcap"
    record_trial(trial, path)
    ground = prepare_log(read(path), ReplaySettings(worlds=0))
    made = [replay_on(ground, s) for s in ("opt-greedy", "model-lios")]
    stopped = [m for m in made if "comes into view on the way" in m.reason]
    assert stopped
    for one in stopped:
        assert one.status is RunStatus.UNDETERMINED
        assert one.unseen in ground.evidence.open
