"""Durations of actions: the simulator's figures, or figures fitted to a robot's own log.

A move takes a start-up time `move_s` and `metre_s` for each metre; looks and manipulations take their means.
Residuals are kept with the figures: a fit is a prediction, not a measurement.
"""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from dataclasses import dataclass, field
from math import sqrt

import numpy as np

from workbench.execution.events import ActionEnded, Event
from workbench.log_schema.events import NANO, ActionFinished


@dataclass(frozen=True, slots=True, kw_only=True)
class Durations:
    """Durations of actions, in seconds.

    Attributes:
        move_s, metre_s: a move of x metres takes move_s + metre_s * x.
        look_s, manipulation_s: means.
        residual_s: root mean square residual of the fit for each kind ("move", "look", "manipulation").
        samples: how many recorded actions each was fitted to; 0 means that the simulator's figure is used.
    """

    move_s: float = 0.0
    metre_s: float = 1.0
    look_s: float = 2.0
    manipulation_s: float = 5.0
    residual_s: Mapping[str, float] = field(default_factory=dict[str, float])
    samples: Mapping[str, int] = field(default_factory=dict[str, int])

    def move_ns(self, metres: float) -> int:
        return round((self.move_s * (metres > 0) + self.metre_s * metres) * NANO)

    def words(self) -> str:
        """The figures with their residuals, in one line."""
        return (
            f"seconds by the log's own speeds: a move {self.move_s:.1f} s and {self.metre_s:.2f} s a metre "
            f"({self._basis('move')}), a look {self.look_s:.1f} s ({self._basis('look')}), "
            f"a manipulation {self.manipulation_s:.1f} s ({self._basis('manipulation')})"
        )

    def _basis(self, kind: str) -> str:
        count = self.samples.get(kind, 0)
        return f"residual {self.residual_s[kind]:.1f} s over {count}" if count else "assumed: the log has none"

    def spread_s(self, events: Iterable[Event]) -> float | None:
        """Root mean square error of a predicted duration, if each action errs independently by the residual of its
        kind; None where the log has fewer than two actions of a kind, whose spread it does not tell."""
        acted = (e for e in events if isinstance(e, ActionEnded) and e.success)
        kinds = [KIND_OF.get(event.step.action, "manipulation") for event in acted]
        if any(self.samples.get(kind, 0) < 2 for kind in kinds):
            return None
        return sqrt(sum(self.residual_s[kind] ** 2 for kind in kinds))

    @property
    def look_ns(self) -> int:
        return round(self.look_s * NANO)

    @property
    def manipulation_ns(self) -> int:
        return round(self.manipulation_s * NANO)


SIMULATED = Durations()
"""The simulated world's: 1 s a metre, 2 s a look, 5 s a manipulation."""

KIND_OF = {"move": "move", "search": "look"}
"""The kind of action by whose speed it is predicted; all others are manipulations."""

MIN_ACTIONS = 3
"""With fewer recorded actions of a kind, its spread cannot be estimated; without any, the simulator's figure is
used."""


def fitted_durations(actions: Iterable[ActionFinished]) -> Durations:
    """Durations fitted to the successful actions of a log."""
    done = [a for a in actions if a.success and a.stamp.ns >= a.start.ns]
    moves = [(a.travel_m, _seconds(a)) for a in done if a.action == "move" and a.travel_m > 0]
    looks = [_seconds(a) for a in done if a.action == "search"]
    handled = [_seconds(a) for a in done if a.action not in ("move", "search")]
    move_s, metre_s, move_left = _line(moves)
    look_s, look_left = _mean(looks, SIMULATED.look_s)
    manipulation_s, manipulation_left = _mean(handled, SIMULATED.manipulation_s)
    return Durations(
        metre_s=metre_s,
        move_s=move_s,
        look_s=look_s,
        manipulation_s=manipulation_s,
        residual_s={"move": move_left, "look": look_left, "manipulation": manipulation_left},
        samples={"move": len(moves), "look": len(looks), "manipulation": len(handled)},
    )


def _seconds(action: ActionFinished) -> float:
    return (action.stamp.ns - action.start.ns) / NANO


def _line(moves: list[tuple[float, float]]) -> tuple[float, float, float]:
    """Start-up time, seconds for each metre, and residual of a least-squares line; the first two are never
    negative."""
    if not moves:
        return SIMULATED.move_s, SIMULATED.metre_s, 0.0
    metres, seconds = np.array(moves, dtype=np.float64).T
    start, slope = 0.0, float(seconds @ metres / (metres @ metres))
    if len(moves) >= MIN_ACTIONS and np.ptp(metres) > 0:
        fitted_slope, fitted_start = np.polyfit(metres, seconds, 1)
        if fitted_start > 0 and fitted_slope > 0:
            start, slope = float(fitted_start), float(fitted_slope)
    left = seconds - start - slope * metres
    return start, slope, sqrt(float(np.mean(left**2)))


def _mean(seconds: list[float], otherwise: float) -> tuple[float, float]:
    if not seconds:
        return otherwise, 0.0
    values = np.array(seconds, dtype=np.float64)
    return float(values.mean()), float(values.std())
