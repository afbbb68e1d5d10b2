"""A belief and travel costs on common axes: the containers that a search can reach, with their distances.

Unreachable containers are left out: no search can find anything there. Under belief models that assume an instance,
that instance is then in a reachable container.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np

from workbench.arrays import Floats, Indices
from workbench.beliefs.belief import Belief
from workbench.errors import NotFound
from workbench.worlds.house import ContainerId, LocationId
from workbench.worlds.travel import TravelCosts


class LocationOutOfReach(NotFound):
    """An origin or target is not among the travel costs."""

    def __init__(self, location: str) -> None:
        super().__init__(
            f"location {location!r} is not among the travel costs. Give a container that can be reached, or 'start'."
        )


@dataclass(frozen=True, slots=True, kw_only=True)
class SearchSpace:
    """The searchable containers and the distances between them, in metres.

    Attributes:
        containers: reachable unsearched containers, in the belief's order.
        probability: shape (item types, containers).
        from_m: from each origin to each container, shape (origins, containers).
        to_m: from each container to each target, shape (containers, targets).
        between_m: between containers, shape (containers, containers).
    """

    containers: tuple[ContainerId, ...]
    probability: Floats
    from_m: Floats
    to_m: Floats
    between_m: Floats

    def over(self, candidates: Indices) -> tuple[Floats, Floats, Floats]:
        """Distances over candidates of shape (item types, k), as Eq. 1's programs take them.

        Returns:
            Between candidates, shape (item types, k, k); from the origins, shape (item types, origins, k);
            to the targets, shape (item types, k, targets).
        """
        return (
            self.between_m[candidates[:, :, None], candidates[:, None, :]],
            np.ascontiguousarray(self.from_m[:, candidates].swapaxes(0, 1)),
            self.to_m[candidates],
        )


def reachable(
    containers: tuple[ContainerId, ...], travel: TravelCosts
) -> tuple[tuple[ContainerId, ...], list[int] | None]:
    """Those of the containers that can be reached, and their indices; None for all of them."""
    if travel.reaches_all(containers):
        return containers, None
    columns = [j for j, c in enumerate(containers) if travel.reaches(LocationId(c))]
    return tuple(containers[j] for j in columns), columns


def search_space(
    belief: Belief, travel: TravelCosts, *, origins: Sequence[LocationId], targets: Sequence[LocationId]
) -> SearchSpace:
    """The reachable containers of a belief, with their distances.

    Raises:
        LocationOutOfReach: an origin or target that is not on the axis of the travel costs.
    """
    containers, columns = reachable(belief.containers, travel)
    probability = belief.probability if columns is None else np.ascontiguousarray(belief.probability[:, columns])
    at = travel.rows(containers)
    starts, ends = _indices(travel, origins), _indices(travel, targets)
    return SearchSpace(
        containers=containers,
        probability=probability,
        from_m=travel.metres[starts[:, None], at],
        to_m=travel.metres[at[:, None], ends],
        between_m=travel.metres[at[:, None], at],
    )


def _indices(travel: TravelCosts, locations: Sequence[LocationId]) -> Indices:
    for location in locations:
        if not travel.reaches(location):
            raise LocationOutOfReach(location)
    return np.array([travel.index(location) for location in locations], dtype=np.intp)
