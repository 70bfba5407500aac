"""Arrays as short texts: quantised, differences from row to row, deflated, base64; web/src/packing.ts reads them."""

from __future__ import annotations

import base64
import zlib
from dataclasses import dataclass
from typing import Any

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray

_LEVEL = 6
_DIGITS = 6
_UNSIGNED: dict[int, Any] = {1: np.uint8, 2: np.uint16, 4: np.uint32}
_SIGNED: dict[int, Any] = {1: np.int8, 2: np.int16, 4: np.int32}


def pack(rows: npt.NDArray[np.unsignedinteger[Any]]) -> str:
    """Unsigned integers of 1, 2 or 4 bytes, shape (r, c), as text.

    Each row becomes its difference from the row before, modulo 2^bits; differences are folded (0, -1, 1, -2, ... as
    0, 1, 2, 3, ...), so that small ones have small bytes; all lowest bytes come first, then all next ones.
    """
    size = rows.dtype.itemsize
    steps = np.diff(rows, axis=0, prepend=np.zeros((1, rows.shape[1]), rows.dtype)).view(_SIGNED[size])
    folded = ((steps << 1) ^ (steps >> (8 * size - 1))).view(_UNSIGNED[size])
    planes = np.ascontiguousarray(folded, dtype=f"<u{size}").view(np.uint8).reshape(-1, size).T
    return base64.b64encode(zlib.compress(planes.tobytes(), _LEVEL)).decode("ascii")


@dataclass(frozen=True)
class Quantised:
    """Numbers between `low` and `high` as unsigned integers; off by at most half of (high - low) / (2^bits - 1)."""

    low: FloatArray
    high: FloatArray
    integers: npt.NDArray[np.unsignedinteger[Any]]

    @staticmethod
    def of(values: FloatArray, low: npt.ArrayLike, high: npt.ArrayLike, *, bits: int) -> Quantised:
        """Quantise `values`; what lies outside [low, high], which broadcast to them, is clipped."""
        first, last = np.asarray(low, np.float64), np.asarray(high, np.float64)
        top = float(2**bits - 1)
        scale = top / np.where(last > first, last - first, 1.0)
        integers = np.clip(np.rint((values - first) * scale), 0, top).astype(_UNSIGNED[bits // 8])
        return Quantised(first, last, integers)

    def data(self) -> dict[str, Any]:
        """For the page: `low`, `high` and the packed integers, the first axis as rows."""
        rows = self.integers.reshape(len(self.integers), -1)
        return {"low": self.low.tolist(), "high": self.high.tolist(), "data": pack(rows)}


def positions_data(positions: FloatArray) -> dict[str, Any]:
    """Positions (f, v, 3) in 16 bits an axis, relative to the box that holds them; all x, then all y, then all z."""
    low, high = positions.min(axis=(0, 1)), positions.max(axis=(0, 1))
    by_axis = np.ascontiguousarray(positions.transpose(0, 2, 1))
    return Quantised.of(by_axis, low[:, None], high[:, None], bits=16).data() | {
        "low": low.tolist(),
        "high": high.tolist(),
    }


def numbers(values: npt.ArrayLike) -> list[float | int | None]:
    """For JSON: short, and null for what is not finite."""
    array = np.asarray(values)
    if array.dtype.kind in "iub":
        return list(array.tolist())
    return [float(f"{value:.{_DIGITS}g}") if np.isfinite(value) else None for value in array.tolist()]
