"""Looks that may have missed: bounds against every world with so many overlooked items, each run in a house."""

from __future__ import annotations

import json
from collections.abc import Iterator, Mapping
from dataclasses import replace
from itertools import combinations, product
from pathlib import Path

import numpy as np
import pytest
from fake_world import FakeWorld
from sample_logs import T0, record_run, toy_info, toy_place
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, toy_house
from toy_logs import BOOK, MUG, PENCIL, delivered, task_of

from replayers.counterfactual.bounds.bounds import Budget
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.relevance import Assumptions
from replayers.counterfactual.replay import replay_on
from replayers.runs.run import Run, read
from workbench.beliefs.estimators import estimator
from workbench.cli import run as lios
from workbench.errors import BadValue
from workbench.execution.events import RunStatus
from workbench.execution.loop import outcome_of, run_task
from workbench.planning.strategies import strategy
from workbench.planning.tasks import AllOf, Task, find_task
from workbench.plugins import NameOrigin
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.house import START, ContainerId, House, Item, ItemId, ItemType

PLENTY = Budget(segments=100_000, finish=100_000)
NAMES = ("opt-greedy", "pes-greedy", "model-lios", "conditioned-lios")
Extra = Mapping[ContainerId, tuple[ItemType, ...]]

FIND_IT = replace(find_task(MUG, START), available=(BOOK, MUG))
TWO = replace(task_of(AllOf(parts=(delivered("Mug", BED), delivered("Book", TABLE)))), available=(BOOK, MUG))
TASKS = {"find": FIND_IT, "two deliveries": TWO}


def house_without(*types: ItemType) -> House:
    """The toy house without what the looks will overlook."""
    inside = {c: tuple(i for i in items if i.type not in types) for c, items in toy_house().contents.items()}
    return House(plan=toy_house().plan, contents=inside)


def house_with(house: House, extra: Extra) -> House:
    """The same with more in it."""
    inside = {
        c: (*items, *(Item(id=ItemId(f"{t}|more|{c}"), type=t) for t in extra.get(c, ())))
        for c, items in house.contents.items()
    }
    return House(plan=house.plan, contents=inside)


def recorded(folder: Path, house: House, task: Task, *, known: tuple[ContainerId, ...] = (FRIDGE,)) -> Run:
    """The run of a robot that overlooks all that the given house lacks: what it can see of the world."""
    believer = estimator("counts")
    events = run_task(
        FakeWorld(house=house, known=known, clock_ns=T0),
        strategy("opt-greedy", origin=NameOrigin.USER),
        believer,
        task,
        costs=SIMULATION_COSTS,
        seed=7,
    )
    info = toy_info(strategy="opt-greedy", estimator=believer.name, scenario=task.scenario)
    path = folder / "missed.mcap"
    record_run(
        path, events, info=info, place=toy_place(), task=task, costs=SIMULATION_COSTS, truth=toy_house().contents
    )
    return read(path, with_truth=True)


def cost_in(house: House, name: str, task: Task, known: tuple[ContainerId, ...] = (FRIDGE,)) -> float:
    """What a strategy that overlooks nothing costs in a house."""
    events = run_task(
        FakeWorld(house=house, known=known, clock_ns=T0),
        strategy(name, origin=NameOrigin.USER),
        estimator("counts"),
        task,
        costs=SIMULATION_COSTS,
        seed=7,
    )
    return outcome_of(list(events)).cost


def worlds_with(
    looked: tuple[ContainerId, ...], types: tuple[ItemType, ...], most: int, house: House, task: Task
) -> Iterator[House]:
    """Every house that holds at most so many more items in the containers that were looked into, and all that the
    task lists."""
    cells = [(c, t) for c in looked for t in types]
    for number in range(most + 1):
        for chosen in combinations(cells, number):
            extra = {c: tuple(t for at, t in chosen if at == c) for c in looked}
            world = house_with(house, extra)
            if set(task.available) <= set(world.item_types()):
                yield world


