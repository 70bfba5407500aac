"""Whether tetrahedra make one body with a boundary that is a closed surface."""

from __future__ import annotations

import numpy as np

from qlb.arrays import LongArray
from qlb.mesh import TetMesh


def pieces(mesh: TetMesh) -> int:
    """Number of parts of a mesh that hang together through faces."""
    faces = np.sort(mesh.tets.astype(np.int64)[:, [[1, 2, 3], [0, 2, 3], [0, 1, 3], [0, 1, 2]]].reshape(-1, 3), axis=1)
    keys = _keys(faces, len(mesh.positions))
    order = np.argsort(keys, kind="stable")
    shared = np.flatnonzero(keys[order][1:] == keys[order][:-1])
    return _parts(len(mesh.tets), order[shared] // 4, order[shared + 1] // 4)


def is_closed_surface(mesh: TetMesh) -> bool:
    """Whether each edge of the boundary has two triangles, and the triangles around each of its nodes make one fan."""
    triangles = mesh.boundary_triangles().astype(np.int64)
    # Directed edge k of a triangle goes from corner k to corner k + 1.
    start, end = triangles.ravel(), np.roll(triangles, -1, axis=1).ravel()
    n = len(mesh.positions)
    forward, backward = np.argsort(start * n + end, kind="stable"), np.argsort(end * n + start, kind="stable")
    keys = (start * n + end)[forward]
    if (keys[1:] == keys[:-1]).any() or (keys != (end * n + start)[backward]).any():
        return False
    # Across an edge, the corner at its start meets that at the end of the edge that runs back, and the other way round.
    following = np.arange(len(start)).reshape(-1, 3)[:, [1, 2, 0]].ravel()
    fans = _parts(len(start), forward, following[backward])
    return fans == len(np.unique(triangles))


def characteristic(mesh: TetMesh) -> int:
    """Euler characteristic V - E + F of a closed boundary: 2, less 2 for each handle, plus 2 for each cavity."""
    triangles = mesh.boundary_triangles()
    return len(np.unique(triangles)) - len(triangles) // 2


def _keys(faces: LongArray, nodes: int) -> LongArray:
    """One number for each sorted triple."""
    pair = np.unique(faces[:, 0] * nodes + faces[:, 1], return_inverse=True)[1]
    return np.asarray(pair * nodes + faces[:, 2])


def _parts(count: int, a: LongArray, b: LongArray) -> int:
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    graph = coo_array((np.ones(len(a), dtype=np.int8), (a, b)), shape=(count, count))
    return int(connected_components(graph, directed=False, return_labels=False))
