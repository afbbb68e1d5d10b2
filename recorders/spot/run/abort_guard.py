"""Orderly ends of robot runs: errors and stops become an ABORTED status, and the robot is stopped."""

from __future__ import annotations

from collections.abc import Iterable, Iterator

from recorders.spot.client.connection import ROBOT_ERRORS, reason_of
from recorders.spot.client.control import Control
from recorders.spot.client.errors import RunStopped
from workbench.errors import LiosError
from workbench.execution.events import ActionEnded, Event, PlanMade, RunEnded, RunStatus
from workbench.planning.tasks import Task
from workbench.worlds.world import World


def stopping_on_error(events: Iterable[Event], world: World, control: Control, task: Task) -> Iterator[Event]:
    """Yield the events; if the run cannot continue, stop the robot and end with an ABORTED status."""
    decision, searches, own_cost, travel_m = 0, 0, 0.0, 0.0
    try:
        for event in events:
            if isinstance(event, PlanMade):
                decision = event.decision
            if isinstance(event, ActionEnded):
                own_cost, travel_m = own_cost + event.cost, travel_m + event.travel_m
                searches += event.step.action == "search"
            yield event
        return
    except RunStopped as stopped:
        reason = stopped.reason
    except (*ROBOT_ERRORS, LiosError) as error:
        reason = str(error) if isinstance(error, LiosError) else f"the robot failed ({reason_of(error)})"
    control.stop()
    yield RunEnded(
        stamp_ns=world.now_ns(),
        decision=decision,
        status=RunStatus.ABORTED,
        cost=task.failure_cost,
        own_cost=own_cost,
        reason=reason,
        searches=searches,
        travel_m=travel_m,
    )
