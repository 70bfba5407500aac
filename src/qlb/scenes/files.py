"""Scenes from files and from KEY=VALUE pairs."""

from __future__ import annotations

import difflib
from collections.abc import Iterable
from pathlib import Path
from typing import Any, get_args

from qlb.errors import InputError
from qlb.scenes.document import Document, read_document
from qlb.scenes.overrides import override
from qlb.scenes.scene import FORMAT_VERSION, Scene
from qlb.scenes.source import Source
from qlb.scenes.toml_document import parse_toml
from qlb.scenes.yaml_document import parse_yaml
from qlb.setting_keys import ENTRY, SettingError, key_fields, unknown_key

PARSERS = {".yaml": parse_yaml, ".toml": parse_toml}
"""By the ending of a file; the first reads all others."""


def load_scene(name: str, overrides: Iterable[str] = ()) -> Scene:
    """A built-in scene by name, or a scene file by path (YAML, or TOML by its ending), with KEY=VALUE pairs in order.

    Paths in a file are relative to the file, those of overrides to the working directory.

    Raises:
        InputError: no such scene or file, a file that is not valid, an unknown key, a value out of range; with file,
            line and column where the file is to blame.
    """
    from qlb.scenes import SCENES

    if name in SCENES:
        kind, data, document = SCENES[name], SCENES[name].start(), None
    else:
        document = _read(name)
        kind = _kind(document)
        data = document.root.plain()
        _resolve_paths(kind, data, document.path.parent.absolute())
    pairs = list(overrides)
    keys = [override(kind, data, pair) for pair in pairs]
    source = Source(document, tuple(keys))
    try:
        scene = kind.parse(data)
    except InputError as error:
        raise source.located(error) from None
    scene.come_from(source)
    return scene


def _read(name: str) -> Document:
    path = Path(name)
    try:
        found = path.is_file()
    except OSError:  # a name that is too long
        found = False
    if not found:
        raise InputError(f"scene {_shown(name)} is neither a built-in scene nor a file; {_meant(path)}")
    return read_document(path, PARSERS)


def _meant(path: Path) -> str:
    """What may have been meant by the name of a scene that is not there."""
    from qlb.scenes import SCENES

    try:
        files = [str(path.parent / p.name) for p in path.parent.iterdir() if p.suffix in PARSERS] if path.suffix else []
    except OSError:
        files = []
    near = difflib.get_close_matches(str(path), [*SCENES, *files], n=1, cutoff=0.7)
    return f"did you mean {near[0]!r}?" if near else f"built-in scenes: {', '.join(SCENES)}"


def _kind(document: Document) -> type[Scene]:
    """The scene that a file is about, of a version that is known. Raises `InputError`."""
    from qlb.scenes import SCENES

    data = document.root.plain()
    version, name = data.get("version", FORMAT_VERSION), data.get("scene")
    source = Source(document)
    if isinstance(version, bool) or version != FORMAT_VERSION:
        problem = f"version = {_shown(version)} is not known: this qlb reads version {FORMAT_VERSION}"
        raise source.located(SettingError("version", problem))
    if name is None and "scene" not in data:
        if "bodies" in data:
            return SCENES["bodies"]
        unknown = next((str(key) for key in data if str(key) not in _all_keys()), "")
        hint = f"; {unknown_key(unknown, ['scene', 'bodies'])}" if unknown else ""
        problem = f"scene is missing: it names a scene, and bodies lists your own{hint}"
        raise source.located(SettingError(unknown, problem))
    if not isinstance(name, str) or name not in SCENES:
        known = f"built-in scenes: {', '.join(SCENES)}"
        raise source.located(SettingError("scene", f"scene = {_shown(name)} is not known; {known}"))
    return SCENES[name]


def _all_keys() -> set[str]:
    from qlb.scenes import SCENES

    return {key for kind in SCENES.values() for key in kind.model_fields}


def _resolve_paths(kind: type[Scene], data: Any, folder: Path) -> None:
    """Make every path in `data` absolute that is relative to `folder`, whatever key of the scene has it."""
    for key, field in key_fields(kind).items():
        if _is_path(field.annotation):
            *above, last = key.split(".")
            for place in _places(data, above):
                if isinstance(place, dict) and isinstance(place.get(last), str):
                    place[last] = str(folder / place[last])


def _is_path(annotation: Any) -> bool:
    return annotation is Path or any(map(_is_path, get_args(annotation)))


def _places(data: Any, parts: list[str]) -> list[Any]:
    """What lies at a key of `key_fields` in plain data, once for each entry of a list on the way."""
    places = [data]
    for part in parts:
        if part == ENTRY:
            places = [entry for place in places if isinstance(place, list) for entry in place]
        else:
            places = [place[part] for place in places if isinstance(place, dict) and part in place]
    return places


def _shown(value: object) -> str:
    text = repr(value)
    return text if len(text) <= 60 else text[:57] + "..."
