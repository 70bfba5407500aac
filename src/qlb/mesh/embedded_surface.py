"""A surface that follows the tetrahedra it lies in: what pictures and exports show of a body."""

from __future__ import annotations

from dataclasses import dataclass
from typing import TYPE_CHECKING

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray
from qlb.errors import InputError

if TYPE_CHECKING:
    from qlb.mesh.tet_mesh import TetMesh


@dataclass(frozen=True, eq=False)
class EmbeddedSurface:
    """Vertices at x_v = sum_a w_va x_(n_va), n_v the corners of the tet that vertex v belongs to (linear embedding).

    A vertex may lie outside its tet, with weights below 0 that still sum to 1. Since such weights do not change under
    an affine map, a scaled or turned mesh keeps its surface.
    """

    triangles: IntArray
    """vertex indices, outward oriented, shape (t, 3)"""
    tets: IntArray
    """of each vertex, shape (v,)"""
    weights: FloatArray
    """barycentric, shape (v, 4)"""
    nodes: IntArray
    """corners of that tet, shape (v, 4)"""

    @staticmethod
    def on(mesh: TetMesh, triangles: npt.ArrayLike, tets: npt.ArrayLike, weights: npt.ArrayLike) -> EmbeddedSurface:
        """A surface in `mesh`, checked.

        Raises:
            InputError: arrays that do not fit together, an index out of range, weights that do not sum to 1.
        """
        t, w = np.asarray(triangles), np.array(weights, dtype=np.float64)
        owner = np.asarray(tets)
        if t.ndim != 2 or t.shape[1:] != (3,) or w.shape != (len(owner), 4) or owner.ndim != 1:
            raise InputError(
                f"an embedded surface has triangles {t.shape}, tets {owner.shape}, weights {w.shape}; must be (t, 3),"
                " (v,), (v, 4)"
            )
        for name, values, limit in (("triangles", t, len(owner)), ("tets", owner, len(mesh.tets))):
            if values.size and (values.min() < 0 or values.max() >= limit):
                raise InputError(f"{name} of an embedded surface are out of range: must be in [0, {limit - 1}]")
        if not (np.abs(w.sum(axis=1) - 1) <= 1e-6).all():
            raise InputError("weights of an embedded surface are out of range: those of a vertex must sum to 1")
        return EmbeddedSurface(t.astype(np.int32), owner.astype(np.int32), w, mesh.tets[owner])

    @staticmethod
    def of_boundary(mesh: TetMesh) -> EmbeddedSurface:
        """The boundary of `mesh` itself: its nodes as vertices, with weights 1 and 0."""
        nodes, triangles = np.unique(mesh.boundary_triangles(), return_inverse=True)
        owner = np.empty(len(mesh.positions), dtype=np.int32)
        owner[mesh.tets] = np.arange(len(mesh.tets), dtype=np.int32)[:, None]
        tets = owner[nodes]
        weights = (mesh.tets[tets] == nodes[:, None]).astype(np.float64)
        return EmbeddedSurface(triangles.reshape(-1, 3).astype(np.int32), tets, weights, mesh.tets[tets])

    @staticmethod
    def union(surfaces: list[EmbeddedSurface], first_tets: npt.ArrayLike, union: TetMesh) -> EmbeddedSurface:
        """One after the other, on the union of their meshes; `first_tets` of each mesh in it, shape (k,)."""
        if len(surfaces) == 1:
            return surfaces[0]
        first = np.cumsum([0, *(len(s.tets) for s in surfaces)])[:-1]
        begin = np.asarray(first_tets)
        tets = np.concatenate([s.tets + b for s, b in zip(surfaces, begin, strict=True)]).astype(np.int32)
        triangles = np.concatenate([s.triangles + f for s, f in zip(surfaces, first, strict=True)]).astype(np.int32)
        return EmbeddedSurface(triangles, tets, np.concatenate([s.weights for s in surfaces]), union.tets[tets])

    def of_nodes(self, values: FloatArray) -> FloatArray:
        """Values at the vertices, of shape (v, ...), from those at the nodes of the mesh, (n, ...) with n or more rows.

        With the positions of the nodes these are the positions of the vertices [m].
        """
        return np.asarray(np.einsum("va,va...->v...", self.weights, values[self.nodes]))
