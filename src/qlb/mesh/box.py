"""A box of Kuhn tetrahedra."""

from __future__ import annotations

from itertools import permutations
from math import prod

import numpy as np

from qlb.arrays import FloatArray, IntArray
from qlb.errors import InputError
from qlb.mesh.geometry import signed_volumes

MOST_TETS = 2e7
"""More fit no workstation: a million take some 4 GiB."""


def kuhn_box(size: tuple[float, float, float], cells: tuple[int, int, int]) -> tuple[FloatArray, IntArray]:
    """Positions [m] (n, 3) and tets (m, 4) of a box from the origin to `size` [m], `cells` cells along each axis.

    Each cell is cut into the six Kuhn tetrahedra (Kuhn 1960), one for each order of the axes in which a path along
    edges can climb from a corner to the opposite one. Neighbouring cells are mirror images, which makes the mesh
    conforming and symmetric.

    Raises:
        InputError: a size that is not > 0, or a cell count that is not a whole number >= 1.
    """
    if len(size) != 3 or not all(np.isfinite(s) and s > 0 for s in size):
        raise InputError(f"box size {tuple(size)} is out of range: three lengths > 0 m")
    # Some whole numbers are too large for floats.
    wanted = np.array([c if c == np.inf else min(c, MOST_TETS) for c in cells], dtype=np.float64)
    if len(wanted) != 3 or not all(np.isfinite(wanted) & (np.floor(wanted) == wanted) & (wanted >= 1)):
        raise InputError(f"box cells {tuple(cells)} are out of range: three whole numbers >= 1")

    counts = [int(c) for c in wanted]
    if 6 * prod(counts) > MOST_TETS:
        raise InputError(f"box cells {tuple(cells)} make too many tets, must be at most {MOST_TETS:.3g}")
    axes = [np.linspace(0.0, length, count + 1) for length, count in zip(size, counts, strict=True)]
    positions = np.stack(np.meshgrid(*axes, indexing="ij"), axis=-1).reshape(-1, 3)
    strides = np.array([(counts[1] + 1) * (counts[2] + 1), counts[2] + 1, 1])
    cell = np.stack(np.meshgrid(*map(np.arange, counts), indexing="ij"), axis=-1).reshape(-1, 3)
    mirrored = cell % 2 == 1

    def corner(offset: np.ndarray) -> np.ndarray:
        return np.asarray((cell + np.where(mirrored, 1 - offset, offset)) @ strides)

    paths = [
        np.cumsum(np.vstack([np.zeros(3, int), np.eye(3, dtype=int)[list(order)]]), axis=0)
        for order in permutations(range(3))
    ]
    tets = (
        np.stack([np.stack([corner(offset) for offset in path], axis=-1) for path in paths], axis=1)
        .reshape(-1, 4)
        .astype(np.int32)
    )
    negative = signed_volumes(positions, tets) < 0
    tets[negative, 2:] = tets[negative, :1:-1]
    return positions, tets
