"""Markdown made from the code: settings, materials, commands. `conf.py` puts it where a page asks for it."""

from __future__ import annotations

import inspect
import json
import re
import typing
from collections.abc import Iterable, Iterator, Mapping
from typing import Any

import click
import numpy as np
import typer
from pydantic import BaseModel, create_model
from pydantic.fields import FieldInfo
from pydantic_core import PydanticUndefined

import qlb
from qlb.cli.main import app
from qlb.contact import Contact
from qlb.fields import TimeFunction, Varying
from qlb.integrators import INTEGRATORS
from qlb.materials import MATERIALS, Material
from qlb.scenes import SCENES, Scene
from qlb.setting_keys import ENTRY, TAGS, key_fields, nested_models
from qlb.settings import describe_range
from qlb.solvers import SOLVERS

INVERTED = {"everywhere": "yes", "unique R": "yes", "det F > 0": "no"}


def table(head: Iterable[str], rows: Iterable[tuple[str, ...]]) -> str:
    """A Markdown table; bars within cells are escaped, and what is there twice is written once."""
    head = list(head)
    lines = [head, ["---"] * len(head), *([cell.replace("|", r"\|") for cell in row] for row in dict.fromkeys(rows))]
    return "\n".join(f"| {' | '.join(line)} |" for line in lines) + "\n"


def settings_markdown(model: type[BaseModel], prefix: str = "") -> str:
    """The keys of one settings model, and of those within it, each with default, unit, range and meaning."""
    return table(("key", "default", "unit", "range", "meaning"), _rows(model, prefix))


def scene_markdown(name: str) -> str:
    """What a scene is, its own keys, and where its defaults differ from those of every scene."""
    kind = SCENES[name]
    own = {key: field for key, field in kind.model_fields.items() if _is_own(key, field)}
    return f"{inspect.getdoc(kind)}\n\n" + table(
        ("key", "default", "unit", "range", "meaning"), _rows_of(own, "", dict.fromkeys(own))
    )


def common_markdown() -> str:
    """The keys that every scene has."""
    return settings_markdown(Scene)


def contact_markdown() -> str:
    """The keys of contact."""
    return settings_markdown(Contact, "contact.")


def scenes_markdown() -> str:
    """A section for each built-in scene."""
    return "\n".join(f"### Scene `{name}`\n\n{scene_markdown(name)}" for name in SCENES)


def materials_markdown() -> str:
    """The table of materials: name in scene files, class, what it is for, whether elements may be inverted."""
    rows = (
        (f"`{name}`", f"`{kind.__name__}`", f"{_summary(kind)}. {_formula(kind)}", INVERTED[kind.domain])
        for name, kind in MATERIALS.items()
    )
    return table(("`material.model`", "class", "what it is, its energy density psi(F) [Pa]", "inverted elements"), rows)


def material_keys_markdown() -> str:
    """The parameters of each material."""
    return "\n".join(
        f"### `{name}`: {kind.__name__}\n\n{settings_markdown(kind, 'material.')}" for name, kind in MATERIALS.items()
    )


def alternatives_markdown() -> str:
    """What a mesh, an obstacle or a motion may be, wherever a key holds one."""
    found = dict(pair for kind in (Scene, *SCENES.values()) for pair in _alternatives(kind))
    parts = []
    for name, models in found.items():
        parts.append(f"### One of several: `{name}`\n")
        parts += [f"`{_tag(model)}`: {_summary(model)}.\n\n{settings_markdown(model, f'{name}.')}" for model in models]
    return "\n".join(parts)


def integrators_markdown() -> str:
    """The table of integrators."""
    return table(("`integrator`", "what"), ((f"`{name}`", _summary(kind)) for name, kind in INTEGRATORS.items()))


def solvers_markdown() -> str:
    """The table of solvers."""
    return table(("`solver`", "what"), ((f"`{name}`", _summary(kind)) for name, kind in SOLVERS.items()))


