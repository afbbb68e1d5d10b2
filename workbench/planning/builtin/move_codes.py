"""Integer codes of the compiled recipe search (astar.py).

They stand in a module of their own because importing numba takes a while.
"""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

FETCH, PLACE, CARRY, PREPARE, CHOOSE, DROP = range(6)
"""Moves of the search: (kind, slot or operation, place)."""

SOLVED, NO_PLAN, LIMIT = range(3)
"""How the search ended."""
