"""A scene of one's own: any bodies, and what holds, moves and meets them."""

from __future__ import annotations

from collections.abc import Iterator
from copy import deepcopy
from typing import Annotated, Any, Literal

from pydantic import Field, model_validator

from qlb.bodies import Body
from qlb.bodies.body import centre_of_volume
from qlb.materials import AnyMaterial, Fibres
from qlb.mesh import TetMesh
from qlb.scenes.meshes import AnyMesh
from qlb.scenes.placements import PlacementSettings
from qlb.scenes.scene import Scene
from qlb.scenes.selections import OfBody, list_of, unknown_body
from qlb.scenes.values import Vector
from qlb.setting_keys import SettingError, at_key
from qlb.settings import Settings
from qlb.simulation import Simulation

START: dict[str, Any] = {
    "bodies": [
        {"name": "post", "mesh": {"shape": "box", "size": [0.2, 0.4, 0.2], "tets": 1200}, "placement": {"lowest": 0.0}},
        {
            "name": "ball",
            "mesh": {"shape": "ball", "radius": 0.1, "tets": 1000},
            "material": {"model": "SNH", "young": 5e4, "poisson": 0.4},
            "placement": {"translation": [0.05, 0.0, 0.0], "lowest": 0.45},
        },
    ],
    "contact": {"friction": 0.3},
    "obstacles": [{"name": "ground", "point": [0.0, -0.05, 0.0]}],
    "pins": [{"body": "post", "nodes": "y < 0.001"}],
    "handles": [
        {
            "body": "post",
            "nodes": "(x < -0.099) * (y > 0.3)",
            "motion": {"kind": "translation", "velocity": [-0.1, 0.0, 0.0]},
        }
    ],
}
"""What the scene is without a file: something of each kind, to start from."""


class BodySettings(Settings):
    """An elastic body."""

    name: str | None = Field(None, description="By which others name it; body 0, body 1, ... by default")
    mesh: AnyMesh = Field(description="A shape with its arguments, or a file {path: body.msh}")
    material: AnyMaterial | None = Field(None, description="What it is made of; the material of the scene by default")
    fibres: Annotated[tuple[Fibres, ...], list_of("{modulus: 2e4, direction: [1, 0, 0]}")] | None = Field(
        None, description="Fibres that are added to its material, a list of families; those of the scene by default"
    )
    placement: PlacementSettings = Field(PlacementSettings(), description="Where it lies at rest, and starts")
    velocity: Vector = Field((0.0, 0.0, 0.0), description="Initial velocity [m/s]")

    def make(self, key: str, name: str, material: AnyMaterial, fibres: tuple[Fibres, ...]) -> Body:
        """The body; `material` and `fibres` are those of a body without its own.

        Raises:
            InputError: with what lies at `key`.
        """
        with at_key(f"{key}.mesh"):
            mesh = self.mesh.make()
        with at_key(f"{key}.placement"):
            placement = self.placement.of(mesh.positions, centre_of_volume(mesh))
            placed = placement.of(mesh)
        material = material if self.material is None else self.material
        with at_key(f"{key}.material" if self.material is not None else "material"):
            material.on(placed)
        families = fibres if self.fibres is None else self.fibres
        with at_key(f"{key}.fibres" if self.fibres is not None else "fibres"):
            _check_fibres(families, placed)
        return Body(mesh, material, fibres=families, velocity=self.velocity, placement=placement, name=name)


def _check_fibres(families: tuple[Fibres, ...], mesh: TetMesh) -> None:
    for family in families:
        family.parameter_table(mesh)


class BodiesScene(Scene):
    """Bodies of your own, with what holds, moves and meets them."""

    scene: Literal["bodies"] = "bodies"
    bodies: Annotated[tuple[BodySettings, ...], Field(min_length=1), list_of("{name: ball, mesh: {shape: ball}}")] = (
        Field(description="Elastic bodies")
    )

    @classmethod
    def start(cls) -> dict[str, Any]:
        """A ball falls on a post that stands on the ground and is pulled aside."""
        return deepcopy(START)

    @property
    def names(self) -> list[str]:
        """Of the bodies, in their order."""
        return [body.name or f"body {k}" for k, body in enumerate(self.bodies)]

    @model_validator(mode="after")
    def _check_names(self) -> BodiesScene:
        names = [*self.names, *(obstacle.name for obstacle in self.obstacles)]
        keys = [f"bodies.{k}" for k in range(len(self.bodies))]
        keys += [f"obstacles.{k}" for k in range(len(self.obstacles))]
        for k, (key, name) in enumerate(zip(keys, names, strict=True)):
            if name and name in names[:k]:
                problem = f"{name!r} is given already to {keys[names.index(name)]}"
                raise SettingError(f"{key}.name", f"{key}.name: {problem}")
        for key, selection in self._selections():
            if selection.body is None and len(self.bodies) > 1:
                known = f"must be one of {', '.join(self.names)}"
                raise SettingError(f"{key}.body", f"{key}.body is missing: there are several bodies, {known}")
            if selection.body is not None and selection.body not in self.names:
                raise unknown_body(f"{key}.body", selection.body, self.names)
        return self

    def _selections(self) -> Iterator[tuple[str, OfBody]]:
        """Everything that is about part of a body, with its key."""
        lists: dict[str, tuple[OfBody, ...]] = {"pins": self.pins, "handles": self.handles}
        lists |= {f"loads.{name}": getattr(self.loads, name) for name in ("pressure", "traction", "forces")}
        for key, entries in lists.items():
            yield from ((f"{key}.{k}", entry) for k, entry in enumerate(entries))

    def make(self) -> Simulation:
        """Bodies and obstacles where they are placed. Raises `InputError` where settings are wrong."""
        given = self.composition()
        bodies = [
            body.make(f"bodies.{k}", name, **given)
            for k, (body, name) in enumerate(zip(self.bodies, self.names, strict=True))
        ]
        simulation = Simulation(bodies, **self.simulation_arguments())
        self.add_to(simulation)
        return simulation
