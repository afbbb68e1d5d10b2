"""Distances from the robot's location, or a stop on its path, in the order of a log's locations."""

from __future__ import annotations

from collections.abc import Mapping

from workbench.arrays import Floats
from workbench.worlds.house import LocationId
from workbench.worlds.knowledge import Knowledge


def travel_row(
    knowledge: Knowledge, index: Mapping[LocationId, int], metres: Floats, *, share: float = 1.0
) -> Floats | None:
    """Metres from where the robot is to every location; float64, shape (locations,); None if there is no way.

    Args:
        index: the rows of the log's locations in `metres`.
        share: what distances from a stop, which have no row, are multiplied by.
    """
    here = index.get(knowledge.robot_at)
    if here is not None:
        return metres[here]
    if not knowledge.travel.reaches(knowledge.robot_at):
        return None
    return knowledge.travel.metres[knowledge.travel.index(knowledge.robot_at), : len(metres)] * share
