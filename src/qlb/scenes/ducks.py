"""The ducks of the paper: several, dropped on each other and the ground."""

from __future__ import annotations

from math import cos, pi, sin, sqrt
from typing import Literal

import numpy as np

from qlb import shapes
from qlb.bodies import Body
from qlb.mesh import TetMesh
from qlb.scenes.contact_scene import CharacterMesh, ContactScene, lifted
from qlb.scenes.values import Vector
from qlb.settings import Settings, quantity
from qlb.simulation import Simulation

GOLDEN = pi * (3 - sqrt(5))
"""The golden angle [rad]: its multiples never come back to the same direction."""


class StackSettings(Settings):
    """Where the ducks start: one above the other, each turned and shifted from the one below."""

    height: float = quantity(0.05, "Of the lowest above the ground", unit="m", gt=0)
    spacing: float = quantity(0.03, "Between the top of one and the bottom of the next", unit="m", gt=0)
    offset: float = quantity(0.05, "How far their middles are from the axis of the stack", unit="m", ge=0)
    tilt: float = quantity(0.5, "How far they lean", unit="rad")


class DucksScene(ContactScene):
    """Soft ducks that fall on each other and the ground, and come to rest as a heap."""

    scene: Literal["ducks"] = "ducks"
    count: int = quantity(5, "Number of ducks", ge=1, le=100)
    mesh: CharacterMesh = CharacterMesh(tets=2000, height=0.25)
    stack: StackSettings = StackSettings()

    def make(self) -> Simulation:
        """The stack of ducks. Raises `InputError` where mesh or settings are wrong."""
        mesh, lowest = self.mesh.make(shapes.duck), self.stack.height
        bodies: list[Body] = []
        for k in range(self.count):
            placed = self._placed(mesh, k, lowest)
            bodies.append(self.body(placed, f"duck {k}"))
            lowest = float(placed.positions[:, 1].max()) + self.stack.spacing
        return self.simulate(bodies)

    def _placed(self, mesh: TetMesh, k: int, lowest: float) -> TetMesh:
        """The mesh of duck `k`: it leans about a level axis, and looks another way than the one below."""
        from scipy.spatial.transform import Rotation

        angle, offset, tilt = GOLDEN * k, self.stack.offset, self.stack.tilt
        lean = Rotation.from_rotvec([tilt * cos(2 * angle), 0.0, tilt * sin(2 * angle)])
        turn: Vector = tuple(np.asarray((Rotation.from_rotvec([0.0, angle, 0.0]) * lean).as_rotvec()).tolist())
        return lifted(mesh, turn, lowest, offset * cos(angle), offset * sin(angle))
