"""Looks of a driven robot: when standing at a container is another look into it, and how it was made."""

from __future__ import annotations

from collections.abc import Iterable
from dataclasses import dataclass, field
from math import atan2, hypot
from typing import final

from workbench.execution.events import LookMade
from workbench.execution.further_looks import how_looked
from workbench.log_schema.events import NANO
from workbench.planning.tasks import Task
from workbench.worlds.geometry import Point, Pose
from workbench.worlds.house import Container, Item
from workbench.worlds.knowledge import Knowledge
from workbench.worlds.perception import VIEWPOINT_M, Perception
from workbench.worlds.world import LookResult

DWELL_S, LOOK_S = 2.0, 4.0
"""Standing for DWELL_S is an arrival; for LOOK_S at a container, a look into it."""


@final
@dataclass(slots=True)
class LooksOfVisit:
    """The looks that one visit to a container has had so far.

    A container that was looked into before is looked into again by standing at it for LOOK_S on another visit, from
    another viewpoint, or after it was opened; and at any time by what no earlier look showed.

    Attributes:
        until_ns: when the last of them ended; 0 before the first.
    """

    until_ns: int = 0
    _visit: int = -1
    _from: list[Point] = field(default_factory=list)

    def begin(self, visit: int) -> None:
        """Forget the looks of earlier visits."""
        if visit != self._visit:
            self._visit = visit
            self.forget()

    def forget(self) -> None:
        """The container was opened: what was seen before shows the door."""
        self.until_ns, self._from = 0, []

    def add(self, viewpoint: Point, end_ns: int) -> None:
        self.until_ns = end_ns
        self._from.append(viewpoint)

    def start_ns(self, still_ns: int) -> int:
        """When a look began that is not over, of a robot that has stood still since `still_ns`."""
        return max(still_ns, self.until_ns)

    def has_ended(self, start_ns: int, now_ns: int, *, first: bool) -> bool:
        """Whether a look that began at `start_ns` has lasted long enough if it ends now.

        Args:
            first: whether it is the first one into the container.
        """
        return now_ns - start_ns >= (DWELL_S if first else LOOK_S) * NANO

    def is_another(self, viewpoint: Point, items: Iterable[Item], shown: Iterable[Item]) -> bool:
        """Whether a look into a container that was looked into before is another one.

        Args:
            items: what it shows. shown: what the looks before it showed.
        """
        if all(hypot(viewpoint[0] - x, viewpoint[1] - y) > VIEWPOINT_M for x, y in self._from):
            return True
        known = {item.id for item in shown}
        return any(item.id not in known for item in items)


def look_made(
    perception: Perception, task: Task, knowledge: Knowledge, container: Container, robot: Point, result: LookResult
) -> LookMade | None:
    """How a driven robot looked, before its knowledge has the look; None where looks show everything.

    Its heading, which is not known here, is taken as towards the container.
    """
    to = container.pose
    heading_rad = atan2(to.y_m - robot[1], to.x_m - robot[0])
    return how_looked(
        result.container,
        knowledge.looks(container.id) + 1,
        perception=perception,
        task=task,
        viewpoint=Pose(x_m=robot[0], y_m=robot[1], yaw_rad=heading_rad),
        duration_ns=result.end_ns - result.start_ns,
    )
