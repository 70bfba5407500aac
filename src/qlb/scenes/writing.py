"""Scenes as commented files."""

from __future__ import annotations

from typing import Any

import yaml
from pydantic import BaseModel
from pydantic.fields import FieldInfo

from qlb.scenes.scene import Scene
from qlb.settings import describe_range, plain

COMMENT_FROM = 36
"""Column of the comments, behind what is shorter."""


def scene_yaml(scene: Scene) -> str:
    """The scene as a file with every key, and what each means. `load_scene` reads it back to the same scene."""
    fields = type(scene).model_fields
    common = [name for name in Scene.model_fields if name != "version"]
    own = [name for name in fields if name not in (*common, "scene", "version")]
    lines = [f"# {type(scene).__doc__}", *_key(scene, "version", ""), f"scene: {scene.model_dump()['scene']}"]
    for name in (*own, *common):
        is_group = isinstance(getattr(scene, name), BaseModel | tuple) and not _is_leaf(getattr(scene, name))
        lines += [""] if is_group else []
        lines += _key(scene, name, "")
    return "\n".join(lines) + "\n"


def _is_leaf(value: Any) -> bool:
    """Whether a value is written on the line of its key."""
    if isinstance(value, tuple):
        return not any(isinstance(part, BaseModel) for part in value)
    return not isinstance(value, BaseModel)


def _key(model: BaseModel, name: str, indent: str) -> list[str]:
    """The lines of one key."""
    value, field = getattr(model, name), type(model).model_fields[name]
    if _is_leaf(value):
        return [_commented(f"{indent}{name}: {_plain(value)}", _comment(field))]
    if isinstance(value, BaseModel):
        return [f"{indent}{name}:", *_lines(value, indent + "  ")]
    lines = [_commented(f"{indent}{name}:", _comment(field))]
    for entry in value:
        first, *others = _lines(entry, indent + "    ")
        lines += [f"{indent}  - {first.lstrip()}", *others]
    return lines


def _lines(model: BaseModel, indent: str) -> list[str]:
    return [line for name in type(model).model_fields for line in _key(model, name, indent)]


def _commented(text: str, comment: str) -> str:
    return f"{text:<{COMMENT_FROM}} # {comment}" if comment else text


def _comment(field: FieldInfo) -> str:
    """What a field means, and its unit and range."""
    extra: Any = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    notes = [field.description or ""]
    if "enum" in extra:
        notes.append(f"one of {', '.join(map(str, extra['enum']))}")
    if "bounds" in extra:
        notes.append(describe_range(extra["bounds"], str(extra["unit"])))
    return "; ".join(note for note in notes if note)


def _plain(value: Any) -> str:
    """One line of YAML for a leaf value."""
    if value is None:
        return "null"
    return yaml.safe_dump(_data(value), default_flow_style=True, width=2**31).strip().removesuffix("...").strip()


def _data(value: Any) -> Any:
    value = plain(value)
    return [_data(part) for part in value] if isinstance(value, tuple) else value
