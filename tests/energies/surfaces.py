"""Surfaces under pressure, and the forces on them written down a second time."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from qlb import TetMesh
from tests.support import Array

Faces = NDArray[np.int32]


def follower_forces(x: Array, faces: Faces, pressure: float) -> Array:
    """-p times a third of the area vector of each triangle to each of its nodes [N], shape (n, 3)."""
    forces = np.zeros_like(x)
    for i, j, k in faces:
        area = 0.5 * np.cross(x[j] - x[i], x[k] - x[i])
        for node in (i, j, k):
            forces[node] -= pressure / 3 * area
    return forces


def everywhere(x: Array) -> NDArray[np.bool_]:
    return np.ones(len(x), dtype=bool)


def hollow_sphere(cells: int, inner: float, *, eighth: bool = False) -> TetMesh:
    """A sphere of radius 1 m with a cavity of radius `inner`: the shells of a cube, moved along rays from its centre.

    `cells` along each axis of the whole cube, or of its eighth with x, y, z >= 0.
    """
    half = cells if eighth else cells // 2
    box = TetMesh.box((2.0 * cells / (2 * half),) * 3, cells=(cells,) * 3)
    x = box.positions - (0.0 if eighth else 1.0)
    kept = box.tets[np.abs(x[box.tets].mean(axis=1)).max(axis=1) > inner]
    used, tets = np.unique(kept, return_inverse=True)
    x = x[used]
    radius = np.abs(x).max(axis=1)
    return TetMesh(x * (radius / np.linalg.norm(x, axis=1))[:, None], tets.reshape(-1, 4))


def near_cavity(inner: float, outer: float = 1.0):  # type: ignore[no-untyped-def]
    """For `faces_where`: the faces of the cavity, whose corners lie at `inner`, and not on planes x, y, z = 0."""
    middle = 0.5 * (inner + outer)

    def condition(x: Array) -> NDArray[np.bool_]:
        return (np.linalg.norm(x, axis=1) < middle) & (np.abs(x).min(axis=1) > 1e-9)

    return condition
