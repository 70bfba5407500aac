"""A body: a mesh, what it is made of, and where it lies at rest."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import KW_ONLY, dataclass, replace
from functools import cached_property

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, vectors
from qlb.errors import InputError
from qlb.materials import Fibres, Material
from qlb.mesh import TetMesh


@dataclass(frozen=True)
class Placement:
    """Scales, then turns, then shifts a mesh: x = origin + scale R (X - origin) + translation.

    What comes out is the shape at rest, which knows no strain.

    Args:
        scale: > 0, alike in all directions.
        rotation: R as a rotation vector [rad], along the axis and as long as the angle, shape (3,).
        translation: [m], shape (3,).
        origin: the point that only the translation moves [m], shape (3,); the centre of the mesh's volume by default.

    Raises:
        InputError: an argument is out of range; the message names it.
    """

    scale: float = 1.0
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    translation: tuple[float, float, float] = (0.0, 0.0, 0.0)
    origin: tuple[float, float, float] | None = None

    def __post_init__(self) -> None:
        scale = vectors("scale of a placement", self.scale, ())
        if not scale > 0:
            raise InputError(f"scale of a placement = {self.scale!r} is out of range: must be > 0")
        for name in ("rotation", "translation", "origin"):
            given = getattr(self, name)
            if given is not None:
                checked = vectors(f"{name} of a placement", given, (3,))
                object.__setattr__(self, name, tuple(checked.tolist()))
        object.__setattr__(self, "scale", float(scale))

    def of(self, mesh: TetMesh) -> TetMesh:
        """The placed mesh; `mesh` itself where nothing changes."""
        if self.scale == 1 and not any(self.rotation) and not any(self.translation):
            return mesh
        placed = TetMesh(self.moved(mesh.positions, centre_of_volume(mesh)), mesh.tets, regions=mesh.regions)
        if mesh.report is not None:
            placed.report = replace(mesh.report, edge=self.scale * mesh.report.edge)
        return placed.with_surface(mesh.surface)

    def moved(self, x: FloatArray, centre: FloatArray) -> FloatArray:
        """Points `x` (n, 3) [m] where they are placed; `centre` (3,) [m] stands in for an origin that is not given."""
        if self.scale != 1 or any(self.rotation):
            origin = centre if self.origin is None else np.asarray(self.origin)
            x = origin + self.scale * (x - origin) @ _matrix(self.rotation).T
        return np.asarray(x + np.asarray(self.translation))


@dataclass(frozen=True, eq=False)
class Body:
    """An elastic body of a simulation.

    Args:
        mesh: its tets.
        material: a hyperelastic material. Parameters that vary in space are taken on the placed mesh.
        fibres: families of fibres that are added to it; directions are those of the placed mesh.
        velocity: initial velocity [m/s], shape (3,) or (n, 3).
        placement: where `mesh` lies at rest; as it is by default.
        name: by which it can be asked for, or "".

    Raises:
        InputError: an argument is of another kind or out of range; the message names it.
    """

    mesh: TetMesh
    material: Material
    _: KW_ONLY
    fibres: Sequence[Fibres] = ()
    velocity: npt.ArrayLike = (0.0, 0.0, 0.0)
    placement: Placement = Placement()
    name: str = ""

    def __post_init__(self) -> None:
        _require("mesh", self.mesh, "a TetMesh", isinstance(self.mesh, TetMesh))
        _require("material", self.material, "a Material", isinstance(self.material, Material))
        _require("placement", self.placement, "a Placement", isinstance(self.placement, Placement))
        _require("name", self.name, "text", isinstance(self.name, str))
        fibres = tuple(self.fibres) if isinstance(self.fibres, Sequence) else (self.fibres,)
        for family in fibres:
            _require("fibres", family, "Fibres", isinstance(family, Fibres))
        object.__setattr__(self, "fibres", fibres)
        object.__setattr__(self, "velocity", vectors("velocity", self.velocity, self.mesh.positions.shape))

    @cached_property
    def placed(self) -> TetMesh:
        """The mesh as it lies at rest."""
        return self.placement.of(self.mesh)


def centre_of_volume(mesh: TetMesh) -> FloatArray:
    """Mean of the rest positions over the volume [m], shape (3,)."""
    return np.asarray(np.average(mesh.centroids(), axis=0, weights=mesh.volumes()))


def _matrix(rotation: tuple[float, float, float]) -> FloatArray:
    from scipy.spatial.transform import Rotation

    return np.asarray(Rotation.from_rotvec(rotation).as_matrix())


def _require(name: str, value: object, allowed: str, ok: bool) -> None:
    if not ok:
        raise InputError(f"{name} of a body = {value!r} is out of range: must be {allowed}")