@pytest.mark.parametrize("title", TASKS)
@pytest.mark.parametrize("name", NAMES)
def test_a_contradiction_is_resolved_by_the_fewest_misses(tmp_path: Path, name: str, title: str) -> None:
    """No look found a mug, and every container was opened; the task says that there is one."""
    task, house = TASKS[title], house_without(MUG)
    run = recorded(tmp_path, house, task)
    prepared = prepare_log(run, ReplaySettings(worlds=60, budget=PLENTY))
    assert prepared.contradicting == (MUG,)
    made = replay_on(prepared, name)
    looked = (COUNTER, TABLE, BED, DESK)
    costs = [cost_in(world, name, task) for world in worlds_with(looked, (MUG,), 1, house, task)]
    assert made.bounds is not None
    assert made.bounds.complete
    assert (made.bounds.lower, made.bounds.upper) == pytest.approx((min(costs), max(costs)), abs=1e-6)
    assert made.status is RunStatus.UNDETERMINED
    assert "Mug" in made.reason
    assert any("overlooked" in note and all(c in note for c in looked) for note in made.notes)
    assert made.drawn is not None
    assert all(min(abs(cost - c) for c in costs) < 1e-6 for cost in made.drawn)


@pytest.mark.ci_but(3)
@pytest.mark.parametrize("most", [1, 2, 3])
@pytest.mark.parametrize(("name", "title"), list(product(("opt-greedy", "model-lios"), TASKS)))
def test_bounds_hold_in_every_world_with_at_most_so_many_misses(
    tmp_path: Path, name: str, title: str, most: int
) -> None:
    """Nothing contradicts here (a mug is in the desk): worlds with up to `most` more mugs and books, and the bounds
    are the extremes over them."""
    task, house = TASKS[title], toy_house()
    run = recorded(tmp_path, house, task)
    looked = tuple(ContainerId(o.container) for o in run.observations if not o.known_at_start)
    unopened = tuple(c for c in (COUNTER, TABLE, BED, DESK) if c not in looked)
    settings = ReplaySettings(worlds=60, budget=PLENTY, assumptions=Assumptions(misses=most))
    made = replay_on(prepare_log(run, settings), name)
    costs = []
    for inside in product(product((False, True), repeat=2), repeat=len(unopened)):
        held = {
            c: tuple(t for t, there in zip((BOOK, MUG), flags, strict=True) if there)
            for c, flags in zip(unopened, inside, strict=True)
        }
        bare = {c: tuple(i for i in items if c not in unopened or i.type not in (BOOK, MUG))
                for c, items in house.contents.items()}  # fmt: skip
        base = house_with(House(plan=house.plan, contents=bare), held)
        costs += [cost_in(world, name, task) for world in worlds_with(looked, (BOOK, MUG), most, base, task)]
    assert made.bounds is not None
    assert made.bounds.complete
    assert (made.bounds.lower, made.bounds.upper) == pytest.approx((min(costs), max(costs)), abs=1e-6)
    assert made.drawn is not None
    assert min(costs) - 1e-6 <= made.drawn.min() <= made.drawn.max() <= max(costs) + 1e-6


def test_without_misses_a_replay_is_what_it_was(tmp_path: Path) -> None:
    run = recorded(tmp_path, toy_house(), FIND_IT)
    plain = replay_on(prepare_log(run, ReplaySettings()), "model-lios")
    none = replay_on(prepare_log(run, ReplaySettings(assumptions=Assumptions(misses=0))), "model-lios")
    assert plain.bounds == none.bounds
    assert np.array_equal(plain.drawn, none.drawn)  # type: ignore[arg-type]
    assert plain.notes == none.notes


