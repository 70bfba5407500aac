"""Geometry of tetrahedra and triangles."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray

SLIVER = 1e-10
"""A triangle counts as degenerate when its area is below this share of its longest edge squared."""


def signed_volumes(positions: FloatArray, tets: IntArray) -> FloatArray:
    """det(x1 - x0, x2 - x0, x3 - x0) / 6 of each tet [m^3], shape (m,)."""
    corners = positions[tets]
    edges = corners[:, 1:] - corners[:, :1]
    return np.asarray(np.einsum("ij,ij->i", edges[:, 0], np.cross(edges[:, 1], edges[:, 2])) / 6.0)


def triangle_areas(positions: FloatArray, triangles: npt.NDArray[np.integer]) -> FloatArray:
    """Areas [m^2], shape (t,)."""
    a, b, c = positions[triangles].transpose(1, 0, 2)
    return np.asarray(0.5 * np.linalg.norm(np.cross(b - a, c - a), axis=1))


def longest_edges(positions: FloatArray, triangles: npt.NDArray[np.integer]) -> FloatArray:
    """Length of the longest edge of each triangle [m], shape (t,)."""
    corners = positions[triangles]
    return np.asarray(np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1, initial=0.0))


def parts(count: int, a: npt.NDArray[np.integer], b: npt.NDArray[np.integer]) -> IntArray:
    """The connected part of each of `count` nodes, from 0, where edges join nodes a and b (e,): shape (count,)."""
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count))
    labels: IntArray = connected_components(graph, directed=False)[1]
    return labels


def tet_components(tets: IntArray) -> int:
    """Number of parts of a mesh that hang together through faces."""
    faces = np.sort(tets.astype(np.int64)[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
    nodes = int(tets.max()) + 1
    pair = np.unique(faces[:, 0] * nodes + faces[:, 1], return_inverse=True)[1].reshape(-1)
    keys = pair * nodes + faces[:, 2]  # one number for each sorted triple
    order = np.argsort(keys, kind="stable")
    shared = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    return int(parts(len(tets), order[shared] // 4, order[shared + 1] // 4).max()) + 1
