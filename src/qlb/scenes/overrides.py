"""KEY=VALUE pairs that change the plain data of a scene."""

from __future__ import annotations

import itertools
from typing import Any

import yaml
from pydantic import BaseModel

from qlb.errors import InputError
from qlb.setting_keys import ENTRY, is_index, key_fields, unknown_key


def override(kind: type[BaseModel], data: dict[str, Any], pair: str) -> str:
    """Set a key of a scene's plain data, as KEY=VALUE says; the key.

    Raises:
        InputError: no such key of `kind`, an entry that a list lacks, or a pair that is none.
    """
    key, separator, text = pair.partition("=")
    key = key.strip()
    if not separator or not key:
        raise InputError(f"--set {pair!r} must have the form KEY=VALUE")
    valid = key_fields(kind)
    parts = key.split(".")
    pattern = ".".join(ENTRY if is_index(part) else part for part in parts)
    if not any(f"{known}.".startswith(f"{pattern}.") for known in valid):
        raise InputError(unknown_key(key, valid))
    place: Any = data
    for depth, (part, following) in enumerate(itertools.pairwise(parts), start=1):
        index = _index(place, part, ".".join(parts[: depth - 1]))
        if isinstance(place, dict) and place.get(part) is None:
            place[part] = [] if is_index(following) else {}
        place = place[index]
        if not isinstance(place, dict | list):
            raise InputError(f"{'.'.join(parts[:depth])} = {place!r} must hold keys and values")
    place[_index(place, parts[-1], ".".join(parts[:-1]))] = _value(text)
    return key


def _index(place: dict[str, Any] | list[Any], part: str, key: str) -> Any:
    """What leads to `part` of a key within `place`, which is at `key`. Raises `InputError` for an entry it lacks."""
    if isinstance(place, dict) and not is_index(part):
        return part
    if isinstance(place, list) and is_index(part) and int(part) < len(place):
        return int(part)
    kind = f"a list of {len(place)} entries" if isinstance(place, list) else "no list"
    raise InputError(f"{key} is {kind} and has no entry {part}")


def _value(text: str) -> Any:
    """A value as YAML reads it; "1,2,3" is a list, and "where(x < 1, 2, 3)" is not."""
    parts = split_values(text)
    if len(parts) > 1:
        return [_value(part) for part in parts]
    try:
        return yaml.safe_load(text)
    except (yaml.YAMLError, ValueError, RecursionError):  # a date such as 2001-99-99 is a ValueError
        return text


def split_values(text: str) -> list[str]:
    """The parts of `text` between commas, other than commas inside brackets."""
    parts, depth = [""], 0
    for character in text:
        depth += (character in "([{") - (character in ")]}")
        if character == "," and depth == 0:
            parts.append("")
        else:
            parts[-1] += character
    return parts
