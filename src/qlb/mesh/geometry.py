"""Geometry of tetrahedra and triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray


def signed_volumes(positions: FloatArray, tets: IntArray) -> FloatArray:
    """det(x1 - x0, x2 - x0, x3 - x0) / 6 of each tet [m^3], shape (m,)."""
    corners = positions[tets]
    edges = corners[:, 1:] - corners[:, :1]
    return np.asarray(np.einsum("ij,ij->i", edges[:, 0], np.cross(edges[:, 1], edges[:, 2])) / 6.0)


def triangle_areas(positions: FloatArray, triangles: npt.NDArray[np.integer]) -> FloatArray:
    """Areas [m^2], shape (t,)."""
    a, b, c = positions[triangles].transpose(1, 0, 2)
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))
