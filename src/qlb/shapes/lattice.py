"""The body-centred cubic lattice and its tetrahedra."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from qlb.arrays import BoolArray, FloatArray, LongArray


@dataclass(frozen=True)
class Lattice:
    """Corners and centres of a block of cubes.

    Every tet has two corners and two centres: the edge between the centres of two neighbouring cubes, and one edge of
    the face between those. Its edges are long (spacing) between points of a kind, and short (sqrt 3 / 2 spacing)
    between a corner and a centre.

    Attributes:
        positions: [m], shape (n, 3); corners first.
        tets: shape (m, 4): two centres, then two corners; positively oriented.
        centre: which points are centres of cubes, shape (n,).
        odd: parity of the sum of the indices of each point among its kind, shape (n,). A long edge joins an even point
            to an odd one, so that points of one kind and parity are never neighbours.
    """

    positions: FloatArray
    tets: LongArray
    centre: BoolArray
    odd: BoolArray

    @staticmethod
    def around(low: FloatArray, high: FloatArray, spacing: float, shift: FloatArray) -> Lattice:
        """The lattice over a box, with one cube to spare on each side; a corner is put at the middle of the box.

        `shift` moves that corner, by numbers of spacings between 0 and 1.
        """
        reach = np.ceil(0.5 * (high - low) / spacing).astype(np.int64) + 1
        origin = 0.5 * (low + high) - spacing * (reach - shift)
        cubes = 2 * reach
        corners, centres = _grid(cubes + 1), _grid(cubes)
        positions = origin + spacing * np.concatenate([corners, centres + 0.5])
        odd = np.concatenate([corners, centres]).sum(axis=1) % 2 == 1
        centre = np.arange(len(positions)) >= len(corners)
        return Lattice(positions, _tets(cubes), centre, odd)


def _grid(counts: LongArray) -> LongArray:
    """All index triples below `counts`, the last index running fastest."""
    return np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)


def _tets(cubes: LongArray) -> LongArray:
    """Four tets around each face between two cubes, shape (m, 4)."""
    corner_strides = np.array([(cubes[1] + 1) * (cubes[2] + 1), cubes[2] + 1, 1])
    cube_strides = np.array([cubes[1] * cubes[2], cubes[2], 1])
    corners = int(np.prod(cubes + 1))
    unit = np.eye(3, dtype=np.int64)
    tets = []
    for axis in range(3):
        u, v, w = unit[axis], unit[(axis + 1) % 3], unit[(axis + 2) % 3]
        cube = _grid(cubes - u)
        first = corners + cube @ cube_strides
        second = first + u @ cube_strides
        ring = [(cube + u + offset) @ corner_strides for offset in (0 * v, v, v + w, w)]
        tets += [np.stack([first, second, ring[k], ring[(k + 1) % 4]], axis=-1) for k in range(4)]
    return np.concatenate(tets)