def test_two_types_that_no_look_found_take_two_misses(tmp_path: Path) -> None:
    house = house_without(MUG, BOOK)
    prepared = prepare_log(recorded(tmp_path, house, TWO), ReplaySettings(budget=PLENTY))
    assert (prepared.contradicting, prepared.evidence.misses) == ((BOOK, MUG), 2)
    made = replay_on(prepared, "opt-greedy")
    assert made.bounds is not None
    looked = (COUNTER, TABLE, BED, DESK)
    costs = [cost_in(w, "opt-greedy", TWO) for w in worlds_with(looked, (BOOK, MUG), 2, house, TWO)]
    assert (made.bounds.lower, made.bounds.upper) == pytest.approx((min(costs), max(costs)), abs=1e-6)


def test_the_truth_counts_what_looks_overlooked(tmp_path: Path) -> None:
    run = recorded(tmp_path, house_without(MUG), FIND_IT)
    made = replay_on(prepare_log(run, ReplaySettings(with_truth=True)), "model-lios")
    assert made.true_cost == pytest.approx(cost_in(toy_house(), "model-lios", FIND_IT))


def test_a_known_container_is_not_doubted(tmp_path: Path) -> None:
    every = (FRIDGE, COUNTER, TABLE, BED)
    house = house_without(MUG)
    run = recorded(tmp_path, house, FIND_IT, known=every)
    made = replay_on(prepare_log(run, ReplaySettings()), "opt-greedy")
    assert made.exact
    assert made.bounds is not None
    world = house_with(house, {DESK: (MUG,)})
    assert made.bounds.lower == pytest.approx(cost_in(world, "opt-greedy", FIND_IT, every))


def test_without_the_inventory_nothing_contradicts(tmp_path: Path) -> None:
    run = recorded(tmp_path, house_without(MUG), FIND_IT)
    made = replay_on(prepare_log(run, ReplaySettings(assumptions=Assumptions(inventory=False))), "opt-greedy")
    assert made.exact
    assert made.bounds is not None
    assert made.bounds.lower == 400.0


def test_an_item_that_nobody_seeks_contradicts_nothing(tmp_path: Path) -> None:
    task = replace(FIND_IT, available=(MUG, PENCIL))
    run = recorded(tmp_path, house_without(PENCIL), task)
    assert prepare_log(run, ReplaySettings(worlds=0)).evidence.misses == 0


def test_the_command_tells_the_contradiction_and_what_to_look_into_again(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded(tmp_path, house_without(MUG), FIND_IT)
    log = str(tmp_path / "missed.mcap")
    assert lios(["replay", log, "-s", "opt-greedy,model-lios", "--json", "--look-next", "-j", "1"]) == 0
    answer = json.loads(capsys.readouterr().out)
    for row in answer["rows"]:
        assert row["status"] == "undetermined"
        assert not row["exact"]
        assert row["lower"] < row["upper"] < 400
        assert row["misses"] == 1
        assert row["contradicting"] == ["Mug"]
        assert row["may_have_missed"] == [COUNTER, TABLE, BED, DESK]
    assert answer["look_next"][0]["container"] in (COUNTER, TABLE, BED, DESK)
    assert "again" in answer["look_next"][0]["words"]


def test_more_misses_than_the_inventory_implies_may_be_asked_for(
    tmp_path: Path, capsys: pytest.CaptureFixture[str]
) -> None:
    recorded(tmp_path, toy_house(), FIND_IT)
    log = str(tmp_path / "missed.mcap")
    widths: list[float] = []
    for most in ("0", "1"):
        assert lios(["replay", log, "-s", "model-lios", "--misses", most, "--json", "-j", "1"]) == 0
        row = json.loads(capsys.readouterr().out)["rows"][0]
        assert row["misses"] == int(most)
        widths.append(row["upper"] - row["lower"])
    assert widths[0] < widths[1]


def test_misses_below_none_are_refused(tmp_path: Path, capsys: pytest.CaptureFixture[str]) -> None:
    with pytest.raises(BadValue):
        Assumptions(misses=-1)
    recorded(tmp_path, toy_house(), FIND_IT)
    assert lios(["replay", str(tmp_path / "missed.mcap"), "--misses", "-1"]) == 2
