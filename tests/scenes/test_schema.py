"""The JSON Schema of scene files takes every scene and example, refuses what the settings refuse, has every key."""

from __future__ import annotations

import json
import random
import re
import sys
from collections.abc import Iterator
from functools import cache
from pathlib import Path
from typing import Any

import pytest
import yaml
from jsonschema import Draft202012Validator

from qlb import InputError
from qlb.cli.main import main
from qlb.scenes import SCENES, load_scene, scene_schema, scene_yaml
from qlb.scenes.document import read_document
from qlb.scenes.files import PARSERS
from qlb.setting_keys import key_fields

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples" / "scenes").iterdir())


@cache
def validator() -> Draft202012Validator:
    return Draft202012Validator(scene_schema())


def plain(path: Path) -> Any:
    """As an editor sees it: JSON."""
    return json.loads(json.dumps(read_document(path, PARSERS).root.plain()))


def test_it_is_a_json_schema():
    schema = scene_schema()
    Draft202012Validator.check_schema(schema)
    assert schema["$schema"] == "https://json-schema.org/draft/2020-12/schema"


def test_the_command_prints_it(monkeypatch, capsys):
    monkeypatch.setattr(sys, "argv", ["qlb", "schema"])
    with pytest.raises(SystemExit) as end:
        main()
    assert not end.value.code
    assert json.loads(capsys.readouterr().out) == scene_schema()


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_fits(name, tmp_path):
    (tmp_path / "scene.yaml").write_text(scene_yaml(load_scene(name)))
    validator().validate(plain(tmp_path / "scene.yaml"))
    validator().validate(load_scene(name).model_dump(mode="json"))
    if name != "bodies":
        validator().validate({"scene": name})


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_every_example_fits(path):
    validator().validate(plain(path))


def test_the_parts_of_scene_files_in_the_docs_fit():
    pages = [ROOT / "README.md", *sorted((ROOT / "docs").glob("*.md"))]
    found = [text for page in pages for text in re.findall(r"^```yaml\n(.*?)^```", page.read_text(), re.M | re.S)]
    assert found
    for text in found:
        data = json.loads(json.dumps(yaml.safe_load(text)))
        validator().validate(data if "bodies" in data else {"scene": "bar"} | data)


BODY: dict[str, Any] = {"mesh": {"shape": "ball"}}


@pytest.mark.parametrize(
    "data",
    [
        {},
        {"scene": "nothing"},
        {"scene": "bodies"},
        {"bodies": []},
        {"bodies": [{"mesh": {"shape": "sphere"}}]},
        {"bodies": [{"mesh": {"shape": "ball", "tube": 0.1}}]},
        {"bodies": [{"mesh": {"shape": "ball", "tets": 50}}]},
        {"bodies": [{"mesh": {"shape": "ball", "radius": 0}}]},
        {"bodies": [{"mesh": {"radius": 0.1}}]},
        {"bodies": [{"mesh": {"path": 3}}]},
        {"bodies": [BODY], "version": 2},
        {"bodies": [BODY], "step": 0},
        {"bodies": [BODY], "steps": 1.5},
        {"bodies": [BODY], "steps": 1e18},
        {"bodies": [BODY], "solver": "BFGS"},
        {"bodies": [BODY], "contact": True},
        {"bodies": [BODY], "contact": {"friction": -1}},
        {"bodies": [BODY], "contact": {"pairs": [{"between": ["a"]}]}},
        {"bodies": [BODY], "material": {"model": "jelly"}},
        {"bodies": [BODY], "material": {"young": [1e4, -1]}},
        {"bodies": [BODY], "material": {"young": {"1": 0}}},
        {"bodies": [BODY], "material": {"young": {"one": 1}}},
        {"bodies": [BODY], "material": {"poisson": 0.5}},
        {"bodies": [BODY], "material": {"second_share": 0.1}},
        {"bodies": [BODY], "loads": {"gravity": [0, 1]}},
        {"bodies": [BODY], "loads": {"gravity": {"times": [0]}}},
        {"bodies": [BODY], "pins": [{"body": "a"}]},
        {"bodies": [BODY], "handles": [{"nodes": "x > 0"}]},
        {"bodies": [BODY], "handles": [{"nodes": "x > 0", "motion": {"velocity": [0, 0, 0]}}]},
        {"bodies": [BODY], "obstacles": [{"mesh": {"shape": "box"}, "normal": [0, 1, 0]}]},
        {"scene": "bar", "bodies": [BODY]},
    ],
    ids=str,
)
def test_what_the_settings_refuse_does_not_fit(data, tmp_path):
    assert not validator().is_valid(data)
    (tmp_path / "scene.json").write_text(json.dumps(data))
    with pytest.raises(InputError):
        load_scene(str(tmp_path / "scene.json"))


def test_ranges_and_units_are_there():
    definitions = scene_schema()["$defs"]
    young = definitions["StableNeoHookean"]["properties"]["young"]
    assert young["description"] == "Young's modulus [Pa]"
    assert young["anyOf"][0] == {"type": "number", "exclusiveMinimum": 0}
    assert young["anyOf"][2]["items"] == {"type": "number", "exclusiveMinimum": 0}
    poisson = definitions["StableNeoHookean"]["properties"]["poisson"]["anyOf"][0]
    assert poisson == {"type": "number", "exclusiveMinimum": -1, "exclusiveMaximum": 0.5}
    assert definitions["BodiesScene"]["properties"]["solver"]["enum"] == ["ND", "QLF", "QLB", "QLA"]
    assert "bounds" not in json.dumps(definitions)


def described(definitions: dict[str, Any], schema: dict[str, Any], prefix: str = "") -> Iterator[str]:
    """Every dotted key of a schema, with N for the entries of a list."""
    if "$ref" in schema:
        schema = definitions[schema["$ref"].removeprefix("#/$defs/")]
    for part in (*schema.get("anyOf", ()), *schema.get("oneOf", ())):
        yield from described(definitions, part, prefix)
    if isinstance(schema.get("items"), dict):
        yield from described(definitions, schema["items"], f"{prefix}N.")
    for name, inner in schema.get("properties", {}).items():
        yield f"{prefix}{name}"
        yield from described(definitions, inner, f"{prefix}{name}.")


@pytest.mark.parametrize("name", SCENES)
def test_it_has_the_keys_of_the_settings(name):
    schema = scene_schema()
    found = set(described(schema["$defs"], schema["$defs"][SCENES[name].__name__]))
    assert set(key_fields(SCENES[name])) <= found


def leaves(data: Any, path: tuple[Any, ...] = ()) -> Iterator[tuple[Any, ...]]:
    inner = data.items() if isinstance(data, dict) else enumerate(data) if isinstance(data, list) else ()
    for key, part in inner:
        yield (*path, key)
        yield from leaves(part, (*path, key))


@pytest.mark.parametrize("path", EXAMPLES, ids=lambda path: path.name)
def test_an_example_with_a_key_misspelt_or_of_another_kind_does_not_fit(path):
    data = plain(path)
    rng = random.Random(3)
    places = [place for place in leaves(data) if isinstance(place[-1], str)]
    for place in rng.sample(places, 12):
        *above, last = place
        for spoil in ("misspell", "retype"):
            changed = json.loads(json.dumps(data))
            owner = changed
            for step in above:
                owner = owner[step]
            if spoil == "misspell":
                owner[last + "x"] = owner.pop(last)
            else:
                owner[last] = {"unknown": [True]}
            assert not validator().is_valid(changed), (place, spoil)
