"""The closed loop over the toy house (tests/toy.py): every course and end of a run, worked out by hand."""

from __future__ import annotations

from dataclasses import dataclass, field, replace

import pytest
from fake_world import EvenEstimator, FakeWorld
from toy import BED, COUNTER, DESK, FRIDGE, TABLE

from workbench.beliefs.belief import Belief
from workbench.execution.events import (
    ActionEnded,
    BeliefUpdated,
    ContainerObserved,
    Event,
    PlanMade,
    RunEnded,
    RunStatus,
)
from workbench.execution.loop import MAX_REFUSALS, LoopOptions, outcome_of, run_task
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import AllOf, Delivered, Task, find_task
from workbench.search.costs import ROBOT_COSTS, SIMULATION_COSTS, ActionCosts
from workbench.search.find_costs import SearchStop
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge

MUG, BOOK = ItemType("Mug"), ItemType("Book")


@dataclass
class InOrder:
    """Looks into containers in a given order for one type, then picks it up and carries it to the goal."""

    order: tuple[ContainerId, ...]
    sought: ItemType = MUG
    goal_at: LocationId = START
    name: str = "in-order"
    views: list[View] = field(default_factory=list)

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return (self.sought,)

    def decide(self, view: View) -> Decision:
        self.views.append(view)
        known = view.knowledge
        here = known.robot_at
        places = known.where(self.sought)
        if known.holding is not None:
            return _decision(PlanStep(action="move", origin=here, target=self.goal_at))
        if places:
            at, item = places[0]
            moves = () if at == here else (PlanStep(action="move", origin=here, target=at),)
            pick = PlanStep(action="pick", origin=at, target=at, items=(item.id,), item_types=(item.type,))
            return _decision(*moves, pick, PlanStep(action="move", origin=at, target=self.goal_at))
        left = [c for c in self.order if c in known.unsearched]
        if not left:
            return Decision(plan=Plan(status=PlanStatus.NO_PLAN))
        stop = SearchStop(container=left[0], probability=0.3, reached=1.0, leg_m=0.0)
        find = PlanStep(action="find", origin=here, target=self.goal_at, item_types=(self.sought,))
        return replace(_decision(find), search_order=(stop,))


def _decision(*steps: PlanStep) -> Decision:
    return Decision(plan=Plan(status=PlanStatus.SOLVED, steps=steps))


class Says:
    """Answers the same decision for ever."""

    name = "says"

    def __init__(self, decision: Decision) -> None:
        self._decision = decision

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return (MUG,)

    def decide(self, view: View) -> Decision:
        return self._decision


def _run(
    world: FakeWorld, strategy: InOrder | Says, task: Task | None = None, costs: ActionCosts = SIMULATION_COSTS
) -> list[Event]:
    return list(run_task(world, strategy, EvenEstimator(), task or find_task(MUG, START), costs=costs))


def test_a_find_costs_its_way_and_the_pick() -> None:
    # start -> fridge 2, fridge -> counter 1, pick 5, counter -> start 2: 10
    events = _run(FakeWorld(), InOrder((FRIDGE, COUNTER)))
    end = outcome_of(events)
    assert (end.status, end.cost, end.searches, end.travel_m) == (RunStatus.DONE, 10.0, 2, 5.0)
    assert [e.container for e in events if isinstance(e, ContainerObserved)] == [FRIDGE, COUNTER]
    assert [e.reason for e in events if isinstance(e, PlanMade)] == [
        "start",
        f"searched {FRIDGE}",
        f"found Mug in {COUNTER}",
    ]
    assert [e.step.action for e in events if isinstance(e, ActionEnded)] == [
        "move",
        "search",
        "move",
        "search",
        "pick",
        "move",
    ]


def test_search_costs_what_the_setting_says() -> None:
    assert outcome_of(_run(FakeWorld(), InOrder((FRIDGE, COUNTER)), costs=ROBOT_COSTS)).cost == 12.0


def test_what_is_known_at_the_start_is_not_searched() -> None:
    events = _run(FakeWorld(known=(COUNTER,)), InOrder((FRIDGE, COUNTER)))
    end = outcome_of(events)
    assert (end.cost, end.searches) == (9.0, 0)
    assert [e.known_at_start for e in events if isinstance(e, ContainerObserved)] == [True]


