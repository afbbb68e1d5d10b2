"""Replay of a robot that turns for tags seen in passing: bounds against runs in every consistent world, by chance.

The toy house has five containers, four of them open. Every filling of those that the log left open is built as a
house, and strategies are run in it with tags seen and missed by chance. Whatever they see, the bounds hold.
"""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import replace
from itertools import combinations, product
from pathlib import Path

import pytest
from toy import BED, COUNTER, DESK, TABLE, item, toy_house
from world_with_tags import events_with_tags, record_with_tags, tags_in

from recorders.simulated_run import Trial, record_trial
from replayers.batch.verify import verify
from replayers.certificates.build import NotCertifiable, certificate
from replayers.counterfactual.evidence import Evidence, evidence_of
from replayers.counterfactual.logged_world import LoggedWorld
from replayers.counterfactual.prepared_log import ReplaySettings, prepare_log
from replayers.counterfactual.relevance import Assumptions
from replayers.counterfactual.replay import replay_on
from replayers.runs.resume_state import known_from_logs
from replayers.runs.run import Run, read
from workbench.execution.loop import outcome_of
from workbench.log_schema.events import Observation, SeenItem
from workbench.planning.strategies import strategy
from workbench.planning.tasks import AllOf, Delivered, Task, find_task
from workbench.worlds.house import START, ContainerId, House, Item, ItemType, LocationId
from workbench.worlds.sight.tags_in_passing import TagsInPassing
from workbench.worlds.world import ActionDone, LookResult

PHONE, PLATE = ItemType("CellPhone"), ItemType("Plate")
FIND = find_task(PHONE, START)
BOTH = replace(
    FIND,
    goal=AllOf(
        parts=(
            Delivered(item_type=PHONE, at=LocationId(TABLE)),
            Delivered(item_type=PLATE, at=LocationId(COUNTER)),
        )
    ),
)
STRATEGIES = ("opt-greedy", "pes-greedy", "pes-lios", "model-lios", "conditioned-lios")
RADIUS_M = 2.5


def toy_tags() -> TagsInPassing:
    return tags_in(toy_house().plan, RADIUS_M, (COUNTER, TABLE, BED, DESK))


def recorded(folder: Path, task: Task, driver: str, *, chance: float, seed: int) -> Run:
    path = folder / "run.mcap"
    record_with_tags(path, toy_house(), toy_tags(), task, driver, chance=chance, seed=seed)
    return read(path)


def consistent_houses(evidence: Evidence, types: tuple[ItemType, ...]) -> Iterator[House]:
    """Every house in which open containers hold, besides what the log shows, some of these types at most once."""
    house = toy_house()
    subsets = [c for n in range(len(types) + 1) for c in combinations(types, n)]
    for filled in product(subsets, repeat=len(evidence.open)):
        contents: dict[ContainerId, tuple[Item, ...]] = dict(house.contents)
        for container, held in zip(evidence.open, filled, strict=True):
            shown = evidence.partly.get(container, ())
            more = (t for t in held if all(one.type != t for one in shown))
            contents[container] = (*shown, *(item(f"{t}|{container.replace('|', '')}") for t in more))
        yield House(plan=house.plan, contents=contents)


