"""The codec between events of the loop and the messages of a log.

`to_wire` turns what the loop yields into wire events; `encode` and `decode` stand side by side. Beliefs are written
to the last bit: a replay believes them, and a millionth can flip a decision. Find costs, costs and path points are
rounded to six decimals (a micrometre): small files, and since a replay is encoded by the same function, verification
still compares like with like.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from functools import singledispatch
from types import MappingProxyType
from typing import cast

import msgspec
import numpy as np

from workbench.arrays import Floats
from workbench.errors import Malformed
from workbench.execution.events import (
    ActionEnded,
    BeliefUpdated,
    ContainerObserved,
    EstimatorAnswered,
    Event,
    FindCostsUpdated,
    ItemSighted,
    LookMade,
    PlanMade,
    RunEnded,
)
from workbench.log_schema.events import (
    TOPICS,
    ActionFinished,
    BeliefUpdate,
    DomainEvent,
    EstimatorAnswer,
    FindCosts,
    GroundTruth,
    HowLooked,
    ItemSighting,
    Observation,
    Outcome,
    PlanComputed,
    SeenInPassing,
    SeenItem,
    Stamp,
    Step,
    Stop,
    Timing,
    WayNotTaken,
)
from workbench.planning.plans import PlanStatus, PlanStep
from workbench.worlds.geometry import Pose
from workbench.worlds.house import Contents, Item

DECIMALS = 6
"""Of costs, metres and path points on the wire; beliefs are not rounded."""


class UndecodableMessage(Malformed):
    """A message does not match the schema of its topic."""

    def __init__(self, topic: str, reason: str) -> None:
        super().__init__(f"a message of {topic} cannot be decoded: {reason}. Run lios doctor on the log.")


class UnknownTopic(Malformed):
    """A topic that is not part of the log schema."""

    def __init__(self, topic: str) -> None:
        super().__init__(f"{topic} is no topic of this vocabulary. Read it raw: replayers.messages.")


OPTIONAL: Mapping[type[msgspec.Struct], tuple[str, ...]] = MappingProxyType(
    {PlanComputed: ("expected_cost", "lower_bound"), Outcome: ("unseen",), Observation: ("look", "passing")}
)
"""Fields that may be None."""


def encode(event: DomainEvent) -> bytes:
    """A wire event as JSON; the same event gives the same bytes. What is None is left out, as viewers want it."""
    absent = [name for name in OPTIONAL.get(type(event), ()) if getattr(event, name) is None]
    if not absent:
        return msgspec.json.encode(event)
    return msgspec.json.encode({name: v for name, v in msgspec.structs.asdict(event).items() if name not in absent})


def decode(topic: str, data: bytes) -> DomainEvent:
    """Decode a message of a topic; older schema versions are converted to the current one.

    Raises:
        UnknownTopic: the topic is not in TOPICS.
        UndecodableMessage: the bytes are not JSON, or do not match the topic's class.
    """
    decoder = _DECODERS.get(topic)
    if decoder is None:
        raise UnknownTopic(topic)
    try:
        event = cast(DomainEvent, decoder.decode(data))
    except (msgspec.MsgspecError, UnicodeDecodeError, RecursionError) as error:
        raise UndecodableMessage(topic, str(error)) from error
    return _upgrade_from_version_1(event) if isinstance(event, PlanComputed) else event


def _upgrade_from_version_1(plan: PlanComputed) -> PlanComputed:
    """Convert a plan of schema version 1, which stored an expected cost of 0.0 if no plan was found."""
    if plan.status == PlanStatus.SOLVED or plan.expected_cost is None:
        return plan
    return msgspec.structs.replace(plan, expected_cost=None)


_DECODERS = {topic: msgspec.json.Decoder(cls) for topic, cls in TOPICS.items()}


@singledispatch
def to_wire(event: Event) -> tuple[DomainEvent, ...]:
    """The wire events of one event of the loop: one, or two for a decision (its timing is separate)."""
    raise TypeError(f"{type(event).__name__} is no event of the loop")


@to_wire.register
def _(event: ContainerObserved) -> tuple[DomainEvent, ...]:
    seen = Observation(
        stamp=Stamp.of(event.stamp_ns),
        decision=event.decision,
        container=event.container,
        items=seen_items(event.items),
        robot_at=event.robot_at,
        known_at_start=event.known_at_start,
        support=event.support,
        opened_by=event.opened_by,
        look=None if event.look is None else _how_looked(event.look),
        passing=None if event.passing_from is None else SeenInPassing(viewpoint=_pose(event.passing_from)),
    )
    return (seen,)


@to_wire.register
def _(event: ItemSighted) -> tuple[DomainEvent, ...]:
    sighting = ItemSighting(
        stamp=Stamp.of(event.stamp_ns),
        decision=event.decision,
        container=event.container,
        item=SeenItem(id=event.item.id, type=event.item.type),
        robot_at=event.robot_at,
        viewpoint=_pose(event.viewpoint),
        support=event.support,
    )
    return (sighting,)


@to_wire.register
def _(event: EstimatorAnswered) -> tuple[DomainEvent, ...]:
    answer = event.answer
    asked = EstimatorAnswer(
        stamp=Stamp.of(event.stamp_ns),
        decision=event.decision,
        estimator=answer.estimator,
        model=answer.model,
        question=answer.question,
        answer=answer.answer,
        seconds=_rounded(answer.seconds),
    )
    return (asked,)


@to_wire.register
def _(event: BeliefUpdated) -> tuple[DomainEvent, ...]:
    update = BeliefUpdate(
        stamp=Stamp.of(event.stamp_ns),
        decision=event.decision,
        item_types=event.belief.item_types,
        containers=event.belief.containers,
        probability=tuple(tuple(row) for row in event.belief.probability.tolist()),
        estimator=event.belief.estimator,
    )
    return (update,)


@to_wire.register
def _(event: FindCostsUpdated) -> tuple[DomainEvent, ...]:
    costs = event.find_costs
    table = FindCosts(
        stamp=Stamp.of(event.stamp_ns),
        decision=event.decision,
        item_types=costs.item_types,
        origins=costs.origins,
        targets=costs.targets,
        metres=_cube(costs.metres),
        kind=costs.kind,
        belief_model=costs.belief_model,
    )
    return (table,)


@to_wire.register
def _(event: PlanMade) -> tuple[DomainEvent, ...]:
    made, plan, stamp = event.made, event.made.plan, Stamp.of(event.stamp_ns)
    computed = PlanComputed(
        stamp=stamp,
        decision=event.decision,
        robot_at=event.robot_at,
        reason=event.reason,
        status=plan.status.value,
        steps=tuple(_step(step) for step in plan.steps),
        expected_cost=_rounded(plan.cost) if plan.status is PlanStatus.SOLVED else None,
        lower_bound=None if plan.lower_bound is None else _rounded(plan.lower_bound),
        optimal=plan.optimal,
        solver=plan.solver,
        note=plan.note,
        search_order=tuple(
            Stop(
                container=stop.container,
                probability=_rounded(stop.probability),
                reached=_rounded(stop.reached),
                leg_m=_rounded(stop.leg_m),
            )
            for stop in made.search_order
        ),
        alternatives=tuple(
            WayNotTaken(title=alternative.title, cost=_rounded(alternative.cost), why_not=alternative.why_not)
            for alternative in made.alternatives
        ),
        look_on_the_way=tuple(made.look_on_the_way),
    )
    timing = Timing(
        stamp=stamp, decision=event.decision, belief_s=_rounded(event.belief_s), planning_s=_rounded(event.planning_s)
    )
    return (computed, timing)


@to_wire.register
def _(event: ActionEnded) -> tuple[DomainEvent, ...]:
    finished = ActionFinished(
        stamp=Stamp.of(event.stamp_ns),
        decision=event.decision,
        index=event.index,
        start=Stamp.of(event.start_ns),
        action=event.step.action,
        origin=event.step.origin,
        target=event.step.target,
        item_types=event.step.item_types,
        items=event.items or event.step.items,
        cost=_rounded(event.cost),
        success=event.success,
        travel_m=_rounded(event.travel_m),
        path=tuple((_rounded(x), _rounded(y)) for x, y in event.path),
        reason=event.reason,
        support=event.support,
        item_remains=event.item_remains,
    )
    return (finished,)


@to_wire.register
def _(event: RunEnded) -> tuple[DomainEvent, ...]:
    outcome = Outcome(
        stamp=Stamp.of(event.stamp_ns),
        decision=event.decision,
        status=event.status.value,
        cost=_rounded(event.cost),
        own_cost=_rounded(event.own_cost),
        reason=event.reason,
        searches=event.searches,
        travel_m=_rounded(event.travel_m),
        unseen=event.unseen,
    )
    return (outcome,)


def ground_truth(contents: Contents, stamp_ns: int) -> GroundTruth:
    """The true initial contents of all containers as a wire event; containers sorted."""
    return GroundTruth(
        stamp=Stamp.of(stamp_ns), contents={name: seen_items(contents[name]) for name in sorted(contents)}
    )


def seen_items(items: Iterable[Item]) -> tuple[SeenItem, ...]:
    return tuple(SeenItem(id=item.id, type=item.type) for item in items)


def _how_looked(look: LookMade) -> HowLooked:
    return HowLooked(
        number=look.number,
        viewpoint=() if look.viewpoint is None else _pose(look.viewpoint),
        in_view=look.in_view,
        duration_s=_rounded(look.duration_s),
        detector=look.detector,
        item_types=tuple(t for t, _ in look.p_detect),
        p_detect=tuple(p for _, p in look.p_detect),
        source=look.source,
    )


def _pose(at: Pose) -> tuple[float, float, float]:
    return (_rounded(at.x_m), _rounded(at.y_m), _rounded(at.yaw_rad))


def _step(step: PlanStep) -> Step:
    return Step(
        action=step.action,
        origin=step.origin,
        target=step.target,
        item_types=step.item_types,
        items=step.items,
        cost=_rounded(step.cost),
    )


def _rounded(value: float) -> float:
    return round(float(value), DECIMALS)


def _cube(array: Floats) -> tuple[tuple[tuple[float, ...], ...], ...]:
    return tuple(tuple(tuple(row) for row in layer) for layer in np.round(array, DECIMALS).tolist())
