"""Scenes from files and from KEY=VALUE pairs, and back to a commented file."""

from __future__ import annotations

import itertools
from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import yaml
from pydantic import BaseModel

from qlb.errors import InputError
from qlb.scenes.scene import Scene
from qlb.settings import ENTRY, describe_range, key_fields, plain, unknown_key


def load_scene(name: str, overrides: Iterable[str] = ()) -> Scene:
    """A built-in scene by name, or a scene file (YAML) by path, with KEY=VALUE overrides in order.

    Raises:
        InputError: no such scene or file, a file that is not valid, an unknown key, a value out of range.
    """
    from qlb.scenes import SCENES

    data: dict[str, Any] = {}
    if name not in SCENES:
        data = _read(name, SCENES)
    kind = SCENES[data.get("scene", name)]
    for override in overrides:
        _override(kind, data, override)
    return kind.parse(data)


def _read(name: str, scenes: Mapping[str, type[Scene]]) -> dict[str, Any]:
    path = Path(name)
    known = f"built-in scenes: {', '.join(scenes)}"
    if not path.is_file():
        raise InputError(f"scene {name!r} is neither a built-in scene nor a file; {known}")
    try:
        data = yaml.safe_load(path.read_text(encoding="utf-8"))
    except (yaml.YAMLError, UnicodeDecodeError, RecursionError) as error:
        raise InputError(f"scene file {name} is not valid YAML: {' '.join(str(error).split())}") from None
    except OSError as error:
        raise InputError(f"scene file {name} cannot be read: {error.strerror}") from None
    if not isinstance(data, dict):
        raise InputError(f"scene file {name} holds {type(data).__name__}, must hold keys and values")
    if data.get("scene") not in scenes:
        raise InputError(f"scene file {name}: scene = {data.get('scene')!r} is not known; {known}")
    mesh = data.get("mesh")
    if isinstance(mesh, dict) and isinstance(mesh.get("path"), str):
        mesh["path"] = str(path.parent / mesh["path"])
    return data


def _override(kind: type[Scene], data: dict[str, Any], override: str) -> None:
    key, separator, text = override.partition("=")
    key = key.strip()
    if not separator or not key:
        raise InputError(f"--set {override!r} must have the form KEY=VALUE")
    valid = key_fields(kind)
    parts = key.split(".")
    if ".".join(ENTRY if _is_index(part) else part for part in parts) not in valid:
        raise InputError(unknown_key(key, valid))
    place: Any = data
    for depth, (part, following) in enumerate(itertools.pairwise(parts), start=1):
        index = _index(place, part, ".".join(parts[: depth - 1]))
        if isinstance(place, dict) and place.get(part) is None:
            place[part] = [] if _is_index(following) else {}
        place = place[index]
        if not isinstance(place, dict | list):
            raise InputError(f"{'.'.join(parts[:depth])} = {place!r} must hold keys and values")
    place[_index(place, parts[-1], ".".join(parts[:-1]))] = _value(text)


def _is_index(part: str) -> bool:
    """Whether this part of a key is the number of an entry in a list."""
    return part.isascii() and part.isdecimal()


def _index(place: dict[str, Any] | list[Any], part: str, key: str) -> Any:
    """What leads to `part` of a key within `place`, which is at `key`. Raises `InputError` for an entry it lacks."""
    if isinstance(place, dict) and not _is_index(part):
        return part
    if isinstance(place, list) and _is_index(part) and int(part) < len(place):
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


def scene_yaml(scene: Scene) -> str:
    """The scene as a file with every key, and what each means. `load_scene` reads it back to the same scene."""
    lines = [f"# {type(scene).__doc__}", f"scene: {scene.model_dump()['scene']}"]
    lines += _lines(scene, indent="")
    return "\n".join(lines) + "\n"


def _lines(model: BaseModel, indent: str) -> list[str]:
    lines: list[str] = []
    for name, field in type(model).model_fields.items():
        value = getattr(model, name)
        if name == "scene":
            continue
        if isinstance(value, BaseModel):
            lines += ["", f"{indent}{name}:"] if not indent else [f"{indent}{name}:"]
            lines += _lines(value, indent + "  ")
            continue
        text = f"{indent}{name}: {_plain(value)}"
        extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
        notes = [field.description or ""]
        if "enum" in extra:
            notes.append(f"one of {', '.join(map(str, extra['enum']))}")  # type: ignore[arg-type]
        if "bounds" in extra:
            notes.append(describe_range(extra["bounds"], str(extra["unit"])))  # type: ignore[arg-type]
        comment = "; ".join(note for note in notes if note)
        lines.append(f"{text:<36} # {comment}" if comment else text)
    return lines


def _plain(value: Any) -> str:
    """One line of YAML for a leaf value."""
    if value is None:
        return "null"
    value = plain(value)
    if isinstance(value, tuple):
        value = [part.model_dump(mode="json") if isinstance(part, BaseModel) else part for part in value]
    if isinstance(value, Path):
        value = str(value)
    return yaml.safe_dump(value, default_flow_style=True, width=2**31).strip().removesuffix("...").strip()
