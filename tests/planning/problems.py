"""Random small problems with integer costs, for comparing solvers."""

from __future__ import annotations

import numpy as np

from workbench.planning.problem import Problem, problem_of
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding
from workbench.search.costs import ActionCosts
from workbench.search.find_costs import FindCosts
from workbench.worlds.geometry import Pose
from workbench.worlds.house import (
    START,
    Container,
    ContainerId,
    FloorPlan,
    Item,
    ItemId,
    ItemType,
    LocationId,
    Room,
    RoomId,
)
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.travel import TravelCosts

COSTS = ActionCosts(search=0.0, manipulation=5.0)


def grid_place(points: np.ndarray) -> tuple[FloorPlan, TravelCosts]:
    """Containers at grid points, Manhattan metres: a metric in whole numbers. The first point is the start."""
    containers = tuple(
        Container(
            id=ContainerId(f"Shelf|{i}"),
            type="Shelf",
            room=RoomId("room"),
            pose=Pose(x_m=float(x), y_m=float(y)),
            size_m=(0.5, 0.5, 0.5),
        )
        for i, (x, y) in enumerate(points[1:])
    )
    plan = FloorPlan(
        name="grid",
        rooms=(Room(id=RoomId("room"), kind="Kitchen", floor=((0, 0), (50, 0), (50, 50))),),
        walls=(),
        doors=(),
        windows=(),
        containers=containers,
        furniture=(),
        start=Pose(x_m=float(points[0][0]), y_m=float(points[0][1])),
    )
    metres = np.abs(points[:, None, :] - points[None, :, :]).sum(axis=2).astype(float)
    names = (START, *(LocationId(c.id) for c in containers))
    return plan, TravelCosts(locations=names, metres=metres)


def thing(kind: str, number: int) -> Item:
    return Item(id=ItemId(f"{kind}|{number}"), type=ItemType(kind))


def random_problem(
    goal_of: object, types: tuple[str, ...], *, seed: int, places: int = 5, known_share: float = 0.6
) -> Problem:
    """A problem over all places of a grid; each type is known at one or two places, in hand, or missing."""
    rng = np.random.default_rng(seed)
    plan, travel = grid_place(rng.integers(0, 12, size=(places, 2)))
    knowledge = knowledge_at_start(plan, travel, {})
    boxes = [c.id for c in plan.containers]
    filled: dict[ContainerId, list[Item]] = {}
    missing: list[ItemType] = []
    for kind in types:
        if rng.random() > known_share:
            missing.append(ItemType(kind))
            continue
        for number in range(int(rng.integers(1, 3))):
            filled.setdefault(boxes[int(rng.integers(len(boxes)))], []).append(thing(kind, number))
    for box in sorted(filled):
        knowledge = knowledge.seen(box, tuple(filled[box]))
    knowledge = knowledge.moved(travel.locations[int(rng.integers(len(travel.locations)))])
    here = knowledge.items_at.get(knowledge.robot_at, ())
    if here and rng.random() < 0.7:
        knowledge = knowledge.picked(here[0])
    assert callable(goal_of)
    goal: Goal = goal_of(rng, travel.locations)
    return problem_of(
        goal,
        knowledge,
        COSTS,
        locations=travel.locations,
        find_costs=_find_costs(tuple(missing), travel, knowledge, rng) if missing else None,
    )


def _find_costs(
    missing: tuple[ItemType, ...], travel: TravelCosts, knowledge: Knowledge, rng: np.random.Generator
) -> FindCosts:
    """As if each missing type were found at one place after a detour: obeys the triangle inequality."""
    n = len(travel.locations)
    metres = np.zeros((len(missing), n, n))
    for i in range(len(missing)):
        via, detour = int(rng.integers(n)), float(rng.integers(0, 20))
        metres[i] = travel.metres[:, via][:, None] + detour + 5 + travel.metres[via][None, :]
    return FindCosts(
        item_types=missing, origins=travel.locations, targets=travel.locations, metres=metres, kind="model"
    )


def find_back() -> Problem:
    """One place, where a missing mug is wanted: found and brought for 8, put down for 5."""
    plan, travel = grid_place(np.array([(0, 0), (1, 0)]))
    here, mug = travel.locations[:1], ItemType("Mug")
    found = FindCosts(item_types=(mug,), origins=here, targets=here, metres=np.full((1, 1, 1), 8.0), kind="model")
    knowledge = knowledge_at_start(plan, travel, {})
    goal = Delivered(item_type=mug, at=here[0])
    return problem_of(goal, knowledge, COSTS, locations=here, find_costs=found)


def place_for(rng: np.random.Generator, locations: tuple[LocationId, ...]) -> LocationId:
    return locations[int(rng.integers(len(locations)))]


def deliver_goal(*types: str) -> object:
    def goal(rng: np.random.Generator, locations: tuple[LocationId, ...]) -> Goal:
        return AllOf(parts=tuple(Delivered(item_type=ItemType(t), at=place_for(rng, locations)) for t in types))

    return goal


def any_goal(*types: str) -> object:
    def goal(rng: np.random.Generator, locations: tuple[LocationId, ...]) -> Goal:
        return AnyOf(parts=tuple(Delivered(item_type=ItemType(t), at=locations[0]) for t in types))

    return goal


def holding_goal(first: str, held: str) -> object:
    def goal(rng: np.random.Generator, locations: tuple[LocationId, ...]) -> Goal:
        return AllOf(
            parts=(
                Delivered(item_type=ItemType(first), at=place_for(rng, locations)),
                Holding(item_type=ItemType(held), at=place_for(rng, locations)),
            )
        )

    return goal


def breakfast_goal(rng: np.random.Generator, locations: tuple[LocationId, ...]) -> Goal:
    at = place_for(rng, locations)

    def dish(food: str, prop: str, below: str) -> Goal:
        return AllOf(
            parts=(
                Delivered(item_type=ItemType(food), at=at, properties=(prop,)),
                Delivered(item_type=ItemType(below), at=at),
            )
        )

    return AnyOf(parts=(dish("Egg", "boiled", "Bowl"), dish("Apple", "peeled", "Plate")))


def coffee_goal(rng: np.random.Generator, locations: tuple[LocationId, ...]) -> Goal:
    return Delivered(item_type=ItemType("Mug"), at=place_for(rng, locations), properties=("coffee",))
