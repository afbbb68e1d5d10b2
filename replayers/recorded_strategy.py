"""The name by which a log's own strategy can be loaded here; logs of "module:Class" hold the planner's own name."""

from __future__ import annotations

from replayers.run import Run
from replayers.sandbox import is_foreign
from workbench.errors import NotFound, UnknownName


class RecordedBySomebodyElse(NotFound):
    """A log whose strategy is neither built in nor installed."""

    def __init__(self, run: Run) -> None:
        super().__init__(
            f"{run.path}: the strategy that recorded it, {run.info.strategy}, is not known here. "
            "Name it with --strategy module:Class, or install its package."
        )


def known_here(run: Run) -> str:
    """The name of the run's own strategy.

    Raises:
        RecordedBySomebodyElse: no strategy of that name is here.
    """
    name = run.info.strategy
    try:
        is_foreign(name)
    except UnknownName as error:
        raise RecordedBySomebodyElse(run) from error
    return name
