"""Settings models: one definition gives the Python arguments, the scene keys, the errors and the schema."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Annotated, Any, Self, TypeVar, get_args

import numpy as np
from pydantic import (
    AfterValidator,
    BaseModel,
    ConfigDict,
    Field,
    PlainSerializer,
    ValidationError,
    ValidationInfo,
    WithJsonSchema,
    field_validator,
)
from pydantic._internal._model_construction import ModelMetaclass
from pydantic_core import PydanticSerializationError

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.fields import Expression, Function, RegionTable, TimeFunction, Varying
from qlb.mesh.tet_mesh import TetMesh
from qlb.setting_keys import setting_error


def plain(value: Any) -> Any:
    """The value of a field as plain data. Raises `InputError` for a Python function."""
    if isinstance(value, Varying | TimeFunction):
        return value.written()
    if callable(value):
        name = getattr(value, "__name__", type(value).__name__)
        raise InputError(f"the function {name} cannot be written to a scene file; use expressions")
    if isinstance(value, Path):
        return str(value.absolute())
    return value.tolist() if isinstance(value, np.ndarray | np.generic) else value


def _path(path: Path) -> Path:
    if "\0" in str(path) or max(map(len, path.parts), default=0) > LONGEST_NAME:
        raise InputError(f"{str(path)[:60]!r} is no name of a file")
    return path


FilePath = Annotated[Path, AfterValidator(_path), PlainSerializer(plain, when_used="json")]
"""A file. In a scene file it is relative to that file; it is written as absolute."""

_NUMBER = {"type": "number"}
_PER_ELEMENT: dict[str, Any] = {
    "anyOf": [
        _NUMBER,
        {"type": "string"},
        {"type": "array", "items": _NUMBER},
        {"type": "object", "patternProperties": {"^(-?[0-9]+|default)$": _NUMBER}, "additionalProperties": False},
    ]
}

PerElement = Annotated[
    float | FloatArray | Varying, PlainSerializer(plain, when_used="json"), WithJsonSchema(_PER_ELEMENT)
]
"""A value in each element: one number for all, an array (m,), a table by region {1: 2e4, "default": 5e4}, an expression
of the rest position such as "2e4 * (1 + x)", or a function of the elements' centroids (m, 3) [m] that gives (m,)."""

T = TypeVar("T", bound="Settings")

LONGEST_NAME = 255
"""Characters of a part of a path."""

_BOUNDS = {"gt": ">", "ge": ">=", "lt": "<", "le": "<="}


def quantity(
    default: Any,
    description: str,
    *,
    unit: str = "",
    gt: float | None = None,
    ge: float | None = None,
    lt: float | None = None,
    le: float | None = None,
) -> Any:
    """A number (or an array of them, for a `PerElement` field) with its unit and allowed range."""
    bounds = {"gt": gt, "ge": ge, "lt": lt, "le": le}
    extra: dict[str, Any] = {"unit": unit, "bounds": {k: v for k, v in bounds.items() if v is not None}}
    return Field(default, description=description, json_schema_extra=extra)


def choice(default: str, description: str, options: Iterable[str]) -> Any:
    """One of a fixed set of names."""
    extra: dict[str, Any] = {"enum": list(options)}
    return Field(default, description=description, json_schema_extra=extra)


def describe_range(bounds: Mapping[str, float], unit: str = "") -> str:
    """The allowed range in words, such as "> -1 and < 0.5" or "finite"."""
    text = " and ".join(f"{_BOUNDS[name]} {limit:g}" for name, limit in bounds.items()) or "finite"
    return f"{text} {unit}".strip()


class _RaisesInputError(ModelMetaclass):
    """Turns pydantic's errors into `InputError` where a user constructs a model."""

    def __call__(cls, *args: Any, **kwargs: Any) -> Any:  # noqa: N805  (a metaclass)
        try:
            return super().__call__(*args, **kwargs)
        except ValidationError as error:
            raise setting_error(cls, error) from None  # type: ignore[arg-type]


