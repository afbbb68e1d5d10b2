"""One-line descriptions of events, for the operator."""

from __future__ import annotations

from workbench.execution.events import Acted, Believed, Costed, Ended, Event, Observed, Planned
from workbench.planning.plans import PlanStatus


def in_words(event: Event) -> str:
    """An event in one line."""
    match event:
        case Observed():
            held = ", ".join(item.type for item in event.items) or "nothing"
            return f"{event.container} holds {held}"
        case Planned():
            plan = event.made.plan
            if plan.status is not PlanStatus.SOLVED:
                return f"Plan {event.decision} ({event.reason}), {plan.status}: {plan.note or 'none was found'}"
            steps = "; ".join(str(step) for step in plan.steps[:4])
            looks = ", ".join(stop.container for stop in event.made.search_order[:3])
            order = f" looking into {looks}" if looks else ""
            more = "; ..." if len(plan.steps) > 4 else ""
            return f"Plan {event.decision} ({event.reason}), cost {plan.cost:.1f}: {steps}{more}{order}"
        case Acted():
            result = "" if event.success else f" refused: {event.reason}"
            return f"{event.step}{result} ({(event.stamp_ns - event.start_ns) / 1e9:.0f} s)"
        case Believed():
            return f"Believes by {event.belief.estimator}"
        case Costed():
            return f"Priced {len(event.find_costs.item_types)} item types"
        case Ended():
            return f"Ended: {event.status}: {event.reason}"
