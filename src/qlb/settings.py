"""Settings models: one definition gives the Python arguments, the scene keys, the errors and the schema."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Mapping
from typing import Any, Self, get_args

import numpy as np
from pydantic import BaseModel, ConfigDict, Field, ValidationError, ValidationInfo, field_validator
from pydantic._internal._model_construction import ModelMetaclass
from pydantic.fields import FieldInfo

from qlb.arrays import FloatArray
from qlb.errors import InputError

PerElement = float | FloatArray
"""One value for all elements, or an array with one value per element."""

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
            raise InputError(_one_line(cls, error)) from None  # type: ignore[arg-type]


class Settings(BaseModel, metaclass=_RaisesInputError):
    """Base of every settings model: immutable, refuses unknown keys, checks ranges, raises `InputError`."""

    model_config = ConfigDict(extra="forbid", frozen=True, arbitrary_types_allowed=True, validate_default=False)

    @classmethod
    def parse(cls, data: Mapping[str, Any]) -> Self:
        """Build from plain data, such as a parsed scene file. Raises `InputError` naming the key."""
        try:
            return cls.model_validate(dict(data))
        except ValidationError as error:
            raise InputError(_one_line(cls, error)) from None

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
            return _checked(value, bounds, str(extra["unit"]), whole=field.annotation is int)
        return value


def _checked(value: Any, bounds: Mapping[str, float], unit: str, *, whole: bool) -> Any:
    """`value` as a float, an array of floats or (where `whole`) an int, all of it within `bounds`."""
    numbers = _as_numbers(value)
    bad = ~np.isfinite(numbers)
    for name, limit in bounds.items():
        bad |= ~_satisfies(name, numbers, limit)
    if whole:
        bad |= np.floor(numbers) != numbers
    if bad.any():
        where = "" if numbers.ndim == 0 else f" at index {int(np.argmax(bad))}"
        first = float(numbers[bad][0]) if numbers.ndim else float(numbers)
        kind = "a whole number " if whole else ""
        raise ValueError(f"{first:g}{where} is out of range: must be {kind}{describe_range(bounds, unit)}")
    if numbers.ndim:
        return numbers
    return int(numbers) if whole else float(numbers)


def _as_numbers(value: Any) -> FloatArray:
    try:
        if isinstance(value, bool):
            raise TypeError
        return np.asarray(value, dtype=np.float64)
    except (TypeError, ValueError):
        raise ValueError(f"{value!r} is not a number") from None


def _satisfies(name: str, numbers: FloatArray, limit: float) -> Any:
    with np.errstate(invalid="ignore"):
        return {
            "gt": np.greater,
            "ge": np.greater_equal,
            "lt": np.less,
            "le": np.less_equal,
        }[name](numbers, limit)


def _one_line(model: type[BaseModel], error: ValidationError) -> str:
    """The first problem of a ValidationError in one line, and how many there are."""
    problems = error.errors()
    first = problems[0]
    key, beside = _locate(model, first["loc"])
    if first["type"] == "extra_forbidden":
        text = unknown_key(key, beside)
    elif first["type"] == "union_tag_invalid":
        context = first["ctx"]
        options = context["expected_tags"].replace("'", "")
        text = f"{key}.model: {context['tag']!r} is not known: must be one of {options}"
    else:
        message = first["msg"].removeprefix("Value error, ")
        own_words = first["type"] == "value_error"
        text = f"{key}: {message}" if own_words else f"{key} = {_short(first['input'])}: {message}"
    more = len(problems) - 1
    return text if more == 0 else f"{text} (and {more} more)"


def _locate(model: type[BaseModel], location: tuple[int | str, ...]) -> tuple[str, list[str]]:
    """The dotted key of an error's location, and the keys that are valid beside it.

    Left out are the tags that pydantic puts into a location for the member of a union.
    """
    parts: list[str] = []
    members, beside = [model], [model]
    for part in location:
        tagged = [m for m in members if "model" in m.model_fields and m.model_fields["model"].default == part]
        if tagged and not any(part in m.model_fields for m in members):
            members = tagged
            continue
        beside = members
        fields = [m.model_fields[str(part)] for m in members if part in m.model_fields]
        members = nested_models(fields[0].annotation) if fields else []
        parts.append(str(part))
    prefix = "".join(f"{part}." for part in parts[:-1])
    return ".".join(parts), [prefix + name for m in beside for name in m.model_fields]


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def unknown_key(key: str, valid: Iterable[str]) -> str:
    """The error for a key that is not one of `valid`, with the nearest that is."""
    valid = list(valid)
    near = difflib.get_close_matches(key, valid, n=1, cutoff=0.6)
    hint = f"did you mean '{near[0]}'?" if near else f"valid keys: {', '.join(valid)}"
    return f"unknown key '{key}'; {hint}"


def key_fields(model: type[BaseModel], prefix: str = "") -> dict[str, FieldInfo]:
    """Every key of a settings model, dotted, with its field: `{"mesh.size": ..., "step": ...}`.

    Where a key holds one of several models, such as a material, the keys of all are there.
    """
    fields: dict[str, FieldInfo] = {}
    for name, field in model.model_fields.items():
        inner = nested_models(field.annotation)
        for member in inner:
            fields |= key_fields(member, f"{prefix}{name}.")
        if not inner:
            fields[prefix + name] = field
    return fields


def nested_models(annotation: Any) -> list[type[BaseModel]]:
    """The settings models that a field can hold: one, the members of a union, or none."""
    if isinstance(annotation, type):
        return [annotation] if issubclass(annotation, BaseModel) else []
    return [model for argument in get_args(annotation) for model in nested_models(argument)]
