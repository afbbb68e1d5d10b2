"""Which steps of a plan can be executed, and the message of each refusal."""

from __future__ import annotations

import pytest
from toy import COUNTER, item, toy_plan, toy_travel

from workbench.execution.legality import Legality, legality
from workbench.planning.plans import Plan, PlanStatus, PlanStep
from workbench.planning.strategy import Decision
from workbench.worlds.house import START, ItemId, LocationId
from workbench.worlds.knowledge import knowledge_at_start

SHELF = COUNTER
ITEM = item("Mug|1")
KNOWLEDGE = knowledge_at_start(toy_plan(), toy_travel(), known={}).seen(SHELF, (ITEM,))
THERE = KNOWLEDGE.moved(LocationId(SHELF))
DECISION = Decision(plan=Plan(status=PlanStatus.SOLVED, solver="test"))


def _step(action: str, at: str, *items: str, origin: str | None = None) -> PlanStep:
    start = LocationId(origin or at)
    return PlanStep(
        action=action, origin=start, target=LocationId(at), cost=0.0, items=tuple(ItemId(item) for item in items)
    )


@pytest.mark.parametrize(
    ("step", "kind", "message"),
    [
        (_step("pick", SHELF, ITEM.id), Legality.LEGAL, ""),
        (_step("fly", SHELF), Legality.UNKNOWN_ACTION, "there is no action 'fly'"),
        (_step("move", SHELF, origin=START), Legality.ROBOT_ELSEWHERE, f"starts at {START}, but the robot is at"),
        (_step("find", SHELF), Legality.NO_CONTAINER, "names no container"),
        (_step("pick", SHELF), Legality.NO_ITEM, "it names no item"),
        (_step("pick", SHELF, "Mug|9"), Legality.NOT_THERE, f"Mug|9 is not known to be at {SHELF}"),
        (_step("place", SHELF, ITEM.id), Legality.NOT_HELD, f"the robot does not hold {ITEM.id}"),
        (_step("peel", SHELF, "Mug|9"), Legality.NOT_AT_HAND, "Mug|9 is not at hand"),
    ],
)
def test_a_step_that_cannot_be_executed_has_its_reason(step: PlanStep, kind: Legality, message: str) -> None:
    checked = legality(step, THERE, DECISION)
    assert checked.kind is kind
    assert message in checked.message


def test_nothing_is_picked_or_found_with_a_full_hand() -> None:
    holding = THERE.picked(ITEM)
    for step in (_step("pick", SHELF, ITEM.id), _step("find", SHELF)):
        assert legality(step, holding, DECISION).kind is Legality.HAND_FULL
