"""A seeded choice of the containers whose contents the robot knows at the start: at most 20 % of all."""

from __future__ import annotations

import numpy as np

from workbench.errors import BadValue
from workbench.worlds.house import ContainerId, FloorPlan

MAX_KNOWN_SHARE = 0.2
"""At most this share of the containers is known at the start (docs/architecture.md)."""


def known_at_start(
    plan: FloorPlan, *, rng: np.random.Generator, most: float = MAX_KNOWN_SHARE
) -> tuple[ContainerId, ...]:
    """Draw the containers whose contents are known, in the plan's order.

    The number is uniform between 0 and the given share of the containers, rounded down.

    Raises:
        BadValue: a share outside [0, 1].
    """
    if not 0 <= most <= 1:
        raise BadValue("share of containers known at the start", most, "within [0, 1]")
    containers = [container.id for container in plan.containers]
    count = int(rng.integers(0, int(most * len(containers)) + 1))
    chosen = set(rng.choice(len(containers), size=count, replace=False).tolist()) if count else set[int]()
    return tuple(c for i, c in enumerate(containers) if i in chosen)
