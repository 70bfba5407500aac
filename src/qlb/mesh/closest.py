"""Which tet points lie in, and how far they are from the boundary: what embeds a fine surface in coarse tets."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray, LongArray
from qlb.mesh.embedded_surface import EmbeddedSurface

if TYPE_CHECKING:
    from qlb.mesh.tet_mesh import TetMesh

INSIDE = -1e-9
"""A barycentric coordinate from which on a point counts as within a tet."""
PAIRS = 500_000
"""Of points and cells that are looked at together, which bounds the memory."""


@dataclass(frozen=True)
class Embedding:
    """A surface in a mesh, and how far its vertices are from the boundary."""

    surface: EmbeddedSurface
    distances: FloatArray
    """of each vertex from the boundary of the mesh [m], shape (v,)"""


def embed(mesh: TetMesh, vertices: FloatArray, triangles: npt.ArrayLike) -> Embedding:
    """A surface of `vertices` (v, 3) [m] and `triangles` (t, 3) that follows `mesh`.

    A vertex belongs to the tet that it lies in, or where it lies in none, to the tet behind the nearest point of the
    boundary. Of its weights some are then negative: it moves with the affine map of that tet.
    """
    boundary, owner = _boundary(mesh)
    nearest, distances = closest_triangles(mesh.positions[boundary], vertices)
    tets = containing_tets(mesh.positions[mesh.tets], vertices)
    tets = np.where(tets < 0, owner[nearest], tets)
    weights = barycentric(mesh.positions[mesh.tets[tets]], vertices)
    return Embedding(EmbeddedSurface.on(mesh, triangles, tets, weights), distances)


def _boundary(mesh: TetMesh) -> tuple[IntArray, LongArray]:
    """The triangles of the boundary (k, 3), and the tet of each (k,)."""
    from scipy.spatial import cKDTree

    triangles = mesh.boundary_triangles()
    faces = mesh.tets[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
    # Node indices are far below 2^53, so that as numbers they are found again exactly.
    found = cKDTree(np.sort(faces, axis=1).astype(float)).query(np.sort(triangles, axis=1).astype(float))[1]
    return triangles, np.asarray(found) // 4


def barycentric(corners: FloatArray, points: FloatArray) -> FloatArray:
    """Weights (k, 4), which sum to 1, of points (k, 3) in tets with corners (k, 4, 3)."""
    edges = (corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1)
    w = np.linalg.solve(edges, (points - corners[:, 0])[..., None])[..., 0]
    return np.concatenate([1 - w.sum(axis=1, keepdims=True), w], axis=1)


def containing_tets(corners: FloatArray, points: FloatArray) -> LongArray:
    """The tet that each point (p, 3) lies in, of those with corners (m, 4, 3), or -1: shape (p,)."""
    found = np.full(len(points), -1, dtype=np.int64)
    best = np.full(len(points), INSIDE)
    for which, tet in _candidates(corners, points, np.zeros(len(points))):
        lowest = barycentric(corners[tet], points[which]).min(axis=1)
        order = np.lexsort((-tet, lowest))  # the last of each point that is assigned is its best
        better = order[lowest[order] >= best[which[order]]]
        found[which[better]] = tet[better]
        best[which[better]] = lowest[better]
    return found


def closest_triangles(corners: FloatArray, points: FloatArray) -> tuple[LongArray, FloatArray]:
    """The nearest of triangles with corners (k, 3, 3), and the distance from it, of each point (p, 3)."""
    from scipy.spatial import cKDTree

    near, first = cKDTree(corners.mean(axis=1)).query(points)
    found, best = np.asarray(first, dtype=np.int64), np.asarray(near, dtype=np.float64)
    reach = best * (1 + 1e-12)  # the nearest centroid bounds the distance
    for which, triangle in _candidates(corners, points, reach):
        distance = point_triangle_distance(points[which], corners[triangle])
        order = np.lexsort((triangle, distance))[::-1]
        better = order[distance[order] <= best[which[order]]]
        found[which[better]] = triangle[better]
        best[which[better]] = distance[better]
    return found, best


def _candidates(corners: FloatArray, points: FloatArray, reach: FloatArray) -> Iterator[tuple[LongArray, LongArray]]:
    """Pairs of points (p, 3) and cells with corners (k, c, 3) that hold all which are nearer than `reach` (p,) [m].

    A cell lies within a ball about its centroid. Cells are sorted into classes of about the same radius, each with a
    tree of centroids, so that a few large cells do not make every point look far. Each pair comes once.
    """
    from scipy.spatial import cKDTree

    centres = corners.mean(axis=1)
    radii = np.linalg.norm(corners - centres[:, None], axis=2).max(axis=1)
    classes = np.ceil(2 * np.log2(radii / radii.max())).astype(np.int64)
    for label in np.unique(classes):
        members = np.flatnonzero(classes == label)
        tree, radius = cKDTree(centres[members]), radii[members].max() * (1 + 1e-9)
        counts = tree.query_ball_point(points, reach + radius, return_length=True)
        near = np.flatnonzero(counts)
        chunks = np.cumsum(counts[near]) // PAIRS
        for some in np.split(near, np.flatnonzero(np.diff(chunks)) + 1) if len(near) else []:
            lists = tree.query_ball_point(points[some], reach[some] + radius)
            yield np.repeat(some, counts[some]), members[np.concatenate(lists).astype(np.int64)]


def point_triangle_distance(points: FloatArray, corners: FloatArray) -> FloatArray:
    """Distance of each point (k, 3) from its triangle with corners (k, 3, 3) [m], shape (k,).

    Where the point projects into the triangle it is the distance from the plane, else that from the nearest edge.
    """
    starts, sides = corners, np.roll(corners, -1, axis=1) - corners
    away = points[:, None] - starts
    along = np.einsum("kij,kij->ki", away, sides) / np.maximum(np.einsum("kij,kij->ki", sides, sides), 1e-300)
    to_edges = np.linalg.norm(away - np.clip(along, 0, 1)[..., None] * sides, axis=2).min(axis=1)
    normal = np.cross(sides[:, 0], sides[:, 1])
    length = np.linalg.norm(normal, axis=1)
    inside = (np.einsum("kij,kij->ki", np.cross(sides, away), np.repeat(normal[:, None], 3, axis=1)) >= 0).all(axis=1)
    to_plane = np.abs(np.einsum("ij,ij->i", away[:, 0], normal)) / np.maximum(length, 1e-300)
    return np.asarray(np.where(inside & (length > 0), to_plane, to_edges))
