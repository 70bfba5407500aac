"""Keys of settings models: which there are, where an error lies, and what to say about it."""

from __future__ import annotations

import difflib
from collections.abc import Iterable, Iterator
from contextlib import contextmanager
from itertools import takewhile
from typing import Any, get_args, get_origin

from pydantic import BaseModel, ValidationError
from pydantic.fields import FieldInfo

from qlb.errors import InputError

ENTRY = "N"
"""Stands for the number of an entry in the keys of a list."""

TAGS = ("model", "shape", "kind")
"""Keys that tell apart the models that one place may hold, such as the model of a material."""

Location = tuple[int | str, ...]


class SettingError(InputError):
    """Wrong input at a key of the settings.

    Attributes:
        key: dotted, such as "bodies.0.mesh.tets"; "" for the settings as a whole.
    """

    def __init__(self, key: str, message: str) -> None:
        super().__init__(message)
        self.key = key


@contextmanager
def at_key(key: str) -> Iterator[None]:
    """Let an `InputError` from within say which key it is about, unless it does."""
    try:
        yield
    except SettingError:
        raise
    except InputError as error:
        raise SettingError(key, f"{key}: {error}") from None


def setting_error(model: type[BaseModel], error: ValidationError) -> SettingError:
    """The first problem of a ValidationError in one line, and at how many other keys there are some."""
    problems = error.errors()
    # A misspelt key is a missing one: what is unknown comes first.
    first = next((p for p in problems if p["type"] == "extra_forbidden"), problems[0])
    key, text = _described(model, first)
    # A list of wrong entries is too short as well, and what fits no member of a union has a problem with each.
    others = {_described(model, p)[0] for p in problems if p["type"] != "too_short"} - {key}
    more = f" (and {len(others)} more problem{'s' if len(others) > 1 else ''})" if others else ""
    return SettingError(key, text + more)


def _described(model: type[BaseModel], problem: Any) -> tuple[str, str]:
    """Key and message of one problem of a ValidationError."""
    kind, given = problem["type"], problem["input"]
    key, beside, members = _locate(model, problem["loc"], unknown=kind == "extra_forbidden")
    if kind == "invalid_key":
        return key, f"unknown key '{key}'"
    if kind == "extra_forbidden":
        return key, unknown_key(key, beside, key_fields(model))
    if kind == "missing":
        return key, f"{key} is missing"
    if kind == "tuple_type":
        return key, f"{key} = {_short(given)} must be a list"
    if kind == "float_type":
        return key, f"{key}: {_short(given)} is not a number"
    if kind in ("model_type", "model_attributes_type"):
        return key, f"{key} = {_short(given)} must hold keys and values"
    if kind in ("union_tag_invalid", "union_tag_not_found"):
        return _wrong_tag(key, given, problem["ctx"], members)
    if kind == "value_error":
        raised = problem["ctx"]["error"]
        if isinstance(raised, SettingError):
            whole = ".".join(part for part in (key, raised.key) if part)
            return whole, f"{key}.{raised}" if key else str(raised)
        message = str(problem["msg"]).removeprefix("Value error, ")
        return key, f"{key}: {message}" if key else message
    return key, f"{key} = {_short(given)}: {problem['msg']}"


def _wrong_tag(key: str, given: Any, context: Any, members: list[type[BaseModel]]) -> tuple[str, str]:
    """Key and message for something that tells none of `members`."""
    tag = next((tag for tag in TAGS if any(tag in member.model_fields for member in members)), TAGS[0])
    options = [str(m.model_fields[tag].default) for m in members if tag in m.model_fields]
    if not isinstance(given, dict):
        file = isinstance(given, str) and given not in options and any("path" in m.model_fields for m in members)
        example = f"{{path: {given}}}" if file else f"{{{tag}: {given if given in options else options[0]}}}"
        return key, f"{key} = {_short(given)} must hold keys and values, such as {example}"
    allowed = f"must be one of {', '.join(options)}"
    if tag not in given:
        return key, f"{key}.{tag} is missing: {allowed}"
    return f"{key}.{tag}", f"{key}.{tag}: {_short(context.get('tag', given[tag]))} is not known: {allowed}"


