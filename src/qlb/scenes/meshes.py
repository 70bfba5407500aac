"""Meshes in scenes: the shapes of `qlb.shapes`, with their arguments, and files."""

from __future__ import annotations

import inspect
from abc import abstractmethod
from functools import reduce
from operator import or_
from typing import TYPE_CHECKING, Annotated, Any, Literal

import numpy as np
from pydantic import Discriminator, Field, Tag, create_model

from qlb.arrays import FloatArray, IntArray
from qlb.mesh import TetMesh
from qlb.mesh.files import read_surface
from qlb.scenes.mesh_source import MeshSource
from qlb.scenes.values import Vector
from qlb.settings import FilePath, Settings, quantity
from qlb.shapes import SHAPES
from qlb.shapes.mesher import FEWEST, MOST


class MeshSettings(Settings):
    """What a body or an obstacle is made of."""

    @abstractmethod
    def make(self) -> TetMesh:
        """The mesh. Raises `InputError` where the settings make none."""

    def surface(self) -> tuple[FloatArray, IntArray]:
        """Vertices [m] (q, 3) and triangles (t, 3) of the surface. Raises `InputError` as `make`."""
        mesh = self.make()
        faces = mesh.boundary_triangles()
        used, renumbered = np.unique(faces, return_inverse=True)
        return mesh.positions[used], renumbered.reshape(faces.shape).astype(np.int32)


class FileMesh(MeshSettings, MeshSource):
    """A mesh file: tetrahedra or a surface to fill for a body, triangles for an obstacle."""

    path: FilePath = Field(description="A mesh file: tets, or a surface, which is filled with tets for a body")

    def make(self) -> TetMesh:
        """The tets of the file, or within its surface."""
        return self.load(self.path)

    def surface(self) -> tuple[FloatArray, IntArray]:
        """The triangles of the file."""
        return read_surface(self.path)


class ShapeMesh(MeshSettings):
    """A shape of `qlb.shapes`; a subclass has its name and arguments."""

    def make(self) -> TetMesh:
        """The shape, meshed."""
        arguments = {name: getattr(self, name) for name in type(self).model_fields}
        return SHAPES[arguments.pop("shape")](**arguments)


_ARGUMENTS: dict[str, tuple[Any, str, dict[str, Any]]] = {
    "tets": (int | None, "About how many tetrahedra it is to have", {"ge": FEWEST, "le": MOST}),
    "edge": (float | None, "In place of tets: about the length of its longest edges", {"unit": "m", "gt": 0}),
    "height": (float, "Length along y", {"unit": "m", "gt": 0}),
    "radius": (float, "Outer radius; of a torus, of the circle within its tube", {"unit": "m", "gt": 0}),
    "thickness": (float, "Of the wall, less than the radius", {"unit": "m", "gt": 0}),
    "tube": (float, "Radius of the tube", {"unit": "m", "gt": 0}),
    "rounding": (
        float | None,
        "Of the rims; by default a fifth of radius or half height",
        {"unit": "m", "gt": 0},
    ),
}
"""Type, meaning and range of the arguments of shapes, which say themselves what they are by default."""


def _shape_model(name: str) -> type[ShapeMesh]:
    """The settings of a shape, from the arguments of the function that makes it."""
    function = SHAPES[name]
    fields: dict[str, Any] = {
        "shape": (
            Literal[name],
            Field(name, description="A shape; for a file give `path` in place of it and its arguments"),
        )
    }
    for argument, parameter in inspect.signature(function).parameters.items():
        if argument == "size":
            fields[argument] = (Vector, Field(parameter.default, description="Lengths along x, y, z [m], all > 0"))
            continue
        kind, description, extra = _ARGUMENTS[argument]
        fields[argument] = (kind, quantity(parameter.default, description, **extra))
    doc = (inspect.getdoc(function) or name).splitlines()[0]
    return create_model(f"{name.capitalize()}Shape", __base__=ShapeMesh, __doc__=doc, __module__=__name__, **fields)


SHAPE_MODELS = {name: _shape_model(name) for name in SHAPES}
"""The settings of each shape, by its name."""


def _shape(value: object) -> str | None:
    """The tag of the settings that `value`, from a file or an object, is for."""
    if isinstance(value, MeshSettings):
        return getattr(value, "shape", FileMesh.__name__)
    if not isinstance(value, dict):
        return None
    if "shape" not in value and "path" in value:
        return FileMesh.__name__
    return value["shape"] if isinstance(value.get("shape"), str) else None


if TYPE_CHECKING:
    AnyMesh = MeshSettings
else:
    _members = [Annotated[FileMesh, Tag(FileMesh.__name__)]]
    _members += [Annotated[model, Tag(name)] for name, model in SHAPE_MODELS.items()]
    AnyMesh = Annotated[reduce(or_, _members), Discriminator(_shape)]
    """A shape, told apart by `shape`, or a file with `path`."""
