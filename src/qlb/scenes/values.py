"""Numbers and vectors as scene files write them."""

from __future__ import annotations

from typing import Annotated, Any

from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema

from qlb.fields import TimeFunction
from qlb.fields.in_time import in_time
from qlb.settings import plain

Number = Annotated[float, Field(allow_inf_nan=False)]
Vector = tuple[Number, Number, Number]

_written = PlainSerializer(plain, when_used="json")
_NUMBERS: dict[str, Any] = {"type": "array", "items": {"type": "number"}, "minItems": 1}


def _in_time_schema(constant: dict[str, Any], values: dict[str, Any]) -> WithJsonSchema:
    table = {
        "type": "object",
        "properties": {"times": _NUMBERS, "values": values},
        "required": ["times", "values"],
        "additionalProperties": False,
    }
    return WithJsonSchema({"anyOf": [constant, table]})


NumberInTime = Annotated[
    float | TimeFunction,
    BeforeValidator(lambda value: in_time(value, ())),
    _written,
    _in_time_schema({"type": ["number", "string"]}, _NUMBERS),
]
"""A number, an expression in t, or a table {times: [...], values: [...]}."""

VectorInTime = Annotated[
    Vector | TimeFunction,
    BeforeValidator(lambda value: in_time(value, (3,))),
    _written,
    _in_time_schema(
        {"type": "array", "items": {"type": ["number", "string"]}, "minItems": 3, "maxItems": 3},
        {"type": "array", "items": _NUMBERS | {"minItems": 3, "maxItems": 3}, "minItems": 1},
    ),
]
"""Three numbers, three expressions in t, or a table {times: [...], values: [[...], ...]}."""
