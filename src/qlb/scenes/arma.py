"""The armadillo of the paper: pulled by its hands, then let go."""

from __future__ import annotations

from typing import Literal

import numpy as np
from pydantic import Field

from qlb import shapes
from qlb.arrays import FloatArray, IntArray
from qlb.fields import Expression
from qlb.mesh import TetMesh
from qlb.scenes.contact_scene import CharacterMesh, lifted
from qlb.scenes.loads import LoadSettings
from qlb.scenes.scene import Scene
from qlb.scenes.selections import Selection, selected
from qlb.scenes.values import Vector
from qlb.setting_keys import SettingError
from qlb.settings import Settings, quantity
from qlb.simulation import Simulation
from qlb.system import Keyframes


class ArmadilloMesh(CharacterMesh):
    """The armadillo of `qlb.shapes`, or a mesh file, y up."""

    tets: int = quantity(8000, "About how many tetrahedra the shape is to have; a file has its own", ge=100)
    height: float = quantity(1.0, "Height along y before it is turned, to which the mesh is scaled", unit="m", gt=0)
    rotation: Vector = Field(
        (0.0, 0.0, 0.0),
        description="Turns the mesh, so that it looks along x and has its hands at the sides: a rotation vector [rad]",
    )


class PullSettings(Settings):
    """What is held, what is pulled, and how far; x, y, z of expressions are 0 to 1 along the box around the mesh."""

    feet: Selection = Field(
        Expression("(y < 0.07) * (abs(z - 0.5) > 0.12)"), description="Nodes that are held, by their place in the box"
    )
    hands: Selection = Field(
        Expression("(abs(z - 0.5) > 0.4) * (y > 0.5)"),
        description="Nodes that are pulled: those with z > 0.5 along way, the others to the other side",
    )
    way: Vector = Field((-0.08, 0.22, 0.14), description="How far the hands go: forward, up, apart [m]")
    time: float = quantity(0.4, "How long that takes; they start and arrive softly", unit="s", gt=0)
    until: float = quantity(0.4, "When the hands are let go", unit="s", gt=0)


class ArmaScene(Scene):
    """An armadillo whose feet are held; it is pulled by its hands and let go, and swings, without gravity."""

    scene: Literal["arma"] = "arma"
    mesh: ArmadilloMesh = ArmadilloMesh()
    pull: PullSettings = PullSettings()
    loads: LoadSettings = LoadSettings(gravity=(0.0, 0.0, 0.0))

    def make(self) -> Simulation:
        """The armadillo with its feet held. Raises `InputError` where mesh or settings are wrong."""
        mesh = lifted(self.mesh.make(shapes.armadillo), self.mesh.rotation, lowest=0.0)
        simulation = Simulation(mesh, **self.simulation_arguments() | self.composition())
        places = _in_box(mesh)
        simulation.pin(selected("pull.feet", "nodes", self.pull.feet, places))
        for hand in self._hands(places):
            simulation.move(hand, self._motion(apart=float(np.sign(places[hand[0], 2] - 0.5))), until=self.pull.until)
        self.add_to(simulation)
        return simulation

    def _hands(self, places: FloatArray) -> list[IntArray]:
        """Nodes of each hand. Raises `InputError` where there are none on a side."""
        nodes = selected("pull.hands", "nodes", self.pull.hands, places)
        right = places[nodes, 2] > 0.5
        if right.all() or not right.any():
            problem = f"{self.pull.hands} selects nodes on one side of z = 0.5 only"
            raise SettingError("pull.hands", f"pull.hands: {problem}")
        return [nodes[right], nodes[~right]]

    def _motion(self, apart: float) -> Keyframes:
        forward, up, out = self.pull.way
        return Keyframes([0.0, self.pull.time], [[0.0, 0.0, 0.0], [forward, up, apart * out]], ease="smooth")


def _in_box(mesh: TetMesh) -> FloatArray:
    """Where the nodes are in the box around the mesh, 0 to 1 along each axis, shape (n, 3)."""
    x = mesh.positions
    return np.asarray((x - x.min(axis=0)) / np.ptp(x, axis=0))
