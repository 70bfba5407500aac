"""Plain bodies, centred at the origin."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from qlb.arrays import FloatArray, vectors, whole_number
from qlb.errors import InputError
from qlb.mesh import TetMesh
from qlb.shapes.mesher import mesh_solid
from qlb.shapes.primitives import positive, ring, rounded_cylinder, sphere

DEFAULT_TETS = 5000


def ball(radius: float = 0.1, *, tets: int | None = None, edge: float | None = None) -> TetMesh:
    """A ball of `radius` [m] about the origin, of about `tets` tets (5000 if not given) or with `edge` [m]."""
    return mesh_solid(sphere(radius), **_size(tets, edge), euler=2, name="ball")


def shell(
    radius: float = 0.1, thickness: float = 0.03, *, tets: int | None = None, edge: float | None = None
) -> TetMesh:
    """A hollow ball of outer `radius` and wall `thickness` [m] about the origin."""
    if not 0 < thickness < radius:
        raise InputError(f"shell: thickness {thickness} is out of range: > 0 m, below the radius, {radius:g} m")
    return mesh_solid(sphere(radius) - sphere(radius - thickness), **_size(tets, edge), euler=4, name="shell")


def cylinder(
    radius: float = 0.05,
    height: float = 0.2,
    *,
    rounding: float | None = None,
    tets: int | None = None,
    edge: float | None = None,
) -> TetMesh:
    """A cylinder about the y axis, `height` [m] from end to end, its middle at the origin.

    `rounding` is the radius of its rims [m], by default a fifth of the radius or of half the height; what is finer than
    the tets is rounded by them.
    """
    if rounding is None:
        rounding = 0.2 * min(positive("cylinder: radius", radius), 0.5 * positive("cylinder: height", height))
    return mesh_solid(rounded_cylinder(radius, height, rounding), **_size(tets, edge), euler=2, name="cylinder")


def torus(radius: float = 0.1, tube: float = 0.04, *, tets: int | None = None, edge: float | None = None) -> TetMesh:
    """A ring about the y axis, its middle at the origin: a tube of radius `tube` around a circle of `radius` [m]."""
    return mesh_solid(ring(radius, tube), **_size(tets, edge), euler=0, name="torus")


def box(size: Sequence[float] = (0.2, 0.2, 0.2), *, tets: int | None = None, edge: float | None = None) -> TetMesh:
    """A box of full lengths `size` [m], its middle at the origin, of Kuhn tets in near-cubic cells; see `TetMesh.box`.

    `edge` is the side of the cells [m].
    """
    lengths = vectors("box: size", size, (3,))
    for length in lengths:
        positive("box: size", float(length))
    given = _size(tets, edge)
    if edge is not None:
        with np.errstate(over="ignore"):
            cells = np.maximum(1, np.rint(lengths / positive("box: edge", edge)))
    else:
        cells = _cells(lengths, whole_number("box: tets", given["tets"], 6, 2_000_000))
    if not np.isfinite(cells).all():
        raise InputError(f"box: edge {edge} is out of range: too short for lengths {tuple(lengths.tolist())}")
    mesh = TetMesh.box(tuple(lengths), cells=tuple(int(c) for c in cells))  # type: ignore[arg-type]
    return TetMesh(mesh.positions - 0.5 * lengths, mesh.tets)


def _cells(lengths: FloatArray, tets: int) -> FloatArray:
    """Cells along each axis, nearly cubes, 6 tets each, whose number of tets comes closest to `tets`."""
    side = (6 * np.prod(lengths) / tets) ** (1 / 3) * np.geomspace(0.4, 2.5, 400)
    cells = np.maximum(1, np.rint(lengths / side[:, None]))
    return np.asarray(cells[np.argmin(np.abs(6 * np.prod(cells, axis=1) - tets))])


def _size(tets: int | None, edge: float | None) -> dict[str, Any]:
    return {"tets": DEFAULT_TETS if tets is None and edge is None else tets, "edge": edge}
