"""The typed problem: steps advance the state, illegal ones are named, parts of a goal hold by different items."""

from __future__ import annotations

import numpy as np
import pytest
from problems import COSTS, deliver_goal, grid_place, random_problem
from toy import BED, COUNTER, DESK, item, toy_plan, toy_travel

from workbench.planning.actions import BY_NAME, prepares, relevant_types
from workbench.planning.builtin.solver import solve
from workbench.planning.plans import PlanStatus, PlanStep
from workbench.planning.problem import (
    IllegalStep,
    Problem,
    apply,
    goal_alternatives,
    holds,
    initial_state,
    missing_types,
    problem_of,
    relevant_locations,
)
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Goal, Holding
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.house import START, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.travel import TravelCosts

MUG, EGG = ItemType("Mug"), ItemType("Egg")


def everything_known() -> Knowledge:
    knowledge = knowledge_at_start(toy_plan(), toy_travel(), {})
    knowledge = knowledge.seen(COUNTER, (item("Mug|1"), item("Pot|1"), item("Egg|1")))
    knowledge = knowledge.seen(DESK, (item("Mug|2"),))
    for container in knowledge.unsearched:
        knowledge = knowledge.seen(container, ())
    return knowledge


def problem(goal: Goal, knowledge: Knowledge) -> Problem:
    places = relevant_locations(goal, knowledge)
    return problem_of(goal, knowledge, SIMULATION_COSTS, locations=places, find_costs=None)


def test_two_mugs_at_one_place_need_two_mugs() -> None:
    goal = AllOf(parts=(Delivered(item_type=MUG, at=LocationId(BED)), Delivered(item_type=MUG, at=LocationId(BED))))
    made = solve(problem(goal, everything_known())).plan
    assert made.status is PlanStatus.SOLVED
    assert sorted(step.items[0] for step in made.steps if step.action == "place") == ["Mug|1", "Mug|2"]
    # start -> counter 2, pick 5, -> bed 6, place 5, -> desk 2, pick 5, -> bed 2, place 5
    assert made.cost == 32


def test_boiling_in_place_costs_one_action() -> None:
    goal = Delivered(item_type=EGG, at=LocationId(COUNTER), properties=("boiled",))
    made = solve(problem(goal, everything_known())).plan
    assert [str(step) for step in made.steps] == ["move -> CounterTop|1", "boil Egg|1 Pot|1 @ CounterTop|1"]
    assert made.cost == 2 + 5


def test_a_goal_already_met_needs_nothing() -> None:
    made = solve(problem(Delivered(item_type=MUG, at=LocationId(DESK)), everything_known())).plan
    assert (made.status, made.steps, made.cost, made.optimal) == (PlanStatus.SOLVED, (), 0, True)


@pytest.mark.parametrize(
    "goal",
    [
        Delivered(item_type=ItemType("Unicorn"), at=LocationId(DESK)),
        Delivered(item_type=MUG, at=LocationId(DESK), properties=("toasted",)),
        Delivered(item_type=MUG, at=LocationId(DESK), properties=("golden",)),
        AllOf(parts=(Holding(item_type=MUG, at=START), Holding(item_type=EGG, at=START))),
        AllOf(parts=(Holding(item_type=MUG, at=START), Holding(item_type=MUG, at=LocationId(BED)))),
        AllOf(
            parts=tuple(Delivered(item_type=EGG, at=LocationId(place)) for place in (BED, DESK)),
        ),
        Delivered(item_type=MUG, at=LocationId("Moon|1")),
    ],
)
def test_what_cannot_be_is_proven_not_timed_out(goal: Goal) -> None:
    made = solve(problem(goal, everything_known())).plan
    assert made.status is PlanStatus.NO_PLAN
    assert made.note


