"""Runs in which looks miss: containers are looked into again, by posterior, until what must exist is found."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import pytest
from fake_world import FakeWorld
from toy import toy_house

from workbench.beliefs.estimators import estimator
from workbench.execution.events import BeliefUpdated, ContainerObserved, Event, FindCostsUpdated, RunEnded, RunStatus
from workbench.execution.loop import run_task
from workbench.planning.strategies import strategy
from workbench.planning.tasks import Task, find_task
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.house import START, ContainerId, ItemType
from workbench.worlds.perception import MAX_LOOKS, PERFECT, Perception
from workbench.worlds.world import LookResult

MUG, NOWHERE = ItemType("Mug"), ItemType("Vase")
HALF = Perception(p_detect=0.5)


@dataclass
class MissingWorld(FakeWorld):
    """The toy house; the first `misses` looks into each container show no mug."""

    misses: int = 1
    looks: dict[ContainerId, int] = field(default_factory=dict)

    def look_into(self, container: ContainerId):  # type: ignore[no-untyped-def]
        answer = super().look_into(container)
        assert isinstance(answer, LookResult)
        self.looks[container] = self.looks.get(container, 0) + 1
        if self.looks[container] > self.misses:
            return answer
        return replace(answer, items=tuple(i for i in answer.items if i.type != MUG))


def run(task: Task, *, misses: int, seen: Perception, name: str = "conditioned-lios") -> list[Event]:
    world = MissingWorld(misses=misses)
    return list(run_task(world, strategy(name), estimator("counts"), task, costs=SIMULATION_COSTS, perception=seen))


def looks_of(events: list[Event]) -> list[ContainerId]:
    return [e.container for e in events if isinstance(e, ContainerObserved) and not e.known_at_start]


@pytest.mark.parametrize("name", ["opt-greedy", "model-lios", "conditioned-lios", "scout-lios"])
def test_what_every_first_look_missed_is_found_by_another(name: str) -> None:
    events = run(find_task(MUG, START), misses=1, seen=HALF, name=name)
    ended, looked = events[-1], looks_of(events)
    assert isinstance(ended, RunEnded)
    assert ended.status is RunStatus.DONE
    every = [c.id for c in toy_house().plan.containers]
    assert sorted(looked[: len(every)]) == sorted(every), "each once before any again"
    assert looked[-1] in looked[:-1]


def test_a_robot_that_trusts_its_looks_gives_up() -> None:
    ended = run(find_task(MUG, START), misses=1, seen=PERFECT)[-1]
    assert isinstance(ended, RunEnded)
    assert ended.status is RunStatus.MIN_REMAINING_PROBABILITY


def test_what_may_not_exist_is_sought_for_so_many_looks() -> None:
    events = run(find_task(NOWHERE, START), misses=0, seen=HALF)
    looked = looks_of(events)
    assert {looked.count(c) for c in set(looked)} == {MAX_LOOKS}
    ended = events[-1]
    assert isinstance(ended, RunEnded)
    assert ended.status is RunStatus.MIN_REMAINING_PROBABILITY


def test_what_must_exist_is_sought_until_it_is_found() -> None:
    task = replace(find_task(MUG, START), available=(MUG,))
    events = run(task, misses=5, seen=HALF)
    ended = events[-1]
    assert isinstance(ended, RunEnded)
    assert ended.status is RunStatus.DONE
    assert max(looks_of(events).count(c) for c in set(looks_of(events))) == 6


def test_the_second_round_goes_by_the_posterior() -> None:
    events = run(find_task(MUG, START), misses=1, seen=HALF)
    beliefs = [e.belief for e in events if isinstance(e, BeliefUpdated)]
    first, again = beliefs[0], beliefs[len(toy_house().plan.containers)]
    prior, posterior = first.of(MUG), again.of(MUG)
    assert again.containers == first.containers
    assert posterior == pytest.approx(prior * 0.5 / (1 - prior + prior * 0.5))


def test_each_look_says_how_it_was_made() -> None:
    events = run(find_task(MUG, START), misses=1, seen=Perception(p_detect=0.5, source="site", detector="tags"))
    made = [e.look for e in events if isinstance(e, ContainerObserved)]
    assert all(look is not None for look in made)
    last = made[-1]
    assert last is not None
    assert (last.number, last.source, last.detector, last.p_detect) == (2, "site", "tags", ((MUG, 0.5),))
    assert all(
        e.look is None for e in run(find_task(MUG, START), misses=0, seen=PERFECT) if isinstance(e, ContainerObserved)
    )


def test_a_strategy_that_plans_with_repeated_looks_makes_them_where_it_stands() -> None:
    events = run(find_task(MUG, START), misses=1, seen=HALF, name="robust-lios")
    looked, ended = looks_of(events), events[-1]
    assert isinstance(ended, RunEnded)
    assert ended.status is RunStatus.DONE
    assert looked[0] == looked[1], "a look costs nothing, and half of them miss"
    assert ended.travel_m < sum(e.travel_m for e in run(find_task(MUG, START), misses=1, seen=HALF) if is_end(e))


def is_end(event: Event) -> bool:
    return isinstance(event, RunEnded)


def test_no_container_is_looked_into_for_ever_before_the_others() -> None:
    task = replace(find_task(MUG, START), available=(MUG,))
    events = run(task, misses=MAX_LOOKS, seen=HALF, name="robust-lios")
    looked, ended = looks_of(events), events[-1]
    assert isinstance(ended, RunEnded)
    assert ended.status is RunStatus.DONE
    every = [c.id for c in toy_house().plan.containers]
    first_round = looked[: MAX_LOOKS * len(every)]
    assert {first_round.count(c) for c in every} == {MAX_LOOKS}


def test_robust_lios_is_conditioned_lios_where_looks_show_everything() -> None:
    ours, theirs = (
        run(find_task(MUG, START), misses=0, seen=PERFECT, name=n) for n in ("robust-lios", "conditioned-lios")
    )
    assert looks_of(ours) == looks_of(theirs)
    prices = [
        [e.find_costs.metres.tobytes() for e in events if isinstance(e, FindCostsUpdated)]
        for events in (ours, theirs)
    ]
    assert prices[0] == prices[1] != []