def program_markdown() -> str:
    """What `qlb` is, and its exit status."""
    return f"{typer.main.get_command(app).help}\n"


def commands_markdown() -> str:
    """Every command of `qlb`, its arguments and options."""
    root = typer.main.get_command(app)
    context = click.Context(root, info_name="qlb")
    parts = []
    for name, command in root.commands.items():  # type: ignore[attr-defined]
        inner = click.Context(command, info_name=name, parent=context)
        usage = re.sub(r"\{(\w+)\}", lambda found: found[1].upper(), " ".join(command.collect_usage_pieces(inner)))
        parts.append(f"## qlb {name}\n\n{command.help}\n\n```text\nqlb {name} {usage}\n```\n\n{_parameters(command)}")
    return "\n".join(parts)


def api_markdown(names: Iterable[str]) -> str:
    """Public names with their docstrings; settings with the table of their keys."""
    return "\n".join(_api_entry(name) for name in names)


def _api_entry(name: str) -> str:
    thing = getattr(qlb, name)
    directive = "autoclass" if isinstance(thing, type) else "autofunction"
    is_settings = isinstance(thing, type) and issubclass(thing, BaseModel)
    members = "   :members:\n   :exclude-members: model_config, model_post_init\n" if isinstance(thing, type) else ""
    block = f"```{{eval-rst}}\n.. {directive}:: qlb.{name}\n{members}```\n"
    if is_settings and thing.model_fields:
        block += f"\n{settings_markdown(thing)}"
    return f"### {name}\n\n{block}"


def _parameters(command: click.Command) -> str:
    rows = []
    for parameter in command.params:
        option = parameter.param_type_name == "option"
        names = [*parameter.opts, *parameter.secondary_opts] if option else [(parameter.name or "").upper()]
        default = (
            "" if parameter.default in (None, False, True, (), []) or callable(parameter.default) else parameter.default
        )
        text = getattr(parameter, "help", None) or ""
        rows.append((", ".join(f"`{name}`" for name in names), f"`{default}`" if default != "" else "", text))
    return table(("argument", "default", "what"), rows) if rows else ""


def _rows(model: type[BaseModel], prefix: str) -> Iterator[tuple[str, ...]]:
    return _rows_of(model.model_fields, prefix, model.model_fields)


def _rows_of(fields: Mapping[str, FieldInfo], prefix: str, order: Iterable[str]) -> Iterator[tuple[str, ...]]:
    """Rows for `fields`; a group of keys has a row for each of them, behind those of one key."""
    nested = {name: nested_models(fields[name].annotation) for name in order}
    for name in order:
        if not nested[name]:
            yield _row(prefix + name, fields[name])
    for name, models in nested.items():
        field = fields[name]
        if not models:
            continue
        if all(issubclass(model, Material) for model in models):
            yield (f"`{prefix}{name}`", _material(field.default), "", "", "See [the materials](settings-materials)")
            continue
        is_list = _is_list(name, field)
        if is_list:
            yield _row(prefix + name, field)
        inner = f"{prefix}{name}.{ENTRY}" if is_list else f"{prefix}{name}"
        if len(models) > 1:
            kinds = ", ".join(f"`{_tag(model)}`" for model in models)
            yield (f"`{inner}`", "", "", kinds, "One of several, each with [its own keys](settings-alternatives)")
        else:
            yield from _group(inner, models[0], None if is_list else field.default)


def _material(given: Any) -> str:
    """The default of a material: its model, and what of it is no default of that model."""
    if not isinstance(given, Material):
        return "`null`"
    other = [f"{key}: {getattr(given, key):g}" for key in given.model_fields_set if _differs(given, key)]
    return f"`{{{', '.join([f'model: {given.model}', *other])}}}`" if other else f"`{given.model}`"


