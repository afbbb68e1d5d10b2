"""What if a planner of somebody else's breaks? Its decision is a plan that failed, with the reason, and no traceback.

The loop promises that every run ends with a status; this keeps the promise for strategies that were not written here.
Replays go further and run such a planner in a process of its own.
"""

from __future__ import annotations

import logging
from dataclasses import dataclass, field
from typing import Any, cast, final

from workbench.planning.plans import Plan, PlanStatus
from workbench.planning.strategy import Decision, View
from workbench.planning.tasks import Task
from workbench.worlds.house import ItemType

_LOGGER = logging.getLogger("lios")


@final
@dataclass(slots=True)
class FromOutside:
    """A strategy from outside, whose mistakes become its status.

    Args:
        planner: what was loaded: it has a name and both methods, and nothing more is known of it.
    """

    planner: Any
    _broken: str = field(default="", init=False)

    @property
    def name(self) -> str:
        return str(self.planner.name)

    def relevant_types(self, task: Task) -> tuple[ItemType, ...]:
        """The types about which it wants beliefs; none if it cannot say, and then it decides nothing."""
        try:
            answer = self.planner.relevant_types(task)
        except Exception as error:  # noqa: BLE001  a stranger's code may raise anything
            self._broken = _raised(error)
            return ()
        if not isinstance(answer, tuple):
            self._broken = f"its relevant_types are {type(answer).__name__} instead of a tuple"
            return ()
        return tuple(ItemType(str(item_type)) for item_type in cast(tuple[object, ...], answer))

    def decide(self, view: View) -> Decision:
        if self._broken:
            return self._failed(self._broken)
        try:
            answer = self.planner.decide(view)
        except Exception as error:  # noqa: BLE001  a stranger's code may raise anything
            return self._failed(_raised(error))
        if not isinstance(answer, Decision):
            return self._failed(f"it returned {type(answer).__name__} instead of a Decision")
        return answer

    def _failed(self, why: str) -> Decision:
        return Decision(plan=Plan(status=PlanStatus.SOLVER_FAILED, note=why, solver=self.name))


def _raised(error: Exception) -> str:
    """The fact in one line; the traceback is for --debug."""
    _LOGGER.debug("a planner from outside raised", exc_info=error)
    return f"it raised {type(error).__name__}: {' '.join(str(error).split())}".rstrip(": ")
