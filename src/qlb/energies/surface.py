"""Parts of a mesh's surface, as loads need them."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray, LongArray
from qlb.energies.energy import Energy, checked_nodes
from qlb.errors import InputError
from qlb.mesh.tet_mesh import TetMesh


def outward(energy: Energy, faces: npt.ArrayLike, mesh: TetMesh) -> IntArray:
    """`faces` (k, 3) as outward triangles of the surface of `mesh`.

    Raises:
        InputError: no faces, another shape, one that is not on the surface, one given twice.
    """
    given = checked_nodes(energy, "face", faces, mesh)
    if given.shape[1] != 3 or len(given) == 0:
        raise InputError(f"faces of {type(energy).__name__} have shape {given.shape}, must be (k, 3) with k >= 1")
    surface = mesh.boundary_triangles()
    keys, wanted = _keys(surface, len(mesh.positions)), _keys(given, len(mesh.positions))
    order = np.argsort(keys)
    found = order[np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)]
    outside = keys[found] != wanted
    if outside.any():
        k = int(np.argmax(outside))
        raise InputError(f"face {k} of {type(energy).__name__}, {given[k].tolist()}, is not on the mesh's surface")
    _, first, count = np.unique(wanted, return_index=True, return_counts=True)
    if (count > 1).any():
        k = int(first[np.argmax(count > 1)])
        raise InputError(f"face {k} of {type(energy).__name__}, {given[k].tolist()}, is given more than once")
    return surface[found]


def _keys(faces: IntArray, nodes: int) -> LongArray:
    """A number for each triangle, whatever the order of its nodes."""
    low, middle, high = np.sort(faces, axis=1).astype(np.int64).T
    return np.asarray((low * nodes + middle) * nodes + high)


def rim(faces: IntArray) -> IntArray:
    """Directed edges (r, 2) of the faces that are not met by their reverse, each as often as that.

    Where more than two faces of the surface share an edge, some of them may meet and others not.
    """
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    forth = edges[:, 0] < edges[:, 1]
    pairs, index = np.unique(np.sort(edges, axis=1), axis=0, return_inverse=True)
    excess = np.bincount(index.ravel(), weights=np.where(forth, 1.0, -1.0)).astype(np.int64)
    directed = np.where(excess[:, None] > 0, pairs, pairs[:, ::-1])
    return np.repeat(directed, np.abs(excess), axis=0)


def area_vectors(corners: FloatArray) -> FloatArray:
    """Normals of triangles (k, 3, 3), as long as their areas."""
    return np.asarray(0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))
