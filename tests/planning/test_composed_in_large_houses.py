"""Planning in a house of 108 containers; the paper left out every house of more than 40."""

from __future__ import annotations

import pytest

from workbench.beliefs.estimators import estimator
from workbench.execution.events import PlanMade, RunStatus
from workbench.execution.loop import outcome_of, run_task
from workbench.planning.scenarios.paper import make_task, with_scenario_items
from workbench.planning.strategies import STRATEGIES, strategy
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.geometry import Pose
from workbench.worlds.house import Container, ContainerId, FloorPlan, House, Item, ItemId, ItemType, Room, RoomId
from workbench.worlds.maps.navigation import Navigation, navigate
from workbench.worlds.simulated import SimulatedWorld

ROWS, COLUMNS, APART_M = 9, 12, 2.0
KINDS = ("CounterTop", "Shelf", "Fridge", "DiningTable", "Cabinet", "Dresser", "SideTable", "ShelvingUnit")
HELD = ("Egg", "Pot", "Kettle", "Bowl", "Plate", "Bread", "Toaster", "Apple", "Knife", "Mug", "Book", "Vase")


@pytest.fixture(scope="module")
def hall() -> tuple[House, Navigation]:
    """One hall with containers in rows; every item type stands in three of them, far apart."""
    places = [(column, row) for row in range(ROWS) for column in range(COLUMNS)]
    containers = tuple(
        Container(
            id=ContainerId(f"{KINDS[i % len(KINDS)]}|{i}"),
            type=KINDS[i % len(KINDS)],
            room=RoomId("hall"),
            pose=Pose(x_m=1.5 + APART_M * column, y_m=1.5 + APART_M * row),
            size_m=(0.6, 0.6, 0.9),
        )
        for i, (column, row) in enumerate(places)
    )
    wide, deep = APART_M * COLUMNS + 1, APART_M * ROWS + 1
    plan = FloorPlan(
        name="hall",
        rooms=(Room(id=RoomId("hall"), kind="Kitchen", floor=((0, 0), (wide, 0), (wide, deep), (0, deep))),),
        walls=(),
        doors=(),
        windows=(),
        containers=containers,
        furniture=(),
        start=Pose(x_m=0.5, y_m=0.5),
    )
    contents: dict[ContainerId, tuple[Item, ...]] = {c.id: () for c in containers}
    for k, kind in enumerate(HELD):
        for copy in range(3):
            at = containers[(17 * k + 41 * copy + 30) % len(containers)].id
            contents[at] = (*contents[at], Item(id=ItemId(f"{kind}|{copy}"), type=ItemType(kind)))
    return House(plan=plan, contents=contents), navigate(plan)


def run(hall: tuple[House, Navigation], scenario: str, name: str) -> list[float]:
    """Planning seconds of every decision of a run that must be done."""
    house, navigation = hall
    house = with_scenario_items(scenario, house, seed=1)
    task = make_task(scenario, house, seed=1, travel=navigation.travel)
    world = SimulatedWorld(house, navigation, known=())
    made = strategy(name, house=house)
    events = list(run_task(world, made, estimator("counts"), task, costs=SIMULATION_COSTS, seed=1))
    end = outcome_of(events)
    assert end.status is RunStatus.DONE, end.reason
    return [event.planning_s for event in events if isinstance(event, PlanMade)]


@pytest.mark.ci_but(1)
@pytest.mark.parametrize("scenario", ["deliver-3", "breakfast+coffee"])
def test_ours_plans_over_a_hundred_containers(hall: tuple[House, Navigation], scenario: str) -> None:
    assert len(hall[0].plan.containers) == 108
    run(hall, scenario, "scout-lios")


@pytest.mark.slow
@pytest.mark.parametrize("scenario", ["deliver-3", "breakfast", "coffee", "breakfast+coffee", "any-of-three"])
@pytest.mark.parametrize("name", STRATEGIES)
def test_every_strategy_does_every_scenario(hall: tuple[House, Navigation], scenario: str, name: str) -> None:
    run(hall, scenario, name)
