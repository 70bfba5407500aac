"""The bar of the paper: a box of tetrahedra, held at one end or at both."""

from __future__ import annotations

from pathlib import Path
from typing import Any, Literal

import numpy as np
from pydantic import Field

from qlb.materials import Fibres
from qlb.mesh import TetMesh
from qlb.scenes.loads import Vector
from qlb.scenes.scene import Scene
from qlb.settings import Settings, quantity
from qlb.simulation import Simulation
from qlb.system import Rotation


class BoxMeshSettings(Settings):
    """A box of tetrahedra, or a mesh file."""

    size: Vector = Field((1.0, 0.25, 0.25), description="Lengths of the box [m]")
    cells: tuple[int, int, int] = Field((20, 5, 5), description="Cells along each axis, six tetrahedra in each")
    path: Path | None = Field(None, description="A tetrahedral mesh file to use instead of the box")


class TwistSettings(Settings):
    """How the twist variant turns its far end."""

    rate: float = quantity(0.5, "Turns per second about the bar's axis", unit="rev/s")


class BarScene(Scene):
    """A bar held at its x = 0 end that falls under gravity (drop), or held at both ends, one turning (twist)."""

    scene: Literal["bar"] = "bar"
    variant: Literal["drop", "twist"] = Field("drop", description="drop: one end held; twist: both, the far one turns")
    heterogeneous: bool = Field(False, description="Eight slabs along the bar, every other one ten times stiffer")
    anisotropic: bool = Field(False, description="Fibres along (1, 1, 0) with twice Young's modulus, unless given")
    mesh: BoxMeshSettings = BoxMeshSettings()
    twist: TwistSettings = TwistSettings()

    def build(self) -> Simulation:
        """The bar with its ends held. Raises `InputError` where mesh or settings are wrong."""
        mesh = (
            TetMesh.box(self.mesh.size, cells=self.mesh.cells)
            if self.mesh.path is None
            else TetMesh.read(self.mesh.path)
        )
        low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
        near = 1e-6 * (high[0] - low[0])
        simulation = Simulation(mesh, **self.simulation_arguments() | self._composition(mesh))
        simulation.pin(mesh.nodes_where(lambda x: x[:, 0] <= low[0] + near))
        if self.variant == "twist":
            centre = 0.5 * (low + high)
            axis = Rotation(axis=(1.0, 0.0, 0.0), origin=tuple(centre), rate=self.twist.rate)
            simulation.move(mesh.nodes_where(lambda x: x[:, 0] >= high[0] - near), axis)
        self.loads.add_to(simulation)
        return simulation

    def _composition(self, mesh: TetMesh) -> dict[str, Any]:
        """Material and fibres, for the variants of the paper's figures 3 and 4 (the numbers are ours)."""
        arguments: dict[str, Any] = {}
        if self.heterogeneous:
            x = mesh.centroids()[:, 0]
            slab = np.floor(8 * (x - mesh.positions[:, 0].min()) / np.ptp(mesh.positions[:, 0]))
            arguments["material"] = self.material.on(mesh).stiffened(np.where(slab % 2 == 1, 10.0, 1.0))
        if self.anisotropic and self.fibres is None:
            arguments["fibres"] = (Fibres(modulus=2 * self.material.on(mesh).modulus(), direction=(1.0, 1.0, 0.0)),)
        return arguments
