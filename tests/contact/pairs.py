"""Pairs of primitives that contact tests evaluate one by one, or thousands at a time."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass

import ipctk
import numpy as np
from numpy.typing import NDArray

from qlb import _native

Array = NDArray[np.float64]
Pairs = NDArray[np.int32]

NO_PAIRS: Pairs = np.zeros((0, 2), dtype=np.int32)
NO_PLANES = np.zeros((0, 4))
VERTEX_FACE, EDGE_EDGE = 0, 1
# Six nodes a pair. The first four are the pair's; the others complete the faces of the vertex, or of the edges.
FACES = {VERTEX_FACE: [[0, 4, 5], [1, 2, 3]], EDGE_EDGE: [[0, 1, 4], [2, 3, 5]]}
REST = np.array(
    [[[0.0, 0, 1], [0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 1], [0, 1.2, 1]],
     [[0.0, 0, 0], [1, 0, 0], [0, 0, 1], [0, 1.5, 1], [0, 1, 0], [1, 0, 1]]]
)  # fmt: skip


@dataclass(frozen=True)
class Scene:
    """`count` pairs of one kind, far from meaning anything to each other; x has shape (6 count, 3)."""

    surface: _native.ContactSurface
    vertex_faces: Pairs
    edge_edges: Pairs

    @classmethod
    def of(cls, kind: int, count: int = 1) -> Scene:
        first = 6 * np.arange(count)
        faces = (np.array(FACES[kind])[None] + first[:, None, None]).reshape(-1, 3).astype(np.int32)
        group = np.tile(np.array([0, 1, 1, 1, 0, 0] if kind == VERTEX_FACE else [0, 0, 1, 1, 0, 1]), count)
        surface = _native.ContactSurface(
            np.tile(REST[kind], (count, 1)), faces, group.astype(np.int32), np.ones((2, 2), dtype=np.uint8)
        )
        if kind == VERTEX_FACE:
            pairs = np.stack([first, 2 * np.arange(count) + 1], axis=1)
            return cls(surface, pairs.astype(np.int32), NO_PAIRS)
        edges = np.asarray(surface.edges)
        key = {(int(a), int(b)): e for e, (a, b) in enumerate(edges)}
        pairs = np.array([[key[f, f + 1], key[f + 2, f + 3]] for f in first.tolist()])
        return cls(surface, NO_PAIRS, pairs.astype(np.int32))

    def evaluate(
        self, barrier: _native.Barrier, x: Array, scale: float = 1.0, sign: NDArray[np.int8] | None = None
    ) -> tuple[_native.ContactSet, Array]:
        gradient = np.zeros_like(x)
        none = np.zeros((0, 2), dtype=np.uint8)
        found = barrier.evaluate(x, self.vertex_faces, self.edge_edges, NO_PLANES, none, scale, gradient, sign)
        return found, gradient


def six_nodes(four: Array) -> Array:
    """The nodes of a scene whose pairs have these four nodes (..., 4, 3); the other two are of no account."""
    far = np.broadcast_to(np.array([[50.0, 0, 0], [0, 50, 0]]), (*four.shape[:-2], 2, 3))
    return np.ascontiguousarray(np.concatenate([four, far], axis=-2).reshape(-1, 3))


def closest_type(kind: int, x: Array) -> str:
    """IPC Toolkit's name of the closest points of the pair x (6, 3), as P_E0 or EA_EB1."""
    find = ipctk.point_triangle_distance_type if kind == VERTEX_FACE else ipctk.edge_edge_distance_type
    return str(find(*x[:4])).rsplit(".", 1)[1]


def draw(kind: int, accept: Callable[[Array], bool], rng: np.random.Generator, spread: float = 1.0) -> Array:
    """Random nodes (6, 3) of a pair that `accept` takes."""
    while True:
        four = rng.normal(size=(4, 3))
        if kind == EDGE_EDGE and spread != 1.0:  # nearly parallel
            four[3] = four[2] + (four[1] - four[0]) + spread * rng.normal(size=3)
        x = six_nodes(four)
        if accept(x):
            return x


def squared_distances(kind: int, x: Array) -> Array:
    """IPC Toolkit's squared distances of the pairs x (6 count, 3)."""
    distance = ipctk.point_triangle_distance if kind == VERTEX_FACE else ipctk.edge_edge_distance
    return np.array([distance(*pair[:4]) for pair in x.reshape(-1, 6, 3)])


def dense_hessian(barrier: _native.Barrier, x: Array, found: _native.ContactSet, *, project: bool) -> Array:
    """(3n, 3n), put together from the blocks."""
    full = np.zeros((len(x), 3, len(x), 3))
    for nodes, block in zip(found.nodes, barrier.hessian_blocks(x, found, project), strict=True):
        blocks = block.reshape(4, 3, 4, 3)
        for i in range(4):
            for j in range(4):
                full[nodes[i], :, nodes[j], :] += blocks[i, :, j, :]
    return full.reshape(x.size, x.size)
