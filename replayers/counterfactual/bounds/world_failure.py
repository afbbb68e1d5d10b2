"""Failures of a strategy in some world that is consistent with a log.

Over the log alone it may end undetermined before its code meets what breaks it.
"""

from __future__ import annotations

from dataclasses import dataclass

from replayers.counterfactual.run_tree import Node, RunTree
from workbench.execution.events import RunStatus


@dataclass(frozen=True, slots=True)
class WorldFailure:
    """How a strategy broke in an imagined world.

    Attributes:
        reason: why its run ended.
        looked_into: the container of its last imputed look; None where the log shows the contents of all looks.
    """

    reason: str
    looked_into: str | None

    @property
    def message(self) -> str:
        """The reason and where it broke, in words."""
        if self.looked_into is None:
            return f"{self.reason} (asked again)"
        return f"{self.reason} (after it looked into {self.looked_into}, which nobody opened)"


def failure_in_worlds(tree: RunTree) -> WorldFailure | None:
    """How the strategy broke in the first explored world in which it did; None if it broke in none."""
    waiting: list[tuple[Node, str | None]] = [(tree.root, None)]
    met: set[int] = set()
    for node, looked_into in waiting:
        segment = node.segment
        if segment is None or id(node) in met:
            continue
        met.add(id(node))
        if segment.ended is not None and segment.ended.status is RunStatus.PLANNER_FAILED:
            return WorldFailure(segment.ended.reason, looked_into)
        if segment.unobserved is not None:
            waiting += [(child, segment.unobserved.container) for child in node.children.values()]
    return None
