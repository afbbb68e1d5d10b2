"""Two hand-made runs in the toy house, with seconds, costs and beliefs that can be checked mentally.

Ours: at 0 s decides to search the fridge (1 m north, 2 s), looks (2 s); at 4 s decides for the counter (1.5 m east,
1 s), looks (2 s) and sees a mug at 7 s; picks it (5 s) until 12 s; walks back until 15 s.
"""

from __future__ import annotations

from dataclasses import replace
from pathlib import Path
from types import MappingProxyType

from toy import BED, COUNTER, DESK, FRIDGE, TABLE, toy_plan, toy_travel

from replayers.runs.run import Run
from workbench.log_schema.events import (
    NANO,
    ActionFinished,
    BeliefUpdate,
    FindCosts,
    Observation,
    Outcome,
    PlanComputed,
    RunInfo,
    SeenItem,
    Stamp,
    Step,
    Stop,
    WayNotTaken,
)
from workbench.log_schema.place import Place
from workbench.planning.tasks import find_task
from workbench.search.costs import SIMULATION_COSTS
from workbench.worlds.geometry import Pose
from workbench.worlds.house import START, FloorPlan, ItemType, LocationId

BEGAN_S = 1_767_225_600
AT_START, AT_FRIDGE, AT_COUNTER = (1.0, 2.0), (1.0, 3.0), (2.5, 3.0)
STANDING = {
    START: Pose(x_m=1.0, y_m=2.0),
    LocationId(FRIDGE): Pose(x_m=1.0, y_m=3.0, yaw_rad=3.0),
    LocationId(COUNTER): Pose(x_m=2.5, y_m=3.0, yaw_rad=1.5),
    LocationId(TABLE): Pose(x_m=2.0, y_m=1.6),
    LocationId(BED): Pose(x_m=6.0, y_m=2.0),
    LocationId(DESK): Pose(x_m=7.0, y_m=1.2),
}


def stamp(second: float) -> Stamp:
    return Stamp.of(BEGAN_S * NANO + round(second * NANO))


def ns(second: float) -> int:
    return stamp(second).ns


def action(
    index: int, decision: int, name: str, start: float, end: float, target: str, **more: object
) -> ActionFinished:
    given: dict[str, object] = {
        "origin": START,
        "item_types": (),
        "items": (),
        "cost": 0.0,
        "success": True,
    }
    given |= more
    return ActionFinished(
        stamp=stamp(end), decision=decision, index=index, start=stamp(start), action=name, target=target, **given
    )


def _belief(decision: int, second: float, probability: dict[str, float]) -> BeliefUpdate:
    return BeliefUpdate(
        stamp=stamp(second),
        decision=decision,
        item_types=("Mug", "Plate"),
        containers=tuple(probability),
        probability=(tuple(probability.values()), tuple(0.1 for _ in probability)),
        estimator="hand@0",
    )


def _plan(
    decision: int, second: float, at: str, order: tuple[str, ...], expected: float, reason: str
) -> PlanComputed:
    return PlanComputed(
        stamp=stamp(second),
        decision=decision,
        robot_at=at,
        reason=reason,
        status="solved",
        steps=(Step(action="find", origin=at, target=START, item_types=("Mug",), cost=expected),),
        expected_cost=expected,
        lower_bound=None,
        optimal=True,
        solver="closed form",
        search_order=tuple(Stop(container=c, probability=0.5, reached=1.0, leg_m=1.0) for c in order),
        alternatives=(WayNotTaken(title="look at the bed first", cost=expected + 9, why_not="farther"),),
    )


def toy_place(plan: FloorPlan | None = None) -> Place:
    return Place(plan=plan or toy_plan(), travel=toy_travel(), standing=MappingProxyType(STANDING))


