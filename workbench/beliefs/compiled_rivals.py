"""Who of the rivals of a room has what the room has once? The sums of `placements.py`, compiled.

The first call on a machine compiles for a few seconds and keeps the result beside this file, or in numba's own
cache where that cannot be written.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

import numpy as np
import numpy.typing as npt
from numba import njit

Floats = npt.NDArray[np.float64]


@njit(cache=True, nogil=True)
def share_among_rivals(
    rates: Floats, room: npt.NDArray[np.int64], nodes: Floats, weights: Floats
) -> Floats:  # pragma: no cover (compiled)
    """The chance of each container to have what its room has once, shape (items, containers).

    Args:
        rates: shape (items, containers).
        room: of each container, shape (containers,).
        nodes, weights: of a quadrature rule on [0, 1].
    """
    items, containers = rates.shape
    chance = np.zeros((items, containers))
    for i in range(items):
        for c in range(containers):
            for n in range(len(nodes)):
                product = weights[n]
                for other in range(containers):
                    if other != c and room[other] == room[c]:
                        product *= 1.0 - rates[i, other] * (1.0 - nodes[n])
                chance[i, c] += product
            chance[i, c] *= rates[i, c]
    return chance
