"""Type aliases of NumPy arrays for annotations; the docstrings of their users give the shapes."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt

Floats = npt.NDArray[np.float64]
Floats32 = npt.NDArray[np.float32]
Floats16 = npt.NDArray[np.float16]
Ints = npt.NDArray[np.int64]
Ints32 = npt.NDArray[np.int32]
Ints16 = npt.NDArray[np.int16]
Ints8 = npt.NDArray[np.int8]
Uints64 = npt.NDArray[np.uint64]
Uints32 = npt.NDArray[np.uint32]
Uints16 = npt.NDArray[np.uint16]
Uints8 = npt.NDArray[np.uint8]
"""Pictures, bins of features, bytes, and indices in compiled programs."""
Indices = npt.NDArray[np.intp]
"""What NumPy takes as an index: positions in another array."""
Bools = npt.NDArray[np.bool_]
AnyArray = npt.NDArray[Any]
"""An array of any kind, as a file holds it."""
