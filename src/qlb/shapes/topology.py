"""Whether tetrahedra have a boundary that is a closed surface, and of which kind."""

from __future__ import annotations

import numpy as np

from qlb.mesh import TetMesh
from qlb.mesh.geometry import parts


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
    fans = parts(len(start), forward, following[backward])
    return int(fans.max()) + 1 == len(np.unique(triangles))


def characteristic(mesh: TetMesh) -> int:
    """Euler characteristic V - E + F of a closed boundary: 2, less 2 for each handle, plus 2 for each cavity."""
    triangles = mesh.boundary_triangles()
    return len(np.unique(triangles)) - len(triangles) // 2
