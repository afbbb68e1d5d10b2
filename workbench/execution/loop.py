"""The closed execution loop: look, believe, plan and act until the goal is met or nothing more can be done.

Simulation, robot and replay run this loop on their World. It plans, executes the plan until it observes something
new, and plans again; a find executes one look at a time (paper, Sec. IV: "the robot replans after each observation
until the goal is met"). Every end is a status, never an exception.
"""

from __future__ import annotations

import time
from collections.abc import Callable, Generator, Iterator
from dataclasses import dataclass, field, replace

from workbench.beliefs.belief import Estimator
from workbench.beliefs.guarded_estimator import EstimatorFailed
from workbench.execution.estimator_queries import EstimatorQueries
from workbench.execution.events import (
    ActionEnded,
    BeliefUpdated,
    ContainerObserved,
    EstimatorAnswered,
    Event,
    FindCostsUpdated,
    PlanMade,
    RunEnded,
    RunStatus,
)
from workbench.execution.further_looks import how_looked, worth_another_look
from workbench.execution.goal_check import is_met
from workbench.execution.in_passing import in_passing, knowledge_after, looked_into, seen_in_words, unknown_in_words
from workbench.execution.legality import Legality, legality
from workbench.execution.reasons import ON_THE_WAY, after_look, after_plan
from workbench.execution.run_end import GOAL_MET, end_without_plan
from workbench.planning.actions import facts_after, relevant_types
from workbench.planning.plans import PlanStatus, PlanStep
from workbench.planning.strategy import Decision, Strategy, View
from workbench.planning.tasks import Task
from workbench.planning.warm_up import warm_up
from workbench.search.costs import ActionCosts
from workbench.worlds.house import START, ContainerId, Item, ItemId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge, knowledge_at_start
from workbench.worlds.perception import PERFECT, Perception
from workbench.worlds.world import ActionDone, ActionRefused, LookResult, NotInLog, World

MAX_REFUSALS = 3
"""Number of refusals of the same step that end the run."""

Stopwatch = Callable[[], float]


@dataclass(frozen=True, slots=True, kw_only=True)
class LoopOptions:
    """How far a run goes, where it begins, and what its planning times are measured by.

    Attributes:
        max_steps: actions after which the run ends with STEP_LIMIT.
        stopwatch: time source in seconds for planning times; all other stamps come from the world's clock.
        begin_with: knowledge to continue from, in a world in the same state, instead of the start; earlier
            observations are not reported again.
    """

    max_steps: int = 500
    stopwatch: Stopwatch = time.perf_counter
    begin_with: Knowledge | None = None


def run_task(
    world: World,
    strategy: Strategy,
    estimator: Estimator,
    task: Task,
    *,
    costs: ActionCosts,
    seed: int = 0,
    options: LoopOptions = LoopOptions(),
    perception: Perception = PERFECT,
) -> Iterator[Event]:
    """Run one task in one world with one strategy; yields events, the last of which is RunEnded.

    Args:
        world: the environment: simulation, robot, or log.
        strategy: the planner. It gets a frozen view, never the true house.
        estimator: computes beliefs.
        task: the goal, its failure cost and its planning budget.
        costs: action costs; moves cost their distance in metres.
        seed: passed to the strategy with every view.
        options: limits and clocks of the run.
        perception: how surely a look shows what is there, as the robot believes it. Where looks can miss, containers
            may be looked into again (further_looks.py).
    """
    return _Run(world, strategy, estimator, task, costs, seed, options, perception).events()


def outcome_of(events: list[Event]) -> RunEnded:
    """The final event of a run.

    Raises:
        ValueError: the events contain no RunEnded.
    """
    for event in reversed(events):
        if isinstance(event, RunEnded):
            return event
    raise ValueError("these events hold no end of a run")


