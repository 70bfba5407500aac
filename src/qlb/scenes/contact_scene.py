"""What scenes with contact have in common: a character, the ground, and settings of contact."""

from __future__ import annotations

from collections.abc import Callable, Sequence

import numpy as np
from pydantic import Field

from qlb.bodies import Body, Placement, Plane
from qlb.contact import Contact
from qlb.energies import Damping
from qlb.integrators import INTEGRATORS
from qlb.materials import AnyMaterial, StableNeoHookean
from qlb.mesh import TetMesh
from qlb.scenes.mesh_source import MeshSource
from qlb.scenes.scene import MOST_STEPS, AnyContact, Scene
from qlb.scenes.values import Vector
from qlb.setting_keys import at_key
from qlb.settings import choice, quantity
from qlb.simulation import Simulation


class CharacterMesh(MeshSource):
    """A character of `qlb.shapes`, or a mesh file, y up."""

    height: float = quantity(0.3, "Height along y before it is turned, to which the mesh is scaled", unit="m", gt=0)

    def make(self, shape: Callable[..., TetMesh]) -> TetMesh:
        """The mesh. Raises `InputError` where the file is wrong, or the shape cannot be made with so few tets."""
        with at_key("mesh"):
            mesh = shape(**self.target()) if self.path is None else self.load(self.path)
        return Placement(scale=self.height / float(np.ptp(mesh.positions[:, 1]))).of(mesh)


class ContactScene(Scene):
    """Settings of scenes in which bodies fall on the ground, the plane y = 0."""

    material: AnyMaterial = Field(StableNeoHookean(young=2e4, poisson=0.45), description="What the bodies are made of")
    damping: Damping = Damping(viscosity=20)
    contact: AnyContact | None = Field(Contact(friction=0.3), description="How things touch; false: not at all")
    integrator: str = choice("SDIRK2", "Time integrator", INTEGRATORS)
    steps: int = quantity(200, "Number of time steps", ge=1, le=MOST_STEPS)

    def simulate(self, bodies: Sequence[Body]) -> Simulation:
        """The bodies over the ground, with the loads. Raises `InputError` where settings are wrong."""
        arguments = self.simulation_arguments()
        arguments["obstacles"] = [Plane((0, 0, 0), (0, 1, 0), name="ground"), *arguments["obstacles"]]
        simulation = Simulation(bodies, **arguments)
        self.add_to(simulation)
        return simulation

    def body(self, mesh: TetMesh, name: str) -> Body:
        """A body of the scene's material, where `mesh` lies."""
        return Body(mesh, **self.composition(), name=name)


def lifted(mesh: TetMesh, rotation: Vector, lowest: float, x: float = 0.0, z: float = 0.0) -> TetMesh:
    """`mesh` turned about its centre of volume (a rotation vector [rad]), lowest at y = `lowest`, and centred at x, z.

    Raises:
        InputError: a number that is not finite.
    """
    turned = Placement(rotation=rotation).of(mesh).positions
    low, high = turned.min(axis=0), turned.max(axis=0)
    shift = (x - 0.5 * (low[0] + high[0]), lowest - low[1], z - 0.5 * (low[2] + high[2]))
    return Placement(rotation=rotation, translation=shift).of(mesh)
