"""What the tests of shapes measure, in other ways than the mesher."""

from __future__ import annotations

from collections import Counter

import ipctk
import numpy as np
from scipy.sparse import coo_array
from scipy.sparse.csgraph import connected_components

import qlb


def dihedral_angles(mesh: qlb.TetMesh) -> np.ndarray:
    """The six angles of each tet [degrees], shape (m, 6)."""
    x = mesh.positions[mesh.tets]
    angles = []
    for i, j, k, m in [(0, 1, 2, 3), (0, 2, 1, 3), (0, 3, 1, 2), (1, 2, 0, 3), (1, 3, 0, 2), (2, 3, 0, 1)]:
        # Seen along edge ij, the angle between what is across it of the other two corners.
        axis = x[:, j] - x[:, i]
        axis /= np.linalg.norm(axis, axis=1)[:, None]
        a, b = (d - (d * axis).sum(axis=1)[:, None] * axis for d in (x[:, k] - x[:, i], x[:, m] - x[:, i]))
        cosine = (a * b).sum(axis=1) / np.linalg.norm(a, axis=1) / np.linalg.norm(b, axis=1)
        angles.append(np.degrees(np.arccos(np.clip(cosine, -1, 1))))
    return np.stack(angles, axis=1)


def edges_of(triangles: np.ndarray) -> np.ndarray:
    """Both ends of the three edges of each triangle, each pair sorted, shape (3 f, 2)."""
    return np.sort(triangles[:, [0, 1, 1, 2, 2, 0]].reshape(-1, 2), axis=1)


def surface_characters(mesh: qlb.TetMesh) -> list[int]:
    """Euler characteristics V - E + F of the parts of the boundary, which must be closed; ascending."""
    triangles = mesh.boundary_triangles()
    edges = edges_of(triangles)
    assert set(Counter(map(tuple, edges.tolist())).values()) == {2}
    n = len(mesh.positions)
    part = connected_components(coo_array((np.ones(len(edges)), edges.T), shape=(n, n)), directed=False)[1]
    unique = np.unique(edges, axis=0)
    characters = [
        int(
            (part[np.unique(triangles)] == p).sum()
            - (part[unique[:, 0]] == p).sum()
            + (part[triangles[:, 0]] == p).sum()
        )
        for p in np.unique(part[triangles])
    ]
    return sorted(characters)


def intersects_itself(mesh: qlb.TetMesh) -> bool:
    """Whether the boundary does, by ipctk."""
    nodes, renumbered = np.unique(mesh.boundary_triangles(), return_inverse=True)
    triangles = renumbered.reshape(-1, 3).astype(np.int32)
    edges = ipctk.edges(triangles)
    positions = np.asfortranarray(mesh.positions[nodes])
    return bool(ipctk.has_intersections(ipctk.CollisionMesh(positions, edges, triangles), positions))


def enclosed_volume(mesh: qlb.TetMesh) -> float:
    """By the divergence theorem over the boundary [m^3]."""
    a, b, c = np.moveaxis(mesh.positions[mesh.boundary_triangles()], 1, 0)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)
