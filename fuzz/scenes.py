"""Fuzz target: text of scene files, as YAML and as TOML. It is read, or there is one `InputError` of one line.

The first byte of an input chooses the ending, the rest is the file.
"""

from __future__ import annotations

import json
from pathlib import Path

import atheris

with atheris.instrument_imports(include=["qlb.scenes", "qlb.setting_keys", "qlb.fields", "yaml", "tomllib"]):
    from qlb import InputError
    from qlb.scenes import SCENES, load_scene, scene_yaml
    from qlb.scenes.files import PARSERS

from qlb.setting_keys import key_fields
from runner import ROOT, fuzz

ENDINGS = tuple(PARSERS)
TOML = """
scene = "bar"
step = 1e-2
mesh.size = [1, "25 cm", 0.25]
[material]
model = "SNH"
young = "2e4 * (1 + x)"
[[bodies]]
name = "a"
placement = {scale = 1, rotate = {axis = [0, 1, 0], degrees = 10}}
"""


def target(data: bytes, path: Path) -> None:
    """Load what `data` holds."""
    if not data:
        return
    path = path.with_suffix(ENDINGS[data[0] % len(ENDINGS)])
    path.write_bytes(data[1:])
    try:
        scene = load_scene(str(path))
    except InputError as error:
        message = str(error)
        if "\n" in message or len(message) > 3000:
            raise AssertionError(f"no message of one line: {message!r}") from error
        return
    path.with_suffix(".yaml").write_text(scene_yaml(scene))
    load_scene(str(path.with_suffix(".yaml")))  # what was read is a scene when it is written


def _seeds() -> dict[str, bytes]:
    own = {f"{name}.yaml": scene_yaml(kind.parse(kind.start())).encode() for name, kind in SCENES.items()}
    examples = {path.name: path.read_bytes() for path in ROOT.glob("examples/**/*") if path.suffix in ENDINGS}
    files = own | examples | {"bar.toml": TOML.encode()}
    return {name: bytes([ENDINGS.index(Path(name).suffix)]) + content for name, content in files.items()}


def _words() -> set[str]:
    keys = {part for kind in SCENES.values() for key in key_fields(kind) for part in key.split(".")}
    values = {json.dumps(value).strip('"') for kind in SCENES.values() for value in kind.start().values()}
    return keys | values | {"kPa", "1e400", "nan", ".inf", "&a", "*a", "<<:", "!!", "'''", "[[", "]]", "sin(x)", "**"}


if __name__ == "__main__":
    fuzz("scenes", _seeds(), _words(), target)
