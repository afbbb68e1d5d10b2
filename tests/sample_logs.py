"""A small run in the toy house, worked out by hand, and ways to corrupt its log."""

from __future__ import annotations

from collections.abc import Iterable, Iterator
from pathlib import Path
from typing import Any

import numpy as np
from toy import COUNTER, FRIDGE, TABLE, item, toy_house, toy_plan, toy_travel

from recorders.run_recorder import RunRecorder
from workbench.beliefs.belief import Belief
from workbench.execution.events import (
    ActionEnded,
    BeliefUpdated,
    ContainerObserved,
    Event,
    FindCostsUpdated,
    PlanMade,
    RunEnded,
    RunStatus,
)
from workbench.log_schema.events import NANO, SCHEMA_VERSION, RunInfo, Stamp
from workbench.log_schema.place import Place
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.strategy import Alternative, Decision
from workbench.planning.tasks import Task, find_task
from workbench.search.costs import SIMULATION_COSTS
from workbench.search.find_costs import FindCosts, SearchStop
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START, ContainerId, ItemType, LocationId
from workbench.worlds.maps.occupancy import occupancy_of

T0 = 1_767_225_600 * NANO
"""2026-01-01T00:00:00Z."""
MUG = ItemType("Mug")


def record_run(path: Path | str, events: Iterable[Event], **options: Any) -> RunEnded | None:
    """Record all events of a run; its last event, or None if the events stop before it.

    Args:
        options: as for RunRecorder.
    """
    ended = None
    with RunRecorder(path, **options) as recorder:
        for event in events:
            recorder.record(event)
            ended = event if isinstance(event, RunEnded) else ended
    return ended


def toy_place() -> Place:
    plan, travel = toy_plan(), toy_travel()
    standing = {name: Pose(x_m=1.0 + i, y_m=2.0) for i, name in enumerate(travel.locations)}
    return Place(plan=plan, travel=travel, standing=standing, occupancy=occupancy_of(plan))


def toy_info(**changes: object) -> RunInfo:
    fields: dict[str, object] = {
        "run_id": "0123456789ab",
        "schema_version": SCHEMA_VERSION,
        "place": "toy",
        "scenario": "find",
        "strategy": "model-lios",
        "estimator": "counts@1a2b3c4d",
        "seed": 7,
        "started": Stamp.of(T0),
        "title": "find Mug and bring it to start",
    }
    return RunInfo(**(fields | changes))  # type: ignore[arg-type]


def toy_task() -> Task:
    return find_task(MUG, START)


def toy_events() -> list[Event]:
    """Table (1 m, nothing), then counter (3 m, a mug), pick (5), back to the start (2 m): cost 11."""
    containers = (COUNTER, TABLE)
    return [
        _observed(0, 0, FRIDGE, START, known=True),
        *_decided(0, 1, START, containers, [[0.4, 0.6]], TABLE, 1.0, "start"),
        *_walked(0, 1, 1, START, TABLE, 1.0),
        _did(1, 3, 1, 2, "search", TABLE, 0.0),
        _observed(3, 1, TABLE, TABLE),
        *_decided(3, 2, LocationId(TABLE), (COUNTER,), [[0.9]], COUNTER, 3.0, f"searched {TABLE}"),
        *_walked(3, 2, 3, TABLE, COUNTER, 3.0),
        _did(6, 8, 2, 4, "search", COUNTER, 0.0),
        _observed(8, 2, COUNTER, COUNTER),
        _planned(8, 3, LocationId(COUNTER), _home(), (), "found Mug"),
        _did(8, 13, 3, 5, "pick", COUNTER, 5.0, ("Mug|1",)),
        *_walked(13, 3, 6, COUNTER, START, 2.0),
        RunEnded(
            stamp_ns=T0 + 15 * NANO,
            decision=3,
            status=RunStatus.DONE,
            cost=11.0,
            own_cost=11.0,
            reason="the goal is met",
            searches=2,
            travel_m=6.0,
        ),
    ]


def write_toy_log(path: Path, **options: object) -> Path:
    """The toy run as a log."""
    record_run(path, iter(toy_events()), **toy_options(), **options)
    return path


