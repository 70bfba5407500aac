"""Values of loads, constant or in time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy.typing as npt

from qlb.arrays import FloatArray, vectors

InTime: TypeAlias = npt.ArrayLike | Callable[[float], npt.ArrayLike]
"""A number or vectors, or a function of time [s] that gives them, such as a `TimeTable` or a `TimeExpression`."""


def at_time(name: str, value: InTime, time: float, shape: tuple[int, ...]) -> FloatArray:
    """`value` at `time` [s] as an array of `shape`. Raises `InputError` where it is none."""
    if not callable(value):
        return vectors(name, value, shape)
    return vectors(f"{name} at time {time:g} s", value(time), shape)


def check_constant(name: str, value: InTime, shape: tuple[int, ...]) -> None:
    """Refuse at once what needs no time to be known as wrong."""
    if not callable(value):
        vectors(name, value, shape)
