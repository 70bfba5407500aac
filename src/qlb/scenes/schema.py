"""JSON Schema of scene files, for editors: made from the settings models."""

from __future__ import annotations

import json
from collections.abc import Iterator
from typing import Any, Literal

from pydantic import BaseModel
from pydantic.json_schema import GenerateJsonSchema, models_json_schema

from qlb.materials import MATERIALS
from qlb.scenes.scene import FORMAT_VERSION
from qlb.setting_keys import TAGS
from qlb.settings import plain

DIALECT = "https://json-schema.org/draft/2020-12/schema"
_KEYWORDS = {"gt": "exclusiveMinimum", "ge": "minimum", "lt": "exclusiveMaximum", "le": "maximum"}
_DEFAULT_MATERIAL = next(iter(MATERIALS))
"""Settings of a material without `model` mean this one."""

Schema = dict[str, Any]


class _Generator(GenerateJsonSchema):
    """Writes defaults as scene files do."""

    def encode_default(self, dft: Any) -> Any:
        """A default as plain data."""
        return super().encode_default(plain(dft))


def scene_schema() -> Schema:
    """The schema of all scenes (JSON Schema 2020-12), as plain data.

    Ranges are minima and maxima, units stand in the descriptions. It takes every file that `load_scene` takes, but for
    numbers written as text; what only shows when a mesh is there is not in it.
    """
    from qlb.scenes import SCENES

    kinds = list(SCENES.values())
    modes: list[tuple[type[BaseModel], Literal["validation"]]] = [(kind, "validation") for kind in kinds]
    references, whole = models_json_schema(modes, schema_generator=_Generator)
    definitions: dict[str, Schema] = json.loads(json.dumps(whole["$defs"]))  # nothing in it is shared
    for definition in definitions.values():
        _finish(definition)
    for kind in kinds:
        scene = definitions[kind.__name__]
        if not scene.get("required"):  # one that lists its bodies need not be named
            scene["required"] = ["scene"]
    return {
        "$schema": DIALECT,
        "title": "qlb scene",
        "description": f"A scene file of qlb, version {FORMAT_VERSION}",
        "oneOf": [references[kind, "validation"] for kind in kinds],
        "$defs": definitions,
    }


def _finish(definition: Schema) -> None:
    """Turn what the models say of their fields into keywords of JSON Schema."""
    definition.pop("title", None)
    properties: dict[str, Schema] = definition.get("properties", {})
    for field in properties.values():
        field.pop("title", None)
        unit = field.pop("unit", "")
        if unit:
            field["description"] = f"{field['description']} [{unit}]"
        limits = {_KEYWORDS[name]: limit for name, limit in field.pop("bounds", {}).items()}
        for number in _numbers(field):
            number |= limits
    tags = [tag for tag in TAGS if "const" in properties.get(tag, {})]
    if tags and properties[tags[0]]["const"] != _DEFAULT_MATERIAL:
        definition["required"] = [*tags, *definition.get("required", ())]


def _numbers(schema: Schema) -> Iterator[Schema]:
    """The parts of the schema of a field that stand for a number."""
    if schema.get("type") in ("number", "integer"):
        yield schema
    for part in (*schema.get("anyOf", ()), schema.get("items"), *schema.get("patternProperties", {}).values()):
        if isinstance(part, dict):
            yield from _numbers(part)
