"""What do the numbers of the compiled search (recipe_search.py) mean? Apart from it: numba takes a while to load."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int64]

FETCH, PLACE, CARRY, PREPARE, CHOOSE, DROP = range(6)
"""Moves of the search: (kind, slot or operation, place)."""

SOLVED, NO_PLAN, LIMIT = range(3)
"""How it ended."""
