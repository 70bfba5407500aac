"""Obstacles in scenes: planes and surfaces that stand still or move."""

from __future__ import annotations

from typing import Annotated

import numpy as np
from pydantic import Discriminator, Field, Tag

from qlb.arrays import FloatArray, IntArray
from qlb.bodies import Obstacle, Plane
from qlb.mesh.geometry import triangle_areas
from qlb.scenes.meshes import AnyMesh
from qlb.scenes.motions import AnyMotion
from qlb.scenes.placements import PlacementSettings
from qlb.scenes.values import Vector
from qlb.setting_keys import at_key
from qlb.settings import Settings

_MOTION = Field(None, description="How it moves, such as {kind: translation, velocity: [0, 0.1, 0]}; not by default")
_NAME = Field("", description="By which pairs of contact and results name it")


class PlaneSettings(Settings):
    """A solid half-space."""

    name: str = _NAME
    point: Vector = Field((0.0, 0.0, 0.0), description="On its face [m]")
    normal: Vector = Field((0.0, 1.0, 0.0), description="Out of the solid, of any length > 0")
    motion: AnyMotion | None = _MOTION

    def make(self, key: str) -> Plane:
        """The plane. Raises `InputError` with what lies at `key`."""
        with at_key(key):
            motion = None if self.motion is None else self.motion.motion()
            return Plane(self.point, self.normal, motion=motion, name=self.name)


class SurfaceSettings(Settings):
    """A surface of triangles: of a shape, or from a file."""

    name: str = _NAME
    mesh: AnyMesh = Field(description="A shape such as {shape: torus, radius: 0.1}, or a file {path: ramp.obj}")
    placement: PlacementSettings = PlacementSettings()
    motion: AnyMotion | None = _MOTION

    def make(self, key: str) -> Obstacle:
        """The obstacle. Raises `InputError` with what lies at `key`."""
        with at_key(f"{key}.mesh"):
            vertices, triangles = self.mesh.surface()
        with at_key(f"{key}.placement"):
            centre = _centre_of_area(vertices, triangles)
            vertices = self.placement.of(vertices, centre).moved(vertices, centre)
        with at_key(key):
            motion = None if self.motion is None else self.motion.motion()
            return Obstacle(vertices, triangles, motion=motion, name=self.name)


def _centre_of_area(vertices: FloatArray, triangles: IntArray) -> FloatArray:
    """Mean of a surface over its area [m], shape (3,); of its vertices where it has none."""
    area = triangle_areas(vertices, triangles)
    if not area.sum() > 0:
        return np.asarray(vertices.mean(axis=0))
    return np.asarray(np.average(vertices[triangles].mean(axis=1), axis=0, weights=area))


def _kind(value: object) -> str:
    has_mesh = "mesh" in value if isinstance(value, dict) else isinstance(value, SurfaceSettings)
    return SurfaceSettings.__name__ if has_mesh else PlaneSettings.__name__


AnyObstacle = Annotated[
    Annotated[PlaneSettings, Tag("PlaneSettings")] | Annotated[SurfaceSettings, Tag("SurfaceSettings")],
    Discriminator(_kind),
]
"""A surface where there is a `mesh`, else a plane."""
