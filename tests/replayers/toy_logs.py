"""Toy logs for replays: what the hand-made run of tests/sample_logs.py makes certain, and variations of it.

The run knew the fridge, looked into the table and the counter, and never opened the bed and the desk.
"""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
from fake_world import FakeWorld
from sample_logs import T0, record_run, toy_info, toy_place, write_toy_log
from toy import BED, COUNTER, DESK, FRIDGE, TABLE, toy_house

from replayers.counterfactual.decisions.decided import Decided
from replayers.counterfactual.evidence import Evidence, evidence_of
from replayers.runs.run import Run, read
from workbench.beliefs.belief import Belief
from workbench.beliefs.estimators import estimator
from workbench.execution.loop import run_task
from workbench.log_schema.events import ActionFinished, Observation, SeenItem, Stamp
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.strategies import strategy
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import AllOf, AnyOf, Delivered, Holding, Task, find_task, goal_types
from workbench.plugins import NameOrigin
from workbench.search.costs import SIMULATION_COSTS
from workbench.search.find_costs import SearchStop
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.knowledge import Knowledge

MUG, BOOK, PENCIL = ItemType("Mug"), ItemType("Book"), ItemType("Pencil")
OPEN = (BED, DESK)
KNOWN = (FRIDGE, COUNTER, TABLE)


def toy_run(folder: Path) -> Run:
    """The hand-made run, read from its log."""
    path = folder / "toy.mcap"
    return read(path if path.exists() else write_toy_log(path))


def toy_evidence(folder: Path, task: Task | None = None) -> Evidence:
    evidence = evidence_of(toy_run(folder))
    return evidence if task is None else replace(evidence, task=task)


def task_of(goal: Holding | Delivered | AllOf | AnyOf, *, failure_cost: float = 400.0) -> Task:
    return Task(scenario="toy", goal=goal, failure_cost=failure_cost, budget_s=60.0)


def delivered(item_type: ItemType, at: str) -> Delivered:
    return Delivered(item_type=item_type, at=LocationId(at))


def seen(container: str, *items: str, s: int = 0, decision: int = 1) -> Observation:
    found = tuple(SeenItem(id=name, type=name.partition("|")[0]) for name in items)
    return Observation(
        stamp=Stamp.of(T0 + s * 10**9), decision=decision, container=container, items=found, robot_at=""
    )


def acted(
    action: str, target: str, *items: str, s: int = 0, success: bool = True, reason: str = ""
) -> ActionFinished:
    stamp = Stamp.of(T0 + s * 10**9)
    return ActionFinished(
        stamp=stamp,
        decision=1,
        index=1,
        start=stamp,
        action=action,
        origin=target,
        target=target,
        item_types=(),
        items=items,
        cost=0.0,
        success=success,
        reason=reason,
    )


class Even:
    """Believes every unsearched container as likely as any other."""

    name = "even@0"

    def believe(self, knowledge: Knowledge, item_types: tuple[ItemType, ...]) -> Belief:
        shape = (len(item_types), len(knowledge.unsearched))
        probability = np.full(shape, 0.3)
        return Belief(
            item_types=item_types, containers=knowledge.unsearched, probability=probability, estimator=self.name
        )


@dataclass(frozen=True)
class InOrder:
    """Looks into containers in a fixed order for the goal's type; then takes it to the goal's place."""

    order: tuple[ContainerId, ...]
    name: str = "in-order"

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        return goal_types(task.goal)

    def decide(self, view: View) -> Decision:
        goal, known = view.task.goal, view.knowledge
        assert isinstance(goal, Holding)
        here, places = known.robot_at, known.where(goal.item_type)
        if known.holding is not None:
            return _plan(PlanStep(action="move", origin=here, target=goal.at))
        if places:
            at, thing = places[0]
            walk = [PlanStep(action="move", origin=here, target=at)] if at != here else []
            return _plan(*walk, PlanStep(action="pick", origin=at, target=at, items=(thing.id,)))
        left = [c for c in self.order if c in known.unsearched]
        if not left:
            return Decision(plan=Plan(status=PlanStatus.NO_PLAN, note="nowhere left"))
        find = PlanStep(action="find", origin=here, target=goal.at, item_types=(goal.item_type,))
        return Decision(
            plan=Plan(status=PlanStatus.SOLVED, steps=(find,)),
            search_order=(SearchStop(container=left[0], probability=0.5, reached=1.0, leg_m=0.0),),
        )


def _plan(*steps: PlanStep) -> Decision:
    return Decision(plan=Plan(status=PlanStatus.SOLVED, steps=steps))


def fillings(
    types: Iterable[ItemType], containers: Iterable[ContainerId]
) -> list[dict[ContainerId, tuple[ItemType, ...]]]:
    """Every way in which each container holds none or one of each type."""
    kinds, every = tuple(types), [dict[ContainerId, tuple[ItemType, ...]]()]
    for container in containers:
        subsets = [tuple(t for i, t in enumerate(kinds) if bits >> i & 1) for bits in range(2 ** len(kinds))]
        every = [{**world, container: subset} for world in every for subset in subsets]
    return every


def simulated_log(
    path: Path,
    *,
    name: str = "model-lios",
    task: Task | None = None,
    known: tuple[ContainerId, ...] = (FRIDGE,),
    truth: bool = True,
    run_id: str = "0123456789ab",
    refuse: dict[tuple[str, str], int] | None = None,
) -> Path:
    """The toy house, a strategy and the shipped counts: recorded by the loop itself.

    Args:
        refuse: as for FakeWorld; what a refused pick wanted is still there.
    """
    world = FakeWorld(known=known, clock_ns=T0, refuse=dict(refuse or {}), item_remains=True)
    wanted = task or find_task(MUG, START)
    believer = estimator("counts")
    events = run_task(
        world,
        strategy(name, origin=NameOrigin.USER, house=toy_house()),
        believer,
        wanted,
        costs=SIMULATION_COSTS,
        seed=7,
    )
    info = toy_info(strategy=name, estimator=believer.name, run_id=run_id, scenario=wanted.scenario)
    record_run(
        path,
        events,
        info=info,
        place=toy_place(),
        task=wanted,
        costs=SIMULATION_COSTS,
        truth=toy_house().contents if truth else None,
    )
    return path


def done_by(decided: Decided) -> tuple[object, ...]:
    """What a decision does, without the way to the container that it looks into."""
    steps = decided.steps
    on_the_way = decided.look is not None and steps and steps[-1].target == decided.look != steps[-1].origin
    return steps[:-1] if on_the_way else steps, decided.look
