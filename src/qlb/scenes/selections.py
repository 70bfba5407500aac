"""Which nodes and surface triangles something is about: expressions of the rest position, perhaps of one body."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema

from qlb.arrays import FloatArray, IntArray
from qlb.errors import InputError
from qlb.fields import Expression
from qlb.setting_keys import SettingError
from qlb.settings import Settings, plain
from qlb.simulation import Simulation


def _selection(value: Any) -> Any:
    if not isinstance(value, str | Expression):
        raise InputError(f"{value!r} must be an expression of x, y, z, such as 'x > 0.99'")
    return Expression(value) if isinstance(value, str) else value


Selection = Annotated[
    Expression,
    BeforeValidator(_selection),
    PlainSerializer(plain, when_used="json"),
    WithJsonSchema({"type": "string"}),
]
"""Where an expression of the rest position is not zero."""


def list_of(entry: str) -> BeforeValidator:
    """Refuses what is no list, and shows how an entry is written."""

    def check(value: Any) -> Any:
        if not isinstance(value, list | tuple):
            raise InputError(f"{value!r} must be a list, such as [{entry}]")
        return value

    return BeforeValidator(check)


class OfBody(Settings):
    """Something about part of a body, or of all bodies."""

    body: str | None = Field(None, description="Name of the body; all bodies by default")

    def nodes_of(self, simulation: Simulation, key: str) -> IntArray:
        """Nodes of the body (k,). Raises `InputError` for a name that no body has; `key` is that of these settings."""
        if self.body is None:
            return np.arange(len(simulation.mesh.positions), dtype=np.int32)
        names = [body.name for body in simulation.bodies]
        if self.body not in names:
            raise unknown_body(f"{key}.body", self.body, names)
        return simulation.nodes_of(self.body)

    def select_nodes(self, simulation: Simulation, key: str, expression: Expression) -> IntArray:
        """The nodes of the body that `expression` selects, shape (k,). Raises `InputError` where there are none."""
        nodes = self.nodes_of(simulation, key)
        chosen = selected(f"{key}.nodes", "nodes", expression, simulation.mesh.positions[nodes])
        return np.asarray(nodes[chosen], dtype=np.int32)

    def select_faces(self, simulation: Simulation, key: str, expression: Expression) -> IntArray:
        """The outward surface triangles of the body that `expression` selects (k, 3). Raises `InputError` for none."""
        faces, x = simulation.mesh.boundary_triangles(), simulation.mesh.positions
        faces = faces[np.isin(faces[:, 0], self.nodes_of(simulation, key))]
        centroids = x[faces].mean(axis=1)
        return faces[selected(f"{key}.faces", "centroids of surface triangles", expression, centroids)]


def unknown_body(key: str, name: str, known: list[str]) -> SettingError:
    """The error for a name that no body has."""
    names = ", ".join(name for name in known if name) or "none has a name"
    return SettingError(key, f"{key}: no body has the name {name!r}; bodies: {names}")


def selected(key: str, what: str, expression: Expression, points: FloatArray) -> IntArray:
    """Indices of the `points` (k, 3) [m] where `expression` is not zero.

    Raises:
        InputError: nowhere, or it is not defined at one of the points.
    """
    values = expression.at(points)
    undefined = np.isnan(values)
    if undefined.any():
        where = ", ".join(f"{x:.4g}" for x in points[np.argmax(undefined)])
        raise SettingError(key, f"{key}: {expression} is not defined at ({where}) m")
    chosen = np.flatnonzero(values)
    if len(chosen) == 0:
        low, high = points.min(axis=0), points.max(axis=0)
        extents = ", ".join(f"{name} in [{a:.4g}, {b:.4g}]" for name, a, b in zip("xyz", low, high, strict=True))
        problem = f"{expression} selects none of the {len(points)} {what}, which have {extents} m"
        raise SettingError(key, f"{key}: {problem}")
    return chosen.astype(np.int32)
