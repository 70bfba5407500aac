"""Array types used across the package."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]
LongArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


def vector(value: npt.ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """`value` as a C-ordered float64 array of `shape` (a copy where needed)."""
    return np.ascontiguousarray(np.broadcast_to(np.asarray(value, dtype=np.float64), shape))