def _locate(
    model: type[BaseModel], location: Location, *, unknown: bool
) -> tuple[str, list[str], list[type[BaseModel]]]:
    """The dotted key of an error's location, the keys that are valid beside it, and the models that it may hold.

    Left out are the tags that pydantic puts into a location for the member of a union. With `unknown` the last part is
    a key that no model has.
    """
    parts: list[str] = []
    members, beside = [model], [model]
    for depth, part in enumerate(location, start=1):
        if isinstance(part, int):  # an entry of a list
            parts.append(str(part))
            continue
        known = any(part in m.model_fields for m in members)
        if not known and not (unknown and depth == len(location)):
            members = [m for m in members if _tag_of(m) == part] or members
            continue
        beside = members
        fields = [m.model_fields[part] for m in members if part in m.model_fields]
        members = nested_models(fields[0].annotation) if fields else []
        parts.append(part)
    prefix = "".join(f"{part}." for part in parts[:-1])
    return ".".join(parts), [prefix + name for m in beside for name in m.model_fields], members


def _tag_of(model: type[BaseModel]) -> Any:
    return next((model.model_fields[tag].default for tag in TAGS if tag in model.model_fields), model.__name__)


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def unknown_key(key: str, valid: Iterable[str], elsewhere: Iterable[str] = ()) -> str:
    """The error for a key that is not one of `valid`, with the one that is meant, or those that are beside it.

    Meant may be one of the same name in another place, `elsewhere` as well. Keys may be those of `key_fields`.
    """
    valid = list(dict.fromkeys(numbered(known, key) for known in valid))
    above, _, last = key.rpartition(".")
    level = list(dict.fromkeys(".".join(known.split(".")[: key.count(".") + 1]) for known in valid))
    beside = {known.rpartition(".")[2]: known for known in level if known.rpartition(".")[0] == above}
    near = _namesakes(key, [*valid, *(numbered(known, key) for known in elsewhere)])
    near += [beside[name] for name in difflib.get_close_matches(last, beside, n=1, cutoff=0.6)]
    if not beside:
        near += difflib.get_close_matches(key, valid, n=1, cutoff=0.6)
    hint = f"did you mean '{near[0]}'?" if near else f"valid keys: {', '.join(beside.values() or level)}"
    return f"unknown key '{_cut(key)}'; {hint}"


def _namesakes(key: str, valid: list[str]) -> list[str]:
    """Those of `valid` that have the last part of `key`, the nearest first; no entries of other lists."""
    above, dot, last = key.rpartition(".")
    same = [known for known in valid if known.endswith(f".{last}")]
    same = [known for known in same if known.startswith(above + dot) or not any(map(is_index, known.split(".")))]
    return sorted(same, key=lambda known: (-_shared(known, key), len(known)))


def _shared(a: str, b: str) -> int:
    """How many parts two keys begin with alike."""
    return len(list(takewhile(lambda pair: pair[0] == pair[1], zip(a.split("."), b.split("."), strict=False))))


def numbered(known: str, key: str) -> str:
    """A key of `key_fields` with the numbers of entries that `key` has, or 0."""
    numbers = iter([part for part in key.split(".") if is_index(part)])
    return ".".join(next(numbers, "0") if part == ENTRY else part for part in known.split("."))


def is_index(part: str) -> bool:
    """Whether this part of a key is the number of an entry in a list."""
    return part.isascii() and part.isdecimal()


def _cut(text: str) -> str:
    return text if len(text) <= 120 else text[:117] + "..."


def key_fields(model: type[BaseModel], prefix: str = "") -> dict[str, FieldInfo]:
    """Every key of a settings model, dotted, with its field: `{"mesh.size": ..., "step": ...}`.

    Where a key holds one of several models, such as a material, the keys of all are there. Where it holds a list of
    them, it is there itself, and the keys of its entries with `ENTRY` for their number.
    """
    fields: dict[str, FieldInfo] = {}
    for name, field in model.model_fields.items():
        inner = nested_models(field.annotation)
        is_list = bool(inner) and _has_list(field.annotation)
        for member in inner:
            fields |= key_fields(member, f"{prefix}{name}.{ENTRY}." if is_list else f"{prefix}{name}.")
        if is_list or not inner:
            fields[prefix + name] = field
    return fields


def _has_list(annotation: Any) -> bool:
    return get_origin(annotation) is tuple or any(map(_has_list, get_args(annotation)))


def nested_models(annotation: Any) -> list[type[BaseModel]]:
    """The settings models that a field can hold: one, the members of a union, or none."""
    if isinstance(annotation, type):
        return [annotation] if issubclass(annotation, BaseModel) else []
    return [model for argument in get_args(annotation) for model in nested_models(argument)]