class Settings(BaseModel, metaclass=_RaisesInputError):
    """Base of every settings model: immutable, refuses unknown keys, checks ranges, raises `InputError`."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True, validate_default=False)

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Self:
        """Build from plain data, such as a parsed scene file. Raises `InputError` naming the key."""
        try:
            return cls.model_validate(dict(data))
        except ValidationError as error:
            raise setting_error(cls, error) from None

    def model_dump(self, **options: Any) -> dict[str, Any]:
        """As pydantic's. Raises `InputError` for what plain data cannot hold, such as a Python function."""
        try:
            return super().model_dump(**options)
        except PydanticSerializationError as error:
            raise InputError(str(error).partition("InputError: ")[2] or str(error)) from None

    def __eq__(self, other: object) -> bool:
        """Whether both are of one class and have equal values."""
        if not isinstance(other, Settings) or type(self) is not type(other):
            return NotImplemented
        return all(_equal(getattr(self, name), getattr(other, name)) for name in type(self).model_fields)

    @field_validator("*", mode="before")
    @classmethod
    def _check_range(cls, value: Any, info: ValidationInfo) -> Any:
        field = cls.model_fields[str(info.field_name)]
        extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
        if "enum" in extra:
            options: Any = extra["enum"]
            if value not in options:
                raise ValueError(f"{value!r} is not known: must be one of {', '.join(options)}")
        if "bounds" in extra and value is not None:
            bounds: Any = extra["bounds"]
            if _may_vary(field.annotation):
                return within(value, bounds, str(extra["unit"]))
            return _checked(value, bounds, str(extra["unit"]), whole=field.annotation in (int, int | None))
        return value


def on_mesh(settings: T, owner: str, mesh: TetMesh) -> T:
    """A copy in which each `PerElement` is a number or an array (m,), checked in every element of `mesh`.

    Args:
        settings: what has the parameters.
        owner: what to call it in an error, such as "material".
        mesh: with m elements.

    Raises:
        InputError: an array of another length, a region that a table lacks, a value out of range or not finite in some
            element. The message names the parameter and the element.
    """
    values = {}
    for name, field in type(settings).model_fields.items():
        value = getattr(settings, name)
        if _may_vary(field.annotation) and isinstance(value, np.ndarray | Varying):
            extra: Any = field.json_schema_extra or {}
            bounds, unit = extra.get("bounds", {}), str(extra.get("unit", ""))
            values[name] = element_values(f"{owner} {name}", value, bounds, unit, mesh)
    return settings.model_copy(update=values)


def require_numbers(settings: Settings, owner: str) -> None:
    """Raise `InputError` where a parameter has its values only on a mesh."""
    for name in type(settings).model_fields:
        value = getattr(settings, name)
        if isinstance(value, Varying):
            raise InputError(f"{owner} {name} is {value}: it has its values only on a mesh, see {owner}.on(mesh)")


def element_values(
    name: str, value: FloatArray | Varying, bounds: Mapping[str, float], unit: str, mesh: TetMesh
) -> FloatArray:
    """`value` in each element of `mesh`, shape (m,), within `bounds`. Raises `InputError` as `on_mesh`, with `name`."""
    count = len(mesh.tets)
    try:
        values = value.on(mesh) if isinstance(value, Varying) else value
    except InputError as error:
        raise InputError(f"{name}: {error}") from None
    if values.shape != (count,):
        raise InputError(f"{name} has shape {values.shape}, must be one number or ({count},)")
    bad = _outside(values, bounds)
    if bad.any():
        e = int(np.argmax(bad))
        allowed = describe_range(bounds, unit) if np.isfinite(values[e]) else "finite"
        raise InputError(f"{name} of element {e} = {values[e]:g} is out of range: must be {allowed}")
    values.setflags(write=False)
    return values


def within(value: Any, bounds: Mapping[str, float], unit: str = "") -> Any:
    """`value` as one of the kinds of `PerElement`. Raises `ValueError` where what is known without a mesh is wrong."""
    return _checked(_as_varying(value, unit), bounds, unit, whole=False)


