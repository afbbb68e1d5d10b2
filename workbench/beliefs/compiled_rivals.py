"""The probability that each of several rival containers in a room has the one item that the room has, compiled with
numba.

The first call on a machine compiles for a few seconds and keeps the result beside this file, or in numba's own
cache where that cannot be written.
"""

# pyright: reportUntypedFunctionDecorator=false, reportMissingTypeStubs=false
from __future__ import annotations

import numpy as np

from workbench.arrays import Floats, Ints
from workbench.third_party.kernels import kernel


@kernel()
def share_among_rivals(
    rates: Floats, room: Ints, nodes: Floats, weights: Floats
) -> Floats:  # pragma: no cover (compiled)
    """The probability of each container to hold an item that its room holds once, shape (items, containers).

    Args:
        rates: shape (items, containers).
        room: room index of each container, shape (containers,).
        nodes, weights: quadrature rule on [0, 1].
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
