"""Surfaces for tests of the broad phase, and what IPC Toolkit says of their pairs one by one."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass

import ipctk
import numpy as np
import numpy.typing as npt

from qlb import TetMesh, _native
from tests.support import Array

Ints = npt.NDArray[np.int32]
Pairs = set[tuple[int, int]]


@dataclass
class Soup:
    """Triangles at `x` (n, 3), faces (f, 3), the group of each node, and who may touch whom."""

    x: Array
    faces: Ints
    group: Ints
    allowed: npt.NDArray[np.uint8]

    def __post_init__(self) -> None:
        self.surface = _native.ContactSurface(self.x, self.faces, self.group, self.allowed)

    def candidates(self, threads: int = 1) -> _native.Candidates:
        return _native.Candidates(self.surface, threads)

    def may_touch(self, a: Ints, b: Ints) -> bool:
        return not set(a) & set(b) and bool(self.allowed[self.group[a[0]], self.group[b[0]]])

    def vertex_faces(self) -> Iterator[tuple[int, int, Ints]]:
        """Number of the node, of the face, and the four nodes of every pair that may touch."""
        for v in self.surface.vertices:
            for f, face in enumerate(self.faces):
                if self.may_touch(np.array([v]), face):
                    yield int(v), f, np.array([v, *face])

    def edge_edges(self) -> Iterator[tuple[int, int, Ints]]:
        edges = self.surface.edges
        for e in range(len(edges)):
            for f in range(e + 1, len(edges)):
                if self.may_touch(edges[e], edges[f]):
                    yield e, f, np.array([*edges[e], *edges[f]])

    def within(self, y: Array, radius: float) -> tuple[Pairs, Pairs]:
        """All pairs that are at most `radius` apart at y: by brute force."""
        return (
            {(v, f) for v, f, k in self.vertex_faces() if ipctk.point_triangle_distance(*y[k]) <= radius**2},
            {(e, f) for e, f, k in self.edge_edges() if ipctk.edge_edge_distance(*y[k]) <= radius**2},
        )

    def collision_mesh(self) -> ipctk.CollisionMesh:
        # Without a filter: one in Python, called by ipctk's threads, may wait for ever for the interpreter's lock.
        assert self.allowed.all()
        return ipctk.CollisionMesh(self.x, self.surface.edges, self.faces)


def listed(candidates: _native.Candidates) -> tuple[Pairs, Pairs]:
    pairs = [{(int(a), int(b)) for a, b in rows} for rows in (candidates.vertex_faces, candidates.edge_edges)]
    assert [len(p) for p in pairs] == [len(candidates.vertex_faces), len(candidates.edge_edges)], "a pair comes twice"
    return pairs[0], pairs[1]


def random_soup(rng: np.random.Generator, groups: int = 3, triangles: int = 8, allowed: object = None) -> Soup:
    """Small triangles, without common nodes, in the unit cube; fans of two share an edge."""
    centres = rng.uniform(size=(groups * triangles, 1, 3))
    x = (centres + 0.2 * rng.normal(size=(groups * triangles, 4, 3))).reshape(-1, 3)
    first = 4 * np.arange(groups * triangles, dtype=np.int32)[:, None, None]
    faces = (first + np.array([[0, 1, 2], [1, 3, 2]], dtype=np.int32)).reshape(-1, 3)
    group = np.repeat(np.arange(groups, dtype=np.int32), 4 * triangles)
    if allowed is None:
        allowed = np.ones((groups, groups))
    return Soup(x, faces, group, np.asarray(allowed, dtype=np.uint8))


def boxes(offsets: list[tuple[float, float, float]], cells: tuple[int, int, int] = (2, 2, 2)) -> Soup:
    """Unit cubes at the offsets [m], each a group, all of which may touch."""
    mesh = TetMesh.box((1.0, 1.0, 1.0), cells=cells)
    n, faces = len(mesh.positions), mesh.boundary_triangles().astype(np.int32)
    return Soup(
        np.vstack([mesh.positions + offset for offset in offsets]),
        np.vstack([faces + np.int32(k * n) for k in range(len(offsets))]),
        np.repeat(np.arange(len(offsets), dtype=np.int32), n),
        np.ones((len(offsets), len(offsets)), dtype=np.uint8),
    )


def triangles(*corners: object) -> Soup:
    """Triangles without common nodes, each (3, 3) and a group, touching others only."""
    x = np.asarray(corners, dtype=float).reshape(-1, 3)
    count = len(x) // 3
    return Soup(
        x,
        np.arange(3 * count, dtype=np.int32).reshape(-1, 3),
        np.repeat(np.arange(count, dtype=np.int32), 3),
        1 - np.eye(count, dtype=np.uint8),
    )
