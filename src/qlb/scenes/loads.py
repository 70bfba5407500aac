"""Loads in scenes: selections by expressions of the rest position, values constant or in time."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Field

from qlb.energies import Acceleration, PointForce, Pressure, Traction
from qlb.fields import TimeFunction
from qlb.scenes.selections import OfBody, Selection, list_of
from qlb.scenes.values import NumberInTime, VectorInTime
from qlb.settings import Settings, quantity
from qlb.simulation import Simulation


class PressureSettings(OfBody):
    """A pressure on part of the surface, which follows it."""

    faces: Selection = Field(description="Surface triangles, by an expression of their centroids x, y, z at rest [m]")
    value: NumberInTime = Field(description="Pressure [Pa]")


class TractionSettings(OfBody):
    """A force per area at rest on part of the surface, which keeps its direction."""

    faces: Selection = Field(description="Surface triangles, by an expression of their centroids x, y, z at rest [m]")
    value: VectorInTime = Field(description="Force per area at rest [Pa]")


class ForceSettings(OfBody):
    """A force on each of some nodes, which keeps its direction."""

    nodes: Selection = Field(description="Nodes, by an expression of x, y, z at rest [m]")
    value: VectorInTime = Field(description="Force on each [N]")


class LoadSettings(Settings):
    """Loads on the bodies."""

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
    pressure: Annotated[tuple[PressureSettings, ...], list_of("{faces: 'x > 0.99', value: 100}")] = Field(
        (), description="Pressures [Pa] that follow the surface, such as [{faces: x > 0.99, value: 100 * t}]"
    )
    traction: Annotated[tuple[TractionSettings, ...], list_of("{faces: 'x > 0.99', value: [0, 0, 100]}")] = Field(
        (), description="Forces per area at rest [Pa], such as [{faces: x > 0.99, value: [0, 0, 100 * sin(t)]}]"
    )
    forces: Annotated[tuple[ForceSettings, ...], list_of("{nodes: 'x > 0.99', value: [0, 0, 1]}")] = Field(
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
        for k, pressure in enumerate(self.pressure):
            faces = pressure.select_faces(simulation, f"loads.pressure.{k}", pressure.faces)
            simulation.add(Pressure(faces, pressure.value))
        for k, traction in enumerate(self.traction):
            faces = traction.select_faces(simulation, f"loads.traction.{k}", traction.faces)
            simulation.add(Traction(faces, traction.value))
        for k, force in enumerate(self.forces):
            nodes = force.select_nodes(simulation, f"loads.forces.{k}", force.nodes)
            simulation.add(PointForce(nodes, force.value))
