"""Loads in scenes: selections by expressions of the rest position, values constant or in time."""

from __future__ import annotations

from typing import Annotated, Any

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer

from qlb.arrays import FloatArray, IntArray
from qlb.energies import Acceleration, PointForce, Pressure, Traction
from qlb.errors import InputError
from qlb.fields import Expression, TimeFunction
from qlb.fields.in_time import in_time
from qlb.mesh import TetMesh
from qlb.settings import Settings, plain, quantity
from qlb.simulation import Simulation

Vector = tuple[float, float, float]


def _selection(value: Any) -> Any:
    if not isinstance(value, str | Expression):
        raise InputError(f"{value!r} must be an expression of x, y, z, such as 'x > 0.99'")
    return Expression(value) if isinstance(value, str) else value


def _list_of(entry: str) -> BeforeValidator:
    """Refuses what is no list, and shows how an entry is written."""

    def check(value: Any) -> Any:
        if not isinstance(value, list | tuple):
            raise InputError(f"{value!r} must be a list of loads, such as [{entry}]")
        return value

    return BeforeValidator(check)


_written = PlainSerializer(plain, when_used="json")
Selection = Annotated[Expression, BeforeValidator(_selection), _written]
"""Where an expression of the rest position is not zero."""
NumberInTime = Annotated[float | TimeFunction, BeforeValidator(lambda value: in_time(value, ())), _written]
"""A number, an expression in t, or a table {times: [...], values: [...]}."""
VectorInTime = Annotated[Vector | TimeFunction, BeforeValidator(lambda value: in_time(value, (3,))), _written]
"""Three numbers, three expressions in t, or a table {times: [...], values: [[...], ...]}."""


class PressureSettings(Settings):
    """A pressure on part of the surface, which follows it."""

    faces: Selection = Field(description="Surface triangles, by an expression of their centroids x, y, z at rest [m]")
    value: NumberInTime = Field(description="Pressure [Pa]")


class TractionSettings(Settings):
    """A force per area at rest on part of the surface, which keeps its direction."""

    faces: Selection = Field(description="Surface triangles, by an expression of their centroids x, y, z at rest [m]")
    value: VectorInTime = Field(description="Force per area at rest [Pa]")


class ForceSettings(Settings):
    """A force on each of some nodes, which keeps its direction."""

    nodes: Selection = Field(description="Nodes, by an expression of x, y, z at rest [m]")
    value: VectorInTime = Field(description="Force on each [N]")


class LoadSettings(Settings):
    """Loads on the body."""

    gravity: VectorInTime = Field(
        (0.0, -9.81, 0.0),
        description="Acceleration [m/s^2]; as all values here also expressions in t, or {times: [...], values: [...]}",
    )
    ramp: float | None = quantity(
        None,
        "Time over which gravity grows linearly from nothing [s]; by default 0, and for a constant one in quasistatics"
        " the whole run",
        unit="s",
        ge=0,
    )
    pressure: Annotated[tuple[PressureSettings, ...], _list_of("{faces: 'x > 0.99', value: 100}")] = Field(
        (), description="Pressures [Pa] that follow the surface, such as [{faces: x > 0.99, value: 100 * t}]"
    )
    traction: Annotated[tuple[TractionSettings, ...], _list_of("{faces: 'x > 0.99', value: [0, 0, 100]}")] = Field(
        (), description="Forces per area at rest [Pa], such as [{faces: x > 0.99, value: [0, 0, 100 * sin(t)]}]"
    )
    forces: Annotated[tuple[ForceSettings, ...], _list_of("{nodes: 'x > 0.99', value: [0, 0, 1]}")] = Field(
        (), description="Forces on each node [N], such as [{nodes: x > 0.99, value: [0, 0, 1]}]"
    )

    def acceleration(self, ramp: float) -> Acceleration:
        """Gravity with a ramp [s], which counts where `self.ramp` is not given and gravity is constant."""
        given = self.gravity
        if self.ramp is not None:
            ramp = self.ramp
        elif isinstance(given, TimeFunction):
            ramp = 0.0
        if ramp == 0:
            return given
        in_full = given if isinstance(given, TimeFunction) else lambda time: np.asarray(given)
        return lambda time: in_full(time) * min(1.0, time / ramp)

    def add_to(self, simulation: Simulation) -> None:
        """Add all but gravity. Raises `InputError` for a selection that is empty."""
        mesh = simulation.mesh
        for k, pressure in enumerate(self.pressure):
            simulation.add(Pressure(_faces(f"loads.pressure.{k}", pressure.faces, mesh), pressure.value))
        for k, traction in enumerate(self.traction):
            simulation.add(Traction(_faces(f"loads.traction.{k}", traction.faces, mesh), traction.value))
        for k, force in enumerate(self.forces):
            nodes = selected(f"loads.forces.{k}.nodes", "nodes", force.nodes, mesh.positions)
            simulation.add(PointForce(nodes, force.value))


def _faces(key: str, expression: Expression, mesh: TetMesh) -> IntArray:
    """The outward surface triangles (k, 3) that `expression` selects."""
    faces = mesh.boundary_triangles()
    return faces[selected(f"{key}.faces", "centroids of surface triangles", expression, mesh.positions[faces].mean(1))]


def selected(key: str, what: str, expression: Expression, points: FloatArray) -> IntArray:
    """Indices of the `points` (k, 3) [m] where `expression` is not zero.

    Raises:
        InputError: nowhere, or it is not defined at one of the points.
    """
    values = expression.at(points)
    undefined = np.isnan(values)
    if undefined.any():
        where = ", ".join(f"{x:.4g}" for x in points[np.argmax(undefined)])
        raise InputError(f"{key}: {expression} is not defined at ({where}) m")
    chosen = np.flatnonzero(values)
    if len(chosen) == 0:
        low, high = points.min(axis=0), points.max(axis=0)
        extents = ", ".join(f"{name} in [{a:.4g}, {b:.4g}]" for name, a, b in zip("xyz", low, high, strict=True))
        raise InputError(f"{key}: {expression} selects none of the {len(points)} {what}, which have {extents} m")
    return chosen.astype(np.int32)
