"""Array types used across the package."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from qlb.errors import InputError

FloatArray = npt.NDArray[np.float64]
IntArray = npt.NDArray[np.int32]
LongArray = npt.NDArray[np.int64]
BoolArray = npt.NDArray[np.bool_]


def vectors(name: str, value: npt.ArrayLike, shape: tuple[int, ...]) -> FloatArray:
    """`value` as a float64 array of `shape`, broadcast where needed; a copy.

    Raises:
        InputError: not numbers, another shape, or an entry that is not finite; the message names `name` and the entry.
    """
    try:
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise InputError(f"{name} = {value!r} is not an array of numbers") from None
    if array.shape not in (shape, shape[-1:]):
        allowed = " or ".join(str(s) for s in dict.fromkeys([shape[-1:], shape])) if shape else "one number"
        raise InputError(f"{name} has shape {array.shape}, must be {allowed}")
    bad = np.argwhere(~np.isfinite(array))
    if len(bad):
        where = f" of node {bad[0][0]}" if array.ndim > 1 else ""
        raise InputError(f"{name}{where} is {array[bad[0][0]] if array.ndim > 1 else array}, must be finite")
    return np.array(np.broadcast_to(array, shape), order="C")


def whole_number(name: str, value: object, low: int, high: int) -> int:
    """`value` as an int, which must be a whole number from `low` to `high`."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or not low <= value <= high:  # type: ignore[operator]
        raise InputError(f"{name} {value!r} is out of range: a whole number, {low} to {high}")
    return int(value)  # type: ignore[call-overload, no-any-return]