@dataclass(slots=True)
class _Run:
    """The mutable state of one run in progress."""

    world: World
    strategy: Strategy
    estimator: Estimator
    task: Task
    costs: ActionCosts
    seed: int
    options: LoopOptions
    perception: Perception = PERFECT
    knowledge: Knowledge = field(init=False)
    queries: EstimatorQueries = field(init=False)
    decision: int = 0
    steps: int = 0
    searches: int = 0
    cost: float = 0.0
    travel_m: float = 0.0
    planning_s: float = 0.0
    refusals: dict[tuple[str, LocationId, tuple[ItemId, ...]], int] = field(default_factory=dict)
    sighted: set[ItemId] = field(default_factory=set[ItemId])
    ended: RunEnded | None = None
    reason: str = "start"

    def events(self) -> Iterator[Event]:
        self.queries = EstimatorQueries(self.estimator, self.task, self.perception)
        yield from self._start()
        while self.ended is None:
            if is_met(self.task.goal, self.knowledge):
                self._end(RunStatus.DONE, GOAL_MET)
            elif self.planning_s >= self.task.budget_s:
                self._end(RunStatus.OUT_OF_BUDGET, f"planning took its whole budget of {self.task.budget_s:g} s")
            else:
                yield from self._decide_and_act()
        yield self.ended

    def _start(self) -> Iterator[Event]:
        if self.options.begin_with is not None:
            self.knowledge = self.options.begin_with
            self._warm_up()
            return
        known = self.world.known_at_start()
        self.knowledge = knowledge_at_start(self.world.plan, self.world.travel, known)
        in_view = self.world.seen_at_start()
        for container in sorted(known):
            yield ContainerObserved(
                stamp_ns=self.world.now_ns(),
                decision=0,
                container=container,
                items=tuple(known[container]),
                robot_at=START,
                known_at_start=True,
                passing_from=in_view.get(container),
            )
        self._warm_up()

    def _warm_up(self) -> None:
        """Compile and load code in advance, so that it is not charged to the planning budget."""
        wanted = relevant_types(self.task.goal)
        warm_up(self.knowledge, self.estimator, tuple(t for t in wanted if t in (self.task.available or wanted)))

    def _decide_and_act(self) -> Iterator[Event]:
        self.decision += 1
        again = worth_another_look(self.knowledge, self.perception, self.task, self.strategy)
        self.knowledge = self.knowledge.with_another_look_at(again)
        began = self.options.stopwatch()
        believed_types = self.strategy.relevant_types(self.task)
        try:
            belief = self.queries.belief(self.knowledge, believed_types)
        except EstimatorFailed as error:
            self._end(RunStatus.ESTIMATOR_FAILED, str(error))
            return
        believed = self.options.stopwatch()
        made = self.strategy.decide(
            View(
                knowledge=self.knowledge,
                belief=belief,
                task=self.task,
                costs=self.costs,
                budget_s=self.task.budget_s - self.planning_s,
                seed=self.seed,
                perception=self.perception,
            )
        )
        planned = self.options.stopwatch()
        self.planning_s += planned - began
        stamp = self.world.now_ns()
        for answer in self.queries.new_answers(self.knowledge, believed_types):
            yield EstimatorAnswered(stamp_ns=stamp, decision=self.decision, answer=answer)
        yield BeliefUpdated(stamp_ns=stamp, decision=self.decision, belief=belief)
        if made.find_costs is not None:
            yield FindCostsUpdated(stamp_ns=stamp, decision=self.decision, find_costs=made.find_costs)
        yield PlanMade(
            stamp_ns=stamp,
            decision=self.decision,
            robot_at=self.knowledge.robot_at,
            reason=self.reason,
            made=made,
            belief_s=believed - began,
            planning_s=planned - believed,
        )
        yield from self._execute_plan(made)

    def _execute_plan(self, made: Decision) -> Iterator[Event]:
        """Execute the plan until something new is observed, a step is refused, or the plan is finished."""
        if made.plan.status is not PlanStatus.SOLVED:
            self._end(*end_without_plan(made, nothing_left=not self.knowledge.unsearched))
            return
        if made.look_on_the_way:
            yield from self._look(ContainerId(made.look_on_the_way[0]), (), why=ON_THE_WAY)
            return
        if not made.plan.steps:
            self._end(RunStatus.PLANNER_FAILED, "the plan is empty, but the goal is not met")
            return
        for step in made.plan.steps[: made.steps_now]:
            checked = legality(step, self.knowledge, made)
            if checked.kind is not Legality.LEGAL:
                self._end(RunStatus.PLANNER_FAILED, f"illegal step '{step}': {checked.message}")
                return
            if step.action == "find":
                yield from self._look(made.search_order[0].container, step.item_types, why="")
                return
            if not (yield from self._act(step)):
                return
        self.reason = after_plan(made)

    def _look(self, container: ContainerId, sought: tuple[ItemType, ...], *, why: str) -> Iterator[Event]:
        """Go to a container and look into it: one step of a find."""
        place = LocationId(container)
        if container not in self.knowledge.unsearched:
            self._end(RunStatus.PLANNER_FAILED, f"wants to look into {container}, which is not unsearched")
            return
        if self.knowledge.robot_at != place:
            went = yield from self._act(
                PlanStep(
                    action="move",
                    origin=self.knowledge.robot_at,
                    target=place,
                    cost=self.world.travel.between(self.knowledge.robot_at, place) or 0.0,
                ),
                seeking=sought,
            )
            if not went:
                return
        step = PlanStep(action="search", origin=place, target=place, cost=self.costs.search)
        answer = self.world.look_into(container)
        if isinstance(answer, NotInLog):
            self._end(RunStatus.UNDETERMINED, unknown_in_words(answer, place), unseen=container)
            return
        self.searches += 1
        yield self._acted(step, answer, self.costs.search)
        if isinstance(answer, ActionRefused):
            self.knowledge = self.knowledge.refuse_search(container)
            self.reason = f"could not search {container}: {answer.reason}"
            return
        again = container in self.knowledge.first_seen
        before, self.knowledge = self.knowledge, looked_into(self.knowledge, answer, self.sighted)
        self.reason = after_look(container, answer.items, sought, again=again, why=why)
        yield ContainerObserved(
            stamp_ns=answer.end_ns,
            decision=self.decision,
            container=container,
            items=answer.items,
            robot_at=place,
            support=answer.support,
            opened_by=answer.opened_by,
            look=how_looked(
                container,
                before.looks(container) + 1,
                perception=self.perception,
                task=self.task,
                viewpoint=self.world.paths.standing_pose(place),
                duration_ns=answer.end_ns - answer.start_ns,
            ),
        )

    def _act(self, step: PlanStep, *, seeking: tuple[ItemType, ...] | None = None) -> Generator[Event, None, bool]:
        """Execute one step other than a find; returns whether to continue with the plan.

        Args:
            seeking: the item types sought, for the move of a find.
        """
        answer = self._request_action(step, seeking)
        if isinstance(answer, NotInLog):
            self._end(RunStatus.UNDETERMINED, unknown_in_words(answer, step.target), unseen=answer.container)
            return False
        if isinstance(answer, ActionDone) and (answer.seen or answer.items_seen):
            return (yield from self._passed(step, answer))
        yield self._acted(step, answer, answer.travel_m if step.action == "move" else self.costs.manipulation)
        if isinstance(answer, ActionRefused):
            self._refused(step, answer)
            return False
        self._advance(step)
        return self.ended is None

    def _passed(self, step: PlanStep, answer: ActionDone) -> Generator[Event, None, bool]:
        """A move on which containers or items came into view: these are known at once, and the run decides again."""
        yield from in_passing(
            answer, decision=self.decision, before=self.knowledge, perception=self.perception, task=self.task
        )
        stopped = step if answer.ended_at is None else replace(step, target=answer.ended_at)
        yield self._acted(stopped, answer, answer.travel_m)
        self.knowledge = knowledge_after(self.knowledge, answer, robot_at=stopped.target, travel=self.world.travel)
        self.sighted |= {seen.item.id for seen in answer.items_seen}
        self.reason = seen_in_words(answer)
        return False

    def _request_action(
        self, step: PlanStep, seeking: tuple[ItemType, ...] | None
    ) -> ActionDone | NotInLog | ActionRefused:
        if step.action == "move":
            return self.world.go_to(step.target, seeking=seeking)
        if step.action == "pick":
            return self.world.pick(step.items[0])
        if step.action == "place":
            return self.world.place(step.items[0])
        return self.world.prepare(step.action, step.items)

    def _advance(self, step: PlanStep) -> None:
        knowledge = self.knowledge
        if step.action == "move":
            if knowledge.travel is not self.world.travel:  # the robot had stopped on the way
                knowledge = replace(knowledge, travel=self.world.travel)
            self.knowledge = knowledge.moved(step.target)
        elif step.action == "pick":
            self.knowledge = knowledge.picked(_item_here(knowledge, step.items[0]))
        elif step.action == "place":
            self.knowledge = knowledge.placed()
        else:
            self.knowledge = knowledge.with_facts(facts_after(step, knowledge.facts))

    def _refused(self, step: PlanStep, answer: ActionRefused) -> None:
        """Update the knowledge after a refusal: an item is gone, or a container is unreachable."""
        if answer.at is not None:
            self.knowledge = self.knowledge.moved(answer.at)
        if step.action == "pick" and not answer.item_remains:
            self.knowledge = self.knowledge.without_item(step.items[0])
        elif step.action == "move" and step.target in self.knowledge.unsearched:
            self.knowledge = self.knowledge.refuse_search(ContainerId(step.target))
        self.reason = f"'{step}' was refused: {answer.reason}"
        key = (step.action, step.target, step.items)
        self.refusals[key] = self.refusals.get(key, 0) + 1
        if self.refusals[key] >= MAX_REFUSALS:
            self._end(RunStatus.ABORTED, f"{self.reason} ({MAX_REFUSALS} times)")

    def _acted(self, step: PlanStep, answer: ActionDone | LookResult | ActionRefused, cost: float) -> ActionEnded:
        done = not isinstance(answer, ActionRefused)
        travel = 0.0 if isinstance(answer, LookResult) else answer.travel_m
        charged = cost if done else travel
        self.cost += charged
        self.travel_m += travel
        self.steps += 1
        if self.steps >= self.options.max_steps and self.ended is None:
            self._end(RunStatus.STEP_LIMIT, f"{self.options.max_steps} actions without meeting the goal")
        return ActionEnded(
            stamp_ns=answer.end_ns,
            decision=self.decision,
            index=self.steps,
            start_ns=answer.start_ns,
            step=step,
            cost=charged,
            success=done,
            travel_m=travel,
            path=() if isinstance(answer, LookResult) else answer.path,
            standing=self.world.paths.standing_pose(step.target) if done else None,
            items=step.items,
            reason=answer.reason if isinstance(answer, ActionRefused) else "",
            support="" if isinstance(answer, ActionRefused) else answer.support,
            item_remains=isinstance(answer, ActionRefused) and answer.item_remains,
        )

    def _end(self, status: RunStatus, reason: str, *, unseen: ContainerId | None = None) -> None:
        done = status is RunStatus.DONE
        self.ended = RunEnded(
            stamp_ns=self.world.now_ns(),
            decision=self.decision,
            status=status,
            cost=self.cost if done or status is RunStatus.UNDETERMINED else self.task.failure_cost,
            own_cost=self.cost,
            reason=reason,
            searches=self.searches,
            travel_m=self.travel_m,
            unseen=unseen,
        )


def _item_here(knowledge: Knowledge, item_id: ItemId) -> Item:
    for item in knowledge.items_at.get(knowledge.robot_at, ()):
        if item.id == item_id:
            return item
    raise KeyError(item_id)
