"""Action costs in the paper's units: one metre of travel costs 1."""

from __future__ import annotations

from dataclasses import dataclass, fields
from math import isfinite

from workbench.errors import BadValue


@dataclass(frozen=True, slots=True, kw_only=True)
class ActionCosts:
    """Costs of all actions but moving, which costs its distance in metres.

    Attributes:
        search: 0 in simulation, 1 on the robot (paper, Sec. V).
        manipulation: pick, place and every preparing action (paper: 5 each).

    Raises:
        BadValue: a cost that is negative or not finite.
    """

    search: float = 0.0
    manipulation: float = 5.0

    def __post_init__(self) -> None:
        for field in fields(self):
            value = getattr(self, field.name)
            if not isfinite(value) or value < 0:
                raise BadValue(f"cost of {field.name}", value, "finite and at least 0")


SIMULATION_COSTS = ActionCosts(search=0.0)
ROBOT_COSTS = ActionCosts(search=1.0)