def test_beliefs_cover_what_is_unsearched() -> None:
    events = _run(FakeWorld(), InOrder((FRIDGE, COUNTER)))
    axes = [e.belief.containers for e in events if isinstance(e, BeliefUpdated)]
    assert [len(a) for a in axes] == [5, 4, 3]
    assert FRIDGE not in axes[1]


def test_a_log_that_lacks_the_answer_ends_undetermined() -> None:
    end = outcome_of(_run(FakeWorld(unseen=frozenset({BED})), InOrder((FRIDGE, BED))))
    assert (end.status, end.unseen) == (RunStatus.UNDETERMINED, BED)
    assert end.own_cost == 9.0  # start -> fridge 2, fridge -> bed 7


def test_an_item_that_vanishes_is_looked_for_elsewhere() -> None:
    world = FakeWorld(refuse={("pick", "Mug|1"): 1})
    end = outcome_of(_run(world, InOrder((COUNTER, DESK))))
    # start -> counter 2, counter -> desk 7, pick 5, desk -> start 7
    assert (end.status, end.cost) == (RunStatus.DONE, 21.0)


def test_a_container_that_cannot_be_searched_is_left_out() -> None:
    events = _run(FakeWorld(refuse={("search", COUNTER): 99}), InOrder((COUNTER, DESK)))
    assert outcome_of(events).status is RunStatus.DONE
    assert COUNTER not in [e for e in events if isinstance(e, BeliefUpdated)][-1].belief.containers


def test_a_way_that_is_blocked_for_good_ends_the_run() -> None:
    end = outcome_of(_run(FakeWorld(refuse={("move", START): 99}), InOrder((COUNTER,))))
    assert end.status is RunStatus.ABORTED
    assert f"({MAX_REFUSALS} times)" in end.reason
    assert end.cost == 400.0


def test_nothing_left_to_search() -> None:
    gone = ItemType("Unicorn")
    end = outcome_of(
        _run(FakeWorld(), InOrder((FRIDGE, COUNTER, TABLE, BED, DESK), sought=gone), find_task(gone, START))
    )
    assert (end.status, end.searches, end.cost) == (RunStatus.MIN_REMAINING_PROBABILITY, 5, 400.0)


def test_a_goal_already_met_costs_nothing() -> None:
    task = Task(scenario="t", goal=Delivered(item_type=MUG, at=LocationId(COUNTER)), failure_cost=9, budget_s=9)
    events = _run(FakeWorld(known=(COUNTER,)), InOrder(()), task)
    assert (outcome_of(events).status, outcome_of(events).cost) == (RunStatus.DONE, 0.0)
    assert not [e for e in events if isinstance(e, PlanMade)]


def test_two_parts_of_a_goal_need_two_instances() -> None:
    both = AllOf(parts=(Delivered(item_type=MUG, at=LocationId(COUNTER)),) * 2)
    task = Task(scenario="t", goal=both, failure_cost=9, budget_s=9)
    end = outcome_of(_run(FakeWorld(known=(COUNTER,)), Says(_decision()), task))
    assert end.status is RunStatus.PLANNER_FAILED


def test_a_budget_of_zero_fails_before_planning() -> None:
    task = replace(find_task(MUG, START), budget_s=0.0)
    events = _run(FakeWorld(), InOrder((COUNTER,)), task)
    assert outcome_of(events).status is RunStatus.OUT_OF_BUDGET
    assert len(events) == 1


@pytest.mark.parametrize(
    ("step", "says"),
    [
        (PlanStep(action="fly", origin=START, target=START), "no action 'fly'"),
        (PlanStep(action="move", origin=LocationId(BED), target=START), "starts at"),
        (PlanStep(action="move", origin=START, target=LocationId("moon")), "cannot be reached"),
        (PlanStep(action="pick", origin=START, target=START, items=("Mug|1",)), "not known to be"),
        (PlanStep(action="pick", origin=START, target=START), "names no item"),
        (PlanStep(action="place", origin=START, target=START, items=("Mug|1",)), "does not hold"),
        (PlanStep(action="boil", origin=START, target=START, items=("Egg|1", "Pot|1")), "not at hand"),
        (PlanStep(action="find", origin=START, target=START, item_types=(MUG,)), "names no container"),
    ],
)
def test_an_illegal_plan_is_a_status(step: PlanStep, says: str) -> None:
    end = outcome_of(_run(FakeWorld(), Says(_decision(step))))
    assert end.status is RunStatus.PLANNER_FAILED
    assert says in end.reason


