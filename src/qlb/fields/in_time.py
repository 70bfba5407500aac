"""Quantities that change with time: expressions in t, and tables of keyframes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, field
from typing import Any

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.fields.formula import Formula

VARIABLES = ("t",)
Shape = tuple[int, ...]


class TimeFunction(ABC):
    """A number or a vector as a function of time, which a scene file can hold: immutable, equal where written alike."""

    @property
    @abstractmethod
    def shape(self) -> Shape:
        """Of each value: () for a number, (d,) for a vector."""

    @abstractmethod
    def __call__(self, time: float) -> FloatArray:
        """Its value at `time` [s]."""

    @abstractmethod
    def written(self) -> Any:
        """Plain data that gives it back, for a scene file."""


@dataclass(frozen=True)
class TimeExpression(TimeFunction):
    """A formula of the time t [s], such as "100 * sin(2 * pi * t)", or one for each component of a vector.

    Attributes:
        text: the formula, or formulas and numbers such as ("0", "-9.81 * minimum(t, 1)", 0).

    Raises:
        InputError: something that a formula cannot hold; the message names it, with its column.
    """

    text: str | Sequence[str | float]
    _formulas: tuple[Formula, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        alone = isinstance(self.text, str)
        components: Sequence[Any] = [self.text] if alone else list(self.text)
        if not components or not all(_is_component(part) for part in components):
            raise InputError(f"{self.text!r} must be an expression in t, or a list of them")
        object.__setattr__(self, "_formulas", tuple(Formula(str(part), VARIABLES) for part in components))
        kept = tuple(" ".join(part.split()) if isinstance(part, str) else float(part) for part in components)
        object.__setattr__(self, "text", kept[0] if alone else kept)

    @property
    def shape(self) -> Shape:
        """() for one formula, (d,) for a list of d."""
        return () if isinstance(self.text, str) else (len(self.text),)

    def __call__(self, time: float) -> FloatArray:
        """Its value at `time` [s]; infinite or NaN where it is not defined."""
        values = np.array([float(formula(time)) for formula in self._formulas])
        return values.reshape(self.shape)

    def written(self) -> str | list[str | float]:
        """The text, or the list of texts and numbers."""
        return self.text if isinstance(self.text, str) else list(self.text)


@dataclass(frozen=True)
class TimeTable(TimeFunction):
    """Values at some times [s], linear between them, constant before the first and after the last.

    Attributes:
        times: increasing, shape (k,) with k >= 1.
        values: numbers, shape (k,), or vectors, shape (k, d).

    Raises:
        InputError: times that do not increase, values of another number or shape, something that is not finite.
    """

    times: npt.ArrayLike
    values: npt.ArrayLike
    _times: FloatArray = field(init=False, repr=False, compare=False)
    _values: FloatArray = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        times, values = _numbers("times", self.times), _numbers("values", self.values)
        if times.ndim != 1 or len(times) == 0:
            raise InputError(f"times of a table have shape {times.shape}, must be (k,) with k >= 1")
        if values.ndim not in (1, 2) or len(values) != len(times):
            shapes = f"({len(times)},) or ({len(times)}, d) for {len(times)} times"
            raise InputError(f"values of a table have shape {values.shape}, must be {shapes}")
        check_increasing("times of a table", times)
        object.__setattr__(self, "_times", times)
        object.__setattr__(self, "_values", values)
        object.__setattr__(self, "times", tuple(times.tolist()))
        rows = values.tolist()
        object.__setattr__(self, "values", tuple(rows if values.ndim == 1 else map(tuple, rows)))

    @staticmethod
    def parse(data: Mapping[object, object]) -> TimeTable:
        """From a mapping with the keys `times` and `values`. Raises `InputError` for another or a missing key."""
        for key in data:
            if key not in ("times", "values"):
                raise InputError(f"unknown key {key!r} in a table in time; valid keys: times, values")
        for key in ("times", "values"):
            if key not in data:
                raise InputError(f"a table in time lacks {key}, must have times and values")
        return TimeTable(data["times"], data["values"])  # type: ignore[arg-type]

    @property
    def shape(self) -> Shape:
        """() for numbers, (d,) for vectors."""
        return self._values.shape[1:]

    def __call__(self, time: float) -> FloatArray:
        """Its value at `time` [s]."""
        columns = self._values.reshape(len(self._times), -1).T
        return np.array([np.interp(time, self._times, column) for column in columns]).reshape(self.shape)

    def written(self) -> dict[str, Any]:
        """The mapping that gives it back."""
        return {"times": self._times.tolist(), "values": self._values.tolist()}


def in_time(value: Any, shape: Shape) -> float | tuple[float, ...] | TimeFunction:
    """A number (shape ()) or a vector (shape (d,)), constant or in time, from how it is written.

    Args:
        value: numbers, expressions in t, a mapping with `times` and `values`, or a `TimeFunction`.
        shape: that it must have.

    Raises:
        InputError: none of these, or of another shape.
    """
    if isinstance(value, Mapping):
        value = TimeTable.parse(value)
    elif any(isinstance(part, str) and not _is_number(part) for part in (value if _is_sequence(value) else [value])):
        value = TimeExpression(value)
    if isinstance(value, TimeFunction):
        if value.shape != shape:
            raise InputError(f"{_kind(value.shape)} in time is given, must be {_kind(shape)}")
        return value
    try:
        numbers = _numbers("values", value)
    except InputError:
        numbers = np.empty(0)
    if numbers.shape != shape:
        raise InputError(
            f"{value!r} must be {_kind(shape)}: constant, an expression in t, or a table"
            " {times: [...], values: [...]}"
        )
    return tuple(numbers.tolist()) if shape else float(numbers)


def check_increasing(name: str, times: FloatArray) -> None:
    """Raise `InputError` where `times` (k,) do not increase."""
    wrong = np.flatnonzero(np.diff(times) <= 0)
    if len(wrong):
        k = int(wrong[0])
        raise InputError(f"{name} must increase: number {k + 2} is {times[k + 1]:g} s, after {times[k]:g} s")


def _kind(shape: Shape) -> str:
    return f"a vector of {shape[0]}" if shape else "a number"


def _is_sequence(value: object) -> bool:
    return isinstance(value, Sequence) and not isinstance(value, str | bytes)


def _is_component(value: object) -> bool:
    return isinstance(value, str) or _is_number(value)


def _is_number(value: object) -> bool:
    """Whether it is a number, or the text of one (which YAML makes of 1e4)."""
    if isinstance(value, bool) or not isinstance(value, str | int | float | np.number):
        return False
    try:
        return bool(np.isfinite(float(value)))
    except (ValueError, OverflowError):
        return False


def _numbers(name: str, value: Any) -> FloatArray:
    """`value` as an array of finite numbers; a copy. Raises `InputError` where it is none."""
    try:
        given = np.ravel(np.array(value, dtype=object)) if _is_sequence(value) else np.empty(0, dtype=object)
        if isinstance(value, bool) or any(isinstance(part, bool) for part in given):
            raise TypeError
        array = np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name} = {_short(value)} are not numbers in lists of one length") from None
    if not np.isfinite(array).all():
        raise InputError(f"{name} = {_short(value)} must be finite")
    array.setflags(write=False)
    return array


def _short(value: object) -> str:
    text = " ".join(repr(value).split())
    return text if len(text) <= 60 else text[:57] + "..."