def toy_options() -> dict[str, object]:
    return {
        "info": toy_info(),
        "place": toy_place(),
        "task": toy_task(),
        "costs": SIMULATION_COSTS,
        "truth": toy_house().contents,
    }


def killed_toy_log(path: Path, events: int = 9) -> Path:
    """What is left when the recorder is killed after some events, its last chunk unwritten."""
    recorder = RunRecorder(path, **toy_options())  # type: ignore[arg-type]
    for event in toy_events()[:events]:
        recorder.record(event)
    recorder._files.abandon()  # type: ignore[attr-defined]
    return path


def _observed(s: int, decision: int, container: ContainerId, at: str, *, known: bool = False) -> ContainerObserved:
    return ContainerObserved(
        stamp_ns=T0 + s * NANO,
        decision=decision,
        container=container,
        items=toy_house().contents[container],
        robot_at=LocationId(at),
        known_at_start=known,
    )


def _decided(
    s: int,
    decision: int,
    at: LocationId,
    containers: tuple[ContainerId, ...],
    p: list[list[float]],
    first: ContainerId,
    leg_m: float,
    reason: str,
) -> Iterator[Event]:
    yield BeliefUpdated(
        stamp_ns=T0 + s * NANO,
        decision=decision,
        belief=Belief(item_types=(MUG,), containers=containers, probability=np.array(p), estimator="counts@1a2b3c4d"),
    )
    costs = FindCosts(item_types=(MUG,), origins=(at,), targets=(START,), metres=np.array([[[9.25]]]), kind="model")
    yield FindCostsUpdated(stamp_ns=T0 + s * NANO, decision=decision, find_costs=costs)
    step = PlanStep(action="find", origin=at, target=START, item_types=(MUG,), cost=9.25)
    stop = SearchStop(container=first, probability=p[0][-1], reached=1.0, leg_m=leg_m)
    yield _planned(s, decision, at, (step,), (stop,), reason)


def _planned(
    s: int, decision: int, at: LocationId, steps: tuple[PlanStep, ...], order: tuple[SearchStop, ...], reason: str
) -> PlanMade:
    plan = Plan(
        status=PlanStatus.SOLVED,
        steps=steps,
        cost=sum(step.cost for step in steps),
        lower_bound=1.0,
        optimal=True,
        solver="closed form",
    )
    made = Decision(plan=plan, search_order=order, alternatives=(Alternative(title="fridge first", cost=12.5),))
    return PlanMade(
        stamp_ns=T0 + s * NANO,
        decision=decision,
        robot_at=at,
        reason=reason,
        made=made,
        belief_s=0.001,
        planning_s=0.002,
    )


def _home() -> tuple[PlanStep, ...]:
    here = LocationId(COUNTER)
    return (
        PlanStep(action="pick", origin=here, target=here, item_types=(MUG,), items=(item("Mug|1").id,), cost=5.0),
        PlanStep(action="move", origin=here, target=START, cost=2.0),
    )


def _walked(s: int, decision: int, index: int, a: str, b: str, metres: float) -> Iterator[Event]:
    yield ActionEnded(
        stamp_ns=T0 + round((s + metres) * NANO),
        decision=decision,
        index=index,
        start_ns=T0 + s * NANO,
        step=PlanStep(action="move", origin=LocationId(a), target=LocationId(b), cost=metres),
        cost=metres,
        success=True,
        travel_m=metres,
        path=((1.0, 2.0), (1.0 + metres, 2.0)),
        standing=Pose(x_m=1.0 + metres, y_m=2.0, yaw_rad=1.0),
    )


def _did(
    start_s: int,
    end_s: int,
    decision: int,
    index: int,
    action: str,
    at: str,
    cost: float,
    items: tuple[str, ...] = (),
) -> ActionEnded:
    here = LocationId(at)
    return ActionEnded(
        stamp_ns=T0 + end_s * NANO,
        decision=decision,
        index=index,
        start_ns=T0 + start_s * NANO,
        step=PlanStep(action=action, origin=here, target=here, items=tuple(item(i).id for i in items), cost=cost),
        cost=cost,
        success=True,
        items=tuple(item(i).id for i in items),
    )