def test_illegal_steps_are_named() -> None:
    state = initial_state(problem(Delivered(item_type=MUG, at=LocationId(BED)), everything_known()))
    pick = PlanStep(action="pick", origin=START, target=START, items=(ItemId("Mug|1"),))
    with pytest.raises(IllegalStep, match=r"Mug\|1 is not here"):
        apply(pick, state)
    with pytest.raises(IllegalStep, match="the robot is at start"):
        apply(PlanStep(action="move", origin=LocationId(BED), target=START), state)
    with pytest.raises(IllegalStep, match="no such action"):
        apply(PlanStep(action="fly", origin=START, target=START, items=(ItemId("Mug|1"),)), state)


def test_every_preparation_gives_what_it_says() -> None:
    for preparation in BY_NAME.values():
        assert any(part.gains for part in preparation.parts)
        for part in preparation.parts:
            for prop in part.gains:
                assert prepares(Delivered(item_type=part.types[0], at=START, properties=(prop,)))


def test_relevant_types_follow_preparations() -> None:
    coffee = Delivered(item_type=MUG, at=START, properties=("coffee",))
    assert relevant_types(coffee) == ("CoffeeGrinds", "CoffeeMachine", "Kettle", "Mug", "Pot", "WaterBottle")
    assert not prepares(Delivered(item_type=MUG, at=START))


def test_ways_of_nested_goals() -> None:
    a, b, c = (Delivered(item_type=ItemType(t), at=START) for t in "ABC")
    assert goal_alternatives(AllOf(parts=(a, AnyOf(parts=(b, c))))) == ((a, b), (a, c))
    assert goal_alternatives(AnyOf(parts=(a, a))) == ((a,),)


def test_missing_types_are_those_too_few_are_known_of() -> None:
    knowledge = knowledge_at_start(toy_plan(), toy_travel(), {COUNTER: (item("Mug|1"),)})
    two = AllOf(parts=tuple(Delivered(item_type=MUG, at=LocationId(place)) for place in (BED, DESK)))
    assert missing_types(two, knowledge, ()) == (MUG,)
    assert missing_types(Delivered(item_type=MUG, at=START), knowledge, ()) == ()
    assert missing_types(Delivered(item_type=EGG, at=START), knowledge, (MUG,)) == ()
    assert missing_types(Delivered(item_type=MUG, at=START), knowledge, (), find_known=True) == (MUG,)


def test_what_is_known_out_of_reach_is_still_missing() -> None:
    """The only mug that is known stands on a counter that nobody can get to: another is searched for."""
    all_places = toy_travel()
    keep = [i for i, place in enumerate(all_places.locations) if place != COUNTER]
    travel = TravelCosts(
        locations=tuple(all_places.locations[i] for i in keep),
        metres=all_places.metres[np.ix_(keep, keep)],
        unreachable=(COUNTER,),
    )
    knowledge = knowledge_at_start(toy_plan(), travel, {COUNTER: (item("Mug|1"),)})
    assert missing_types(Delivered(item_type=MUG, at=START), knowledge, ()) == (MUG,)


def test_a_thing_is_staged_on_the_way_when_that_pays() -> None:
    """At 0 stands A for 60, at 20 stands B for 21: A is put down at 20, B brought to 21, then A goes on."""
    import numpy as np

    plan, travel = grid_place(np.array([[0, 0], [0, 0], [20, 0], [21, 0], [60, 0]]))
    box = [c.id for c in plan.containers]
    knowledge = knowledge_at_start(plan, travel, {box[0]: (item("A|1"),), box[1]: (item("B|1"),)})
    wants = ((ItemType("A"), box[3]), (ItemType("B"), box[2]))
    goal = AllOf(parts=tuple(Delivered(item_type=t, at=LocationId(at)) for t, at in wants))
    places = relevant_locations(goal, knowledge)
    made = solve(problem_of(goal, knowledge, COSTS, locations=places, find_costs=None)).plan
    assert made.cost == 20 + 1 + 1 + 40 + 6 * 5
    assert made.optimal


def test_plans_replay_through_apply() -> None:
    for seed in range(5):
        case = random_problem(deliver_goal("Mug", "Book"), ("Mug", "Book"), seed=seed)
        state = initial_state(case)
        for step in solve(case).plan.steps:
            state = apply(step, state)
        assert holds(case.goal, state, case)
