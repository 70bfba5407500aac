"""Moving the nodes of a mesh to better places without changing its tets."""

from __future__ import annotations

import numpy as np

from qlb.arrays import FloatArray, IntArray
from qlb.mesh import TetMesh
from qlb.mesh.geometry import signed_volumes
from qlb.shapes.solid import Solid

ROUNDS, NEWTON = 10, 5
RELAX = 0.3
"""Share of the way to the middle of the neighbours that a node goes in a round."""
FLOOR = 0.45
"""No tet may fall below this quality by a move; one that is below may not get worse. A regular tet has 1."""
GRADIENT_STEP = 1e-4
"""Of the difference that estimates the normal of the surface, in mean edges."""
ON_SURFACE = 0.1
"""How near to the surface nodes must come, in those steps."""


def smooth(mesh: TetMesh, solid: Solid) -> TetMesh:
    """The mesh with evener tets: nodes go towards the middle of their neighbours, along the surface if on it.

    All nodes move at once; those of tets that would come out worse stay, until no tet does. So the worst tet never gets
    worse, and the result does not depend on the order of anything.
    """
    x = mesh.positions.copy()
    faces = mesh.boundary_triangles()
    outer = np.zeros(len(x), dtype=bool)
    outer[faces] = True
    inner_edges, outer_edges = _edges(mesh.tets), _edges(faces)
    quality = tet_quality(x, mesh.tets)
    step = GRADIENT_STEP * float(mesh.edge_lengths().mean())
    for _ in range(ROUNDS):
        goal = (1 - RELAX) * x + RELAX * np.where(outer[:, None], _middle(x, outer_edges), _middle(x, inner_edges))
        goal[outer] = _onto(solid, goal[outer], step)
        x, quality = _move(x, goal, mesh.tets, quality)
    return TetMesh(x, mesh.tets)


def tet_quality(positions: FloatArray, tets: IntArray) -> FloatArray:
    """6 sqrt 2 V / l^3 with l the root mean square of the edges: 1 for a regular tet, 0 for a flat one, shape (m,).

    Parthasarathy, Graichen, Hathaway (1994), "A comparison of tetrahedron quality measures", FEAD 15.
    """
    corners = positions[tets]
    a, b = np.triu_indices(4, k=1)
    edges = corners[:, a] - corners[:, b]
    mean_square = np.einsum("eij,eij->e", edges, edges) / 6
    return np.asarray(6 * np.sqrt(2) * signed_volumes(positions, tets) / mean_square**1.5)


def _edges(cells: IntArray) -> IntArray:
    """Pairs of nodes that share a cell, each pair once, shape (e, 2)."""
    a, b = np.triu_indices(cells.shape[1], k=1)
    pairs = np.sort(np.stack([cells[:, a], cells[:, b]], axis=-1).reshape(-1, 2), axis=1).astype(np.int64)
    count = int(cells.max()) + 1
    keys = np.unique(pairs[:, 0] * count + pairs[:, 1])
    return np.stack([keys // count, keys % count], axis=-1).astype(np.int32)


def _middle(x: FloatArray, edges: IntArray) -> FloatArray:
    """The mean of the neighbours of each node, shape (n, 3); the node itself where it has none."""
    start, end = np.concatenate([edges, edges[:, ::-1]]).T
    degree = np.bincount(start, minlength=len(x))
    total = np.stack([np.bincount(start, weights=x[end, k], minlength=len(x)) for k in range(3)], axis=-1)
    return np.where(degree[:, None] > 0, total / np.maximum(degree, 1)[:, None], x)


def _onto(solid: Solid, points: FloatArray, step: float) -> FloatArray:
    """Points near the surface moved onto it, along the gradient of the solid's function there, shape (k, 3).

    NaN where that does not lead to the surface, as may be at creases.
    """
    offsets = step * np.eye(3)
    gradient = np.stack([solid(points + d) - solid(points - d) for d in offsets], axis=-1) / (2 * step)
    square = np.einsum("ij,ij->i", gradient, gradient)
    square[square == 0] = np.inf
    for _ in range(NEWTON):
        points = points - (solid(points) / square)[:, None] * gradient
    reached = np.abs(solid(points)) < ON_SURFACE * step * np.sqrt(square)
    return np.where(reached[:, None], points, np.nan)


def _move(x: FloatArray, goal: FloatArray, tets: IntArray, quality: FloatArray) -> tuple[FloatArray, FloatArray]:
    """`goal` where no tet suffers from it, else x; with the quality of the tets."""
    moved = np.where(np.isfinite(goal).all(axis=1, keepdims=True), goal, x)
    stays = np.zeros(len(x), dtype=bool)
    while True:
        new = tet_quality(moved, tets)
        worse = (new < np.minimum(quality, FLOOR)) & ~stays[tets].all(axis=1)
        if not worse.any():
            return moved, new
        stays[tets[worse]] = True
        moved[stays] = x[stays]
