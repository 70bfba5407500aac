"""Surfaces and files that the tests of meshes share."""

from __future__ import annotations

from collections.abc import Callable
from pathlib import Path

import meshio
import numpy as np
import trimesh

import qlb

Surface = tuple[np.ndarray, np.ndarray]


def cube(side: float = 1.0) -> Surface:
    """A closed cube of 12 triangles, outward oriented, from the origin."""
    mesh = qlb.TetMesh.box((side, side, side), cells=(1, 1, 1))
    return mesh.positions.copy(), mesh.boundary_triangles()


def ball(subdivisions: int = 3, radius: float = 1.0) -> Surface:
    """An icosphere: 20 * 4^subdivisions triangles."""
    mesh = trimesh.creation.icosphere(subdivisions=subdivisions, radius=radius)
    return np.array(mesh.vertices), np.array(mesh.faces, dtype=np.int32)


def volume(vertices: np.ndarray, triangles: np.ndarray) -> float:
    """By the divergence theorem; positive for an outward orientation."""
    a, b, c = np.moveaxis(vertices[triangles], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def _meshio(form: str, kind: str, **options: object) -> Callable[[Path], None]:
    mesh = qlb.TetMesh.box((1.0, 0.5, 0.25), cells=(2, 2, 1))
    cells = {"tetra": mesh.tets, "triangle": mesh.boundary_triangles()}[kind]
    return lambda path: meshio.Mesh(mesh.positions, [(kind, cells)]).write(path, file_format=form, **options)


def _trimesh(form: str) -> Callable[[Path], None]:
    def write(path: Path) -> None:
        made = trimesh.Trimesh(*cube(), process=False).export(file_type=form)
        path.write_bytes(made if isinstance(made, bytes) else made.encode())

    return write


FILES: dict[str, Callable[[Path], None]] = {
    "gmsh22 text.msh": _meshio("gmsh22", "tetra", binary=False),
    "gmsh22 binary.msh": _meshio("gmsh22", "tetra", binary=True),
    "gmsh41 text.msh": _meshio("gmsh", "tetra", binary=False),
    "gmsh41 binary.msh": _meshio("gmsh", "tetra", binary=True),
    "text.vtk": _meshio("vtk", "tetra", binary=False),
    "binary.vtk": _meshio("vtk", "tetra", binary=True),
    "text.vtu": _meshio("vtu", "tetra", binary=False),
    "binary.vtu": _meshio("vtu", "tetra", binary=True),
    "medit.mesh": _meshio("medit", "tetra"),
    "surface.vtk": _meshio("vtk", "triangle", binary=False),
    "surface.obj": _trimesh("obj"),
    "text.stl": _trimesh("stl_ascii"),
    "binary.stl": _trimesh("stl"),
    "text.ply": lambda path: path.write_bytes(
        trimesh.exchange.ply.export_ply(trimesh.Trimesh(*cube(), process=False), encoding="ascii")
    ),
    "binary.ply": _trimesh("ply"),
    "surface.off": _trimesh("off"),
    "surface.glb": _trimesh("glb"),
}
"""What writes a small mesh, by the name of the file."""