def toy_run() -> Run:
    """Ours, as the module says."""
    picked = Step(action="pick", origin=COUNTER, target=COUNTER, item_types=("Mug",), items=("Mug|1",), cost=5.0)
    back = Step(action="move", origin=COUNTER, target=START, cost=2.0)
    third = _plan(3, 7, COUNTER, (), 7.0, "found Mug in CounterTop|1")
    return Run(
        path=Path("toy.mcap"),
        info=RunInfo(
            run_id="toy",
            schema_version=1,
            place="toy",
            scenario="find",
            strategy="lios",
            estimator="hand@0",
            seed=0,
            started=stamp(0),
        ),
        place=toy_place(),
        task=find_task(ItemType("Mug"), START),
        costs=SIMULATION_COSTS,
        observations=(
            _seen(0, 0, TABLE, ("Plate|1",), known=True),
            _seen(4, 1, FRIDGE, ("Egg|1",)),
            _seen(7, 2, COUNTER, ("Mug|1", "Pot|1")),
        ),
        beliefs=(
            _belief(1, 0, {FRIDGE: 0.4, COUNTER: 0.3, BED: 0.0, DESK: 0.1}),
            _belief(2, 4, {COUNTER: 0.3, BED: 0.0, DESK: 0.1}),
        ),
        find_costs=(
            FindCosts(
                stamp=stamp(0),
                decision=1,
                item_types=("Mug",),
                origins=(START, FRIDGE),
                targets=(START, BED),
                metres=(((9.0, 15.0), (8.0, 16.0)),),
                kind="model",
                belief_model="exists",
            ),
        ),
        plans=(
            _plan(1, 0, START, (FRIDGE, COUNTER, DESK), 12.0, "start"),
            _plan(2, 4, FRIDGE, (COUNTER, DESK), 8.0, "searched Fridge|1"),
            _replaced(third, (picked, back)),
        ),
        actions=(
            action(1, 1, "move", 0, 2, FRIDGE, cost=1.0, travel_m=1.0, path=(AT_START, AT_FRIDGE)),
            action(2, 1, "search", 2, 4, FRIDGE),
            action(3, 2, "move", 4, 5, COUNTER, cost=1.5, travel_m=1.5, path=(AT_FRIDGE, AT_COUNTER)),
            action(4, 2, "search", 5, 7, COUNTER),
            action(5, 3, "pick", 7, 12, COUNTER, cost=5.0, item_types=("Mug",), items=("Mug|1",)),
            action(6, 3, "move", 12, 15, START, cost=2.0, travel_m=2.0, path=(AT_COUNTER, AT_START)),
        ),
        outcome=Outcome(
            stamp=stamp(15), decision=3, status="done", cost=9.5, own_cost=9.5, reason="", searches=2, travel_m=4.5
        ),
        complete=True,
    )


def other_run() -> Run:
    """Another strategy's: it agrees at first, then goes to the bed, which nobody opened; its leg there is assumed."""
    ours = toy_run()
    second = _plan(2, 4, FRIDGE, (BED,), 20.0, "searched Fridge|1")
    return replace(
        ours,
        path=Path("other.mcap"),
        info=_renamed(ours.info, "greedy"),
        observations=ours.observations[:2],
        plans=(ours.plans[0], second),
        beliefs=ours.beliefs,
        find_costs=(),
        actions=(
            *ours.actions[:2],
            action(3, 2, "move", 4, 9, BED, cost=5.0, travel_m=5.0, path=(AT_FRIDGE, (6.0, 3.0)), support="imputed"),
        ),
        outcome=Outcome(
            stamp=stamp(9),
            decision=2,
            status="undetermined",
            cost=6.0,
            own_cost=6.0,
            reason="nobody opened Bed|2",
            searches=1,
            travel_m=6.0,
            unseen=BED,
        ),
    )


def empty_run() -> Run:
    """A log that was cut off before anything happened."""
    ours = toy_run()
    return replace(
        ours, observations=(), beliefs=(), find_costs=(), plans=(), actions=(), outcome=None, complete=False
    )


def named_run(name: str) -> Run:
    """Ours, with a name wherever a log has one: for markup and other scripts in names."""
    ours = toy_run()
    info = RunInfo(
        **{f: getattr(ours.info, f) for f in ours.info.__struct_fields__} | {"strategy": name, "place": name}
    )
    plan = _plan(1, 0, START, (FRIDGE,), 12.0, name)
    swapped = PlanComputed(**{f: getattr(plan, f) for f in plan.__struct_fields__} | {"solver": name, "note": name})
    belief = ours.beliefs[0]
    renamed = BeliefUpdate(
        **{f: getattr(belief, f) for f in belief.__struct_fields__} | {"item_types": (name, "Plate")}
    )
    moved = replace(toy_plan(), name=name, rooms=tuple(replace(room, kind=name) for room in toy_plan().rooms))
    return replace(
        ours,
        info=info,
        place=toy_place(moved),
        task=replace(ours.task, title=name),
        plans=(swapped, *ours.plans[1:]),
        beliefs=(renamed, *ours.beliefs[1:]),
    )


def _seen(
    second: float, decision: int, container: str, items: tuple[str, ...], *, known: bool = False
) -> Observation:
    return Observation(
        stamp=stamp(second),
        decision=decision,
        container=container,
        items=tuple(SeenItem(i, i.partition("|")[0]) for i in items),
        robot_at=container,
        known_at_start=known,
    )


def _renamed(info: RunInfo, strategy: str) -> RunInfo:
    fields = {f: getattr(info, f) for f in info.__struct_fields__}
    return RunInfo(**fields | {"strategy": strategy, "run_id": strategy, "source": "replay"})


def _replaced(plan: PlanComputed, steps: tuple[Step, ...]) -> PlanComputed:
    return PlanComputed(**{f: getattr(plan, f) for f in plan.__struct_fields__} | {"steps": steps})
