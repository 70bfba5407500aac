"""The bunny of the paper: dropped on the ground, with self-contact."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from qlb import shapes
from qlb.scenes.contact_scene import CharacterMesh, ContactScene, lifted
from qlb.scenes.values import Vector
from qlb.settings import Settings, quantity
from qlb.simulation import Simulation


class DropSettings(Settings):
    """Where the body starts."""

    height: float = quantity(0.3, "Of its lowest point above the ground", unit="m", gt=0)
    rotation: Vector = Field((0.4, 0.0, 0.5), description="Its turn as a rotation vector [rad]")


class BunnyScene(ContactScene):
    """A soft bunny that is dropped on the ground, rolls over and touches itself, until it lies still."""

    scene: Literal["bunny"] = "bunny"
    mesh: CharacterMesh = CharacterMesh()
    drop: DropSettings = DropSettings()

    def make(self) -> Simulation:
        """The bunny above the ground. Raises `InputError` where mesh or settings are wrong."""
        mesh = lifted(self.mesh.make(shapes.bunny), self.drop.rotation, self.drop.height)
        return self.simulate([self.body(mesh, "bunny")])