def _may_vary(annotation: Any) -> bool:
    """Whether a field of this type is a `PerElement`."""
    return annotation is Varying or any(map(_may_vary, get_args(annotation)))


def _as_varying(value: Any, unit: str) -> Any:
    """`value`, made a table, an expression or a function where it is written as one."""
    if isinstance(value, Mapping):
        return RegionTable.parse(value)
    if isinstance(value, str) and not _is_number(value):
        _refuse_unit(value, unit)
        return Expression(value)
    return Function(value) if callable(value) else value


def _is_number(text: str) -> bool:
    try:
        float(text)
    except ValueError:
        return False
    return True


def _equal(a: Any, b: Any) -> bool:
    if isinstance(a, dict) and isinstance(b, dict):
        return a.keys() == b.keys() and all(_equal(value, b[key]) for key, value in a.items())
    if isinstance(a, np.ndarray) or isinstance(b, np.ndarray):
        return isinstance(a, np.ndarray) and isinstance(b, np.ndarray) and np.array_equal(a, b)
    return bool(a == b)


def _checked(value: Any, bounds: Mapping[str, float], unit: str, *, whole: bool) -> Any:
    """`value` as a float, an array of floats or (where `whole`) an int, all of it within `bounds`.

    Of what varies in space, what is known without a mesh is checked: the values of a table, and those of an expression
    without x, y and z.
    """
    if isinstance(value, Varying):
        for where, number in _known_values(value):
            if _outside(np.float64(number), bounds):
                raise ValueError(f"{where} = {number:g} is out of range: must be {describe_range(bounds, unit)}")
        return value
    numbers = _as_numbers(value, unit)
    bad = _outside(numbers, bounds)
    if whole:
        bad |= np.floor(numbers) != numbers
    if bad.any():
        where = "" if numbers.ndim == 0 else f" at index {int(np.argmax(bad))}"
        first = float(numbers[bad][0]) if numbers.ndim else float(numbers)
        kind = "a whole number " if whole else ""
        raise ValueError(f"{first:g}{where} is out of range: must be {kind}{describe_range(bounds, unit)}")
    if numbers.ndim:
        numbers.setflags(write=False)
        return numbers
    return int(numbers) if whole else float(numbers)


def _known_values(value: Varying) -> list[tuple[str, float]]:
    """Where in `value`, and which number, for those that are known without a mesh."""
    if isinstance(value, RegionTable):
        return [(f"region {key}" if isinstance(key, int) else key, v) for key, v in value.written().items()]
    if isinstance(value, Expression) and value.is_constant:
        return [(str(value), float(value.at(np.zeros((1, 3)))[0]))]
    return []


def _as_numbers(value: Any, unit: str) -> FloatArray:
    if isinstance(value, str):
        _refuse_unit(value, unit)
    try:
        if isinstance(value, bool):
            raise TypeError
        return np.array(value, dtype=np.float64)
    except (TypeError, ValueError, OverflowError):
        raise ValueError(f"{value!r} is not a number") from None


def _refuse_unit(text: str, unit: str) -> None:
    """Raise `ValueError` for a number with a unit behind it."""
    if re.fullmatch(r"[-+.\d]++(e[-+]?\d+)?+ *(?![xyzt]$)[^\W\d][\w/^ ]*", text.strip(), re.IGNORECASE):
        raise ValueError(f"{text!r} is not a number: write it without a unit{unit and f', in {unit}'}")


def _outside(numbers: FloatArray | np.float64, bounds: Mapping[str, float]) -> Any:
    """Where `numbers` are not finite or not within `bounds`."""
    bad = ~np.isfinite(numbers)
    for name, limit in bounds.items():
        bad |= ~_satisfies(name, numbers, limit)
    return bad


def _satisfies(name: str, numbers: FloatArray | np.float64, limit: float) -> Any:
    with np.errstate(invalid="ignore"):
        return {
            "gt": np.greater,
            "ge": np.greater_equal,
            "lt": np.less,
            "le": np.less_equal,
        }[name](numbers, limit)
