"""The loadable name of the strategy that recorded a log, if it is one that a log may name.

Logs of "module:Class" hold what the planner calls itself. A log's name runs built-in and installed code alone; what
else it names, a user must name (workbench/plugins.py).
"""

from __future__ import annotations

from replayers.counterfactual.sandbox import is_foreign
from replayers.runs.run import Run
from workbench.errors import NotFound, UnknownName
from workbench.planning.solvers.registry import solver_plugin
from workbench.planning.strategies import canonical_name, solver_in
from workbench.plugins import NameOrigin, NotFromLog, quoted

NO_PLANNER = ("recorded", "operator")
"""Strategies of logs in which a person or an unnamed planner drove the robot."""


class UnknownRecordedStrategy(NotFound):
    """A log whose strategy, or its solver, is neither built in nor installed."""

    def __init__(self, run: Run) -> None:
        if run.info.strategy in NO_PLANNER:
            super().__init__(
                f"{run.path}: it holds what a robot did, not the strategy of a planner. "
                "Name one with --strategy, for instance -s model-lios."
            )
            return
        super().__init__(
            f"{run.path}: the strategy that recorded it, {quoted(run.info.strategy)}, is not known here: it is "
            "neither built in nor installed, and a log runs no other code. Name it with --strategy module:Class (or "
            "STRATEGY@SOLVER), or install its package."
        )


def loadable_name(run: Run, *, other_solver: bool = False) -> str:
    """The name of the run's own strategy.

    Args:
        other_solver: its solver is replaced, so that the one in STRATEGY@SOLVER does not matter.

    Raises:
        UnknownRecordedStrategy: no strategy of that name is built in or installed here, or its solver is not.
    """
    name = run.info.strategy
    base, solver = name.partition("@")[0], solver_in(name)
    try:
        is_foreign(name, origin=NameOrigin.LOG)
        if canonical_name(base) is not None and solver and not other_solver:
            solver_plugin(solver, origin=NameOrigin.LOG)
    except (UnknownName, NotFromLog) as error:
        raise UnknownRecordedStrategy(run) from error
    return name