def _is_list(name: str, field: FieldInfo) -> bool:
    """Whether a field with models in it holds a list of them: only then the key itself counts as one."""
    alone = create_model("Alone", **{name: (field.annotation, field)})  # type: ignore[call-overload]
    return name in key_fields(alone)


def _tag(model: type[BaseModel]) -> str:
    """By what a member of several models is told apart: its tag, or a key that it must have, or what it is."""
    fields = model.model_fields
    tag = next((str(fields[tag].default) for tag in TAGS if tag in fields), None)
    required = (name for name, field in fields.items() if field.is_required())
    return tag or next(required, _summary(model).lower())


def _alternatives(model: type[BaseModel]) -> Iterator[tuple[str, tuple[type[BaseModel], ...]]]:
    """Each key below `model` that holds one of several models, materials apart, with these."""
    for name, field in model.model_fields.items():
        models = nested_models(field.annotation)
        if len(models) > 1 and not issubclass(models[0], Material):
            yield f"{name}.{ENTRY}" if _is_list(name, field) else name, tuple(models)
        for inner in models:
            yield from _alternatives(inner)


def _group(key: str, model: type[BaseModel], given: Any) -> Iterator[tuple[str, ...]]:
    """The keys of a group; of one that many scenes share, only those with a default of its own."""
    shared = model is Contact or (key in Scene.model_fields and Scene.model_fields[key].default != given)
    for name, field in model.model_fields.items():
        default = getattr(given, name) if isinstance(given, model) else field.default
        if not shared or default != field.default:
            yield from _rows_of({name: _with_default(field, default)}, f"{key}.", [name])
    if model is Contact:
        yield (f"`{key}`", "", "", "", "The other keys of [contact](settings-contact)")


def _differs(given: BaseModel, key: str) -> bool:
    return bool(getattr(given, key) != type(given).model_fields[key].default)


def _with_default(field: FieldInfo, default: Any) -> FieldInfo:
    copy = FieldInfo.merge_field_infos(field)
    copy.default = default
    return copy


def _row(key: str, field: FieldInfo) -> tuple[str, ...]:
    extra = field.json_schema_extra if isinstance(field.json_schema_extra, dict) else {}
    meaning = field.description or ""
    return (f"`{key}`", _default(field), str(extra.get("unit", "")), _range(field, extra), meaning)


def _default(field: FieldInfo) -> str:
    if field.default is PydanticUndefined:
        return "must be given"
    value = field.default
    if isinstance(value, Varying | TimeFunction):
        value = value.written()
    if isinstance(value, np.ndarray):
        value = value.tolist()
    if isinstance(value, float):
        return f"`{value:g}`"
    return f"`{json.dumps(value, default=str)}`".replace('"', "")


def _range(field: FieldInfo, extra: Mapping[str, Any]) -> str:
    if "enum" in extra:
        return ", ".join(f"`{option}`" for option in extra["enum"])
    if "bounds" in extra:
        return describe_range(extra["bounds"])
    options = [option for option in _literals(field.annotation) if isinstance(option, str)]
    if options:
        return ", ".join(f"`{option}`" for option in options)
    return "`true`, `false`" if field.annotation is bool else ""


def _literals(annotation: Any) -> Iterator[Any]:
    if typing.get_origin(annotation) is typing.Literal:
        yield from typing.get_args(annotation)
    for argument in typing.get_args(annotation):
        yield from _literals(argument)


def _is_own(key: str, field: FieldInfo) -> bool:
    common = Scene.model_fields.get(key)
    return key != "scene" and (common is None or common.default != field.default)


def _summary(kind: type) -> str:
    return (inspect.getdoc(kind) or "").partition("\n\n")[0].replace("\n", " ").removesuffix(".")


def _formula(kind: type) -> str:
    """The paragraphs of a docstring that follow the summary, in one line."""
    return " ".join((inspect.getdoc(kind) or "").partition("\n\n")[2].split()).removesuffix(".")