@pytest.mark.ci_but(3)
@pytest.mark.parametrize("seed", [0, 1, 2])
@pytest.mark.parametrize(("task", "types"), [(FIND, (PHONE,)), (BOTH, (PHONE, PLATE))], ids=["find", "both"])
@pytest.mark.parametrize("driver", ["opt-greedy", "conditioned-lios"])
def test_bounds_hold_whatever_is_seen_in_passing(
    tmp_path: Path, driver: str, task: Task, types: tuple[ItemType, ...], seed: int
) -> None:
    run, tags = recorded(tmp_path, task, driver, chance=0.5, seed=seed), toy_tags()
    ground = prepare_log(run, ReplaySettings(worlds=0))
    houses = list(consistent_houses(ground.evidence, types))
    rate = max(1, len(houses) // 8)
    for name in STRATEGIES:
        bounds = replay_on(ground, name).bounds
        assert bounds is not None
        costs = [
            outcome_of(list(events_with_tags(house, tags, task, name, chance=chance, seed=again))).cost
            for house in houses[seed % rate :: rate]
            for again, chance in enumerate((0.0, 0.3, 0.6, 1.0))
        ]
        if name == driver:
            assert ground.reproduction.whole
            assert run.outcome is not None
            assert bounds.exact
            assert bounds.lower == pytest.approx(run.outcome.cost)
            continue
        assert bounds.lower <= min(costs) + 1e-6, name
        assert bounds.upper >= max(costs) - 1e-6, name


@pytest.mark.parametrize("driver", ["opt-greedy", "conditioned-lios"])
def test_bounds_hold_where_a_look_may_have_missed_what_is_seen_in_passing(tmp_path: Path, driver: str) -> None:
    run, tags = recorded(tmp_path, BOTH, driver, chance=0.0, seed=0), toy_tags()
    ground = prepare_log(run, ReplaySettings(worlds=0, assumptions=Assumptions(misses=1)))
    house = toy_house()
    worlds = [
        House(plan=house.plan, contents={**house.contents, c: (*house.contents[c], item(f"{more}|9"))})
        for c in ground.evidence.doubtful
        for more in (PHONE, PLATE)
    ]
    for name in ("opt-greedy", "model-lios"):
        bounds = replay_on(ground, name).bounds
        assert bounds is not None
        assert bounds.upper < float("inf")
        costs = [
            outcome_of(list(events_with_tags(world, tags, BOTH, name, chance=chance, seed=0))).cost
            for world in worlds
            for chance in (0.0, 0.5, 1.0)
        ]
        assert all(bounds.lower - 1e-6 <= cost <= bounds.upper + 1e-6 for cost in costs), name


@pytest.mark.parametrize("seed", range(2))
@pytest.mark.parametrize("driver", ["opt-greedy", "pes-lios", "conditioned-lios"])
def test_a_run_that_turned_for_a_tag_is_reproduced(tmp_path: Path, driver: str, seed: int) -> None:
    run = recorded(tmp_path, BOTH, driver, chance=1.0, seed=seed)
    assert run.sightings
    verified = verify(run)
    assert verified.same, verified.divergence
    ground = prepare_log(run, ReplaySettings(worlds=0))
    assert ground.reproduction.same
    bounds, outcome = replay_on(ground, driver).bounds, run.outcome
    assert bounds is not None
    assert outcome is not None
    assert bounds.lower == bounds.upper == pytest.approx(outcome.cost)
    assert bounds.exact


def test_a_tag_in_passing_is_one_item_and_no_look(tmp_path: Path) -> None:
    """The phone was picked from the desk, which nobody looked into: what else lies there is open."""
    run = recorded(tmp_path, FIND, "pes-greedy", chance=1.0, seed=0)
    assert DESK not in {o.container for o in run.observations}
    evidence = prepare_log(run, ReplaySettings(worlds=0)).evidence
    assert {c: [i.id for i in items] for c, items in evidence.partly.items()} == {DESK: ["CellPhone|1"]}
    assert DESK in evidence.open
    assert any("in passing: it stood there at the start" in note for note in evidence.notes)
    assert run.outcome is not None
    assert run.outcome.status == "done"


def test_what_was_taken_without_a_look_is_not_there_at_a_later_one(tmp_path: Path) -> None:
    """Whether the log knows what else lay there, or a world says so."""
    run = recorded(tmp_path, FIND, "pes-greedy", chance=1.0, seed=0)
    evidence, phone = prepare_log(run, ReplaySettings(worlds=0)).evidence, item("CellPhone|1")
    pencil = item("Pencil|1")
    world = LoggedWorld(evidence, with_paths=False, filling=lambda _, __: (pencil,))
    world.knowledge = world.knowledge.sighted(DESK, phone)
    assert isinstance(world.go_to(LocationId(DESK)), ActionDone)
    assert isinstance(world.pick(phone.id), ActionDone)
    look = world.look_into(DESK)
    assert isinstance(look, LookResult)
    assert look.items == (pencil,)


def test_a_look_is_believed_rather_than_a_tag_in_passing(tmp_path: Path) -> None:
    run = recorded(tmp_path, FIND, "pes-greedy", chance=1.0, seed=0)
    (seen,) = run.sightings
    shown = SeenItem(id=seen.item.id, type=seen.item.type)
    look = Observation(stamp=run.plans[0].stamp, decision=1, container=BED, items=(shown,), robot_at=BED)
    evidence = evidence_of(replace(run, observations=(*run.observations, look)))
    assert DESK not in evidence.partly
    assert [i.id for i in evidence.contents[BED]] == [seen.item.id]
    assert any("by a look in Bed|2; it is read as standing there" in note for note in evidence.notes)


def test_an_interrupted_run_goes_on_by_a_look_where_a_tag_was_seen(tmp_path: Path) -> None:
    run = recorded(tmp_path, FIND, "pes-greedy", chance=1.0, seed=0)
    (seen,) = run.sightings
    acted = tuple(action for action in run.actions if action.stamp <= seen.stamp)
    before = replace(run, outcome=None, actions=acted, closed=False, complete=False, ended=False)
    known = known_from_logs([before], run.place.plan, run.place.travel)
    assert {c: [i.id for i in items] for c, items in known.put.items()} == {seen.container: [seen.item.id]}
    assert seen.container not in known.known


def test_nothing_is_certified_where_tags_in_passing_count(tmp_path: Path) -> None:
    run = recorded(tmp_path, FIND, "pes-greedy", chance=0.0, seed=0)
    with pytest.raises(NotCertifiable, match="tags"):
        certificate(prepare_log(run, ReplaySettings(worlds=0)), strategy("pes-greedy"))


def test_a_robot_without_tags_in_passing_is_replayed_as_before(tmp_path: Path) -> None:
    """The setting is left out of its log, and its own run is replayed exactly."""
    trial = Trial(house=toy_house(), task=BOTH, strategy="pes-lios", estimator="counts")
    end = record_trial(trial, tmp_path / "a.mcap")
    made = replay_on(prepare_log(read(tmp_path / "a.mcap"), ReplaySettings(worlds=0)), "pes-lios")
    assert made.exact
    assert made.cost == pytest.approx(end.cost)
