"""The bar of the paper: a box of tetrahedra, held at one end or at both."""

from __future__ import annotations

from typing import Annotated, Any, Literal

import numpy as np
from pydantic import Field

from qlb.materials import Fibres
from qlb.mesh import TetMesh
from qlb.scenes.mesh_source import MeshSource
from qlb.scenes.scene import Scene
from qlb.scenes.values import Vector
from qlb.setting_keys import at_key
from qlb.settings import Settings, quantity
from qlb.simulation import Simulation
from qlb.system import Rotation

Cells = Annotated[int, Field(le=1_000_000)]


class BoxMeshSettings(MeshSource):
    """A box of tetrahedra, or a mesh file."""

    size: Vector = Field((1.0, 0.25, 0.25), description="Lengths of the box [m]")
    cells: tuple[Cells, Cells, Cells] = Field((20, 5, 5), description="Cells along each axis, six tetrahedra in each")

    def make(self) -> TetMesh:
        """The mesh. Raises `InputError` where the file or a setting is wrong."""
        return TetMesh.box(self.size, cells=self.cells) if self.path is None else self.load(self.path)


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

    def make(self) -> Simulation:
        """The bar with its ends held. Raises `InputError` where mesh or settings are wrong."""
        with at_key("mesh"):
            mesh = self.mesh.make()
        low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
        near = 1e-6 * (high[0] - low[0])
        simulation = Simulation(mesh, **self.simulation_arguments() | self.composition() | self._variation(mesh))
        simulation.pin(mesh.nodes_where(lambda x: x[:, 0] <= low[0] + near))
        if self.variant == "twist":
            centre = 0.5 * (low + high)
            axis = Rotation(axis=(1.0, 0.0, 0.0), origin=tuple(centre), rate=self.twist.rate)
            simulation.move(mesh.nodes_where(lambda x: x[:, 0] >= high[0] - near), axis)
        self.add_to(simulation)
        return simulation

    def _variation(self, mesh: TetMesh) -> dict[str, Any]:
        """Material and fibres, for the variants of the paper's figures 3 and 4 (the numbers are ours)."""
        arguments: dict[str, Any] = {}
        if self.heterogeneous:
            x = mesh.centroids()[:, 0]
            slab = np.floor(8 * (x - mesh.positions[:, 0].min()) / np.ptp(mesh.positions[:, 0]))
            arguments["material"] = self.material.on(mesh).stiffened(np.where(slab % 2 == 1, 10.0, 1.0))
        if self.anisotropic and self.fibres is None:
            arguments["fibres"] = (Fibres(modulus=2 * self.material.on(mesh).modulus(), direction=(1.0, 1.0, 0.0)),)
        return arguments
