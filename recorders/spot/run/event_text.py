"""One-line descriptions of events, for the operator."""

from __future__ import annotations

from workbench.execution.events import (
    ActionEnded,
    BeliefUpdated,
    ContainerObserved,
    EstimatorAnswered,
    Event,
    FindCostsUpdated,
    ItemSighted,
    PlanMade,
    RunEnded,
)
from workbench.planning.plans import PlanStatus


def event_line(event: Event) -> str:
    """An event in one line."""
    match event:
        case ContainerObserved():
            held = ", ".join(item.type for item in event.items) or "nothing"
            return f"{event.container} holds {held}"
        case ItemSighted():
            return f"Saw {event.item.id} in {event.container} in passing"
        case PlanMade():
            plan = event.made.plan
            if plan.status is not PlanStatus.SOLVED:
                return f"Plan {event.decision} ({event.reason}), {plan.status}: {plan.note or 'none was found'}"
            steps = "; ".join(str(step) for step in plan.steps[:4])
            looks = ", ".join(stop.container for stop in event.made.search_order[:3])
            order = f" looking into {looks}" if looks else ""
            more = "; ..." if len(plan.steps) > 4 else ""
            return f"Plan {event.decision} ({event.reason}), cost {plan.cost:.1f}: {steps}{more}{order}"
        case ActionEnded():
            result = "" if event.success else f" refused: {event.reason}"
            return f"{event.step}{result} ({(event.stamp_ns - event.start_ns) / 1e9:.0f} s)"
        case EstimatorAnswered():
            return f"Asked {event.answer.model} ({event.answer.seconds:.1f} s)"
        case BeliefUpdated():
            return f"Believes by {event.belief.estimator}"
        case FindCostsUpdated():
            return f"Priced {len(event.find_costs.item_types)} item types"
        case RunEnded():
            return f"Ended: {event.status}: {event.reason}"


class NextStep:
    """Follows the events of a run, and says what the robot is about to do."""

    def __init__(self) -> None:
        self._left: list[str] = []

    def after(self, event: Event) -> str:
        """The step that comes after an event, in words; "" at the end."""
        match event:
            case PlanMade():
                self._left = _steps_ahead(event)
            case ActionEnded() if event.success and event.step.action != "search":
                self._left = self._left[1:]
            case ActionEnded() | RunEnded():
                self._left = []
            case _:
                pass
        return self._left[0] if self._left else ""


def _steps_ahead(event: PlanMade) -> list[str]:
    """What a plan does first: a find goes to its next container and looks; nothing after that is certain."""
    made, ahead = event.made, list[str]()
    for step in made.plan.steps[: made.steps_now]:
        if step.action == "find" and made.search_order:
            container = made.search_order[0].container
            going = [] if event.robot_at == container else [f"go to {container}"]
            return [*ahead, *going, f"look into {container}"]
        ahead.append(str(step))
    return ahead