@pytest.mark.parametrize(
    ("plan_status", "run_status"),
    [
        (PlanStatus.NO_PLAN, RunStatus.NO_PLAN),
        (PlanStatus.TIMED_OUT, RunStatus.OUT_OF_BUDGET),
        (PlanStatus.SOLVER_FAILED, RunStatus.PLANNER_FAILED),
    ],
)
def test_no_plan_is_told_apart_from_no_plan_in_time(plan_status: PlanStatus, run_status: RunStatus) -> None:
    end = outcome_of(_run(FakeWorld(), Says(Decision(plan=Plan(status=plan_status)))))
    assert (end.status, end.cost) == (run_status, 400.0)


def test_a_plan_that_goes_round_in_circles_meets_the_step_limit() -> None:
    there = PlanStep(action="move", origin=START, target=LocationId(TABLE))
    back = PlanStep(action="move", origin=LocationId(TABLE), target=START)
    events = list(
        run_task(
            FakeWorld(),
            Says(_decision(there, back)),
            EvenEstimator(),
            find_task(MUG, START),
            costs=SIMULATION_COSTS,
            options=LoopOptions(max_steps=7),
        )
    )
    assert outcome_of(events).status is RunStatus.STEP_LIMIT
    assert len([e for e in events if isinstance(e, ActionEnded)]) == 7


def test_a_look_on_the_way_comes_before_the_plan() -> None:
    @dataclass
    class Curious(InOrder):
        def decide(self, view: View) -> Decision:
            made = super().decide(view)
            return replace(made, look_on_the_way=(LocationId(TABLE),)) if TABLE in view.knowledge.unsearched else made

    events = _run(FakeWorld(), Curious((FRIDGE, COUNTER)))
    assert [e.container for e in events if isinstance(e, ContainerObserved)] == [TABLE, FRIDGE, COUNTER]
    assert outcome_of(events).cost == 1 + 3 + 1 + 5 + 2


def test_a_plan_may_be_walked_in_part() -> None:
    steps = tuple(
        PlanStep(action="move", origin=a, target=b)
        for a, b in ((START, LocationId(TABLE)), (LocationId(TABLE), LocationId(DESK)))
    )
    says = Says(replace(_decision(*steps), steps_now=1))
    events = list(
        run_task(
            FakeWorld(),
            says,
            EvenEstimator(),
            find_task(MUG, START),
            costs=SIMULATION_COSTS,
            options=LoopOptions(max_steps=7),
        )
    )
    acted = [e.step for e in events if isinstance(e, ActionEnded)]
    assert acted == [steps[0]], "the second decision begins where the first stopped, and its first step does not fit"
    assert [e.reason for e in events if isinstance(e, PlanMade)] == ["start", "the next steps are decided anew"]


def test_a_view_is_frozen_and_holds_no_truth() -> None:
    strategy = InOrder((FRIDGE, COUNTER))
    _run(FakeWorld(), strategy)
    first = strategy.views[0]
    with pytest.raises(AttributeError):
        first.budget_s = 1.0  # type: ignore[misc]
    with pytest.raises(TypeError):
        first.knowledge.items_at[START] = ()  # type: ignore[index]
    assert not first.knowledge.first_seen


def test_the_same_seed_gives_the_same_events() -> None:
    def stripped(events: list[Event]) -> list[str]:
        return [
            repr(replace(e, belief_s=0.0, planning_s=0.0)) if isinstance(e, PlanMade) else repr(e) for e in events
        ]

    once, twice = (stripped(_run(FakeWorld(), InOrder((BED, FRIDGE, COUNTER)))) for _ in range(2))
    assert once == twice
    assert isinstance(_run(FakeWorld(), InOrder((COUNTER,)))[-1], RunEnded)


def test_what_is_loaded_once_is_not_charged_to_the_planning_budget() -> None:
    class SlowToLoad(EvenEstimator):
        name = "slow to load"
        clock_s = 0.0
        calls = 0

        def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
            self.calls += 1
            self.clock_s += 1000.0 if self.calls == 1 else 0.0
            return super().believe(knowledge, item_types)

    slow = SlowToLoad()
    world, strategy, task = FakeWorld(), InOrder((FRIDGE, COUNTER)), find_task(MUG, START)
    events = list(
        run_task(
            world, strategy, slow, task, costs=SIMULATION_COSTS, options=LoopOptions(stopwatch=lambda: slow.clock_s)
        )
    )
    assert outcome_of(events).status is RunStatus.DONE
    assert slow.calls == 1 + outcome_of(events).decision
