"""Sums of stencil values into node vectors and into the blocks of the Hessian, in a fixed order."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from qlb import _native
from qlb.arrays import FloatArray, LongArray
from qlb.errors import InputError

Nodes = npt.NDArray[np.integer]


class BlockFinder:
    """Where the block of each pair of nodes lies in a pattern."""

    def __init__(self, pattern: _native.BlockPattern) -> None:
        self._nodes = pattern.nodes
        counts = np.diff(pattern.column_begin)
        columns = np.repeat(np.arange(pattern.nodes, dtype=np.int64), counts)
        self._keys = columns * pattern.nodes + pattern.rows  # ascending

    def find(self, rows: Nodes, columns: Nodes) -> LongArray:
        """Indices of the blocks (row, column), row >= column. Raises `InputError` for one the pattern has not."""
        wanted = columns.astype(np.int64) * self._nodes + rows
        found = np.minimum(np.searchsorted(self._keys, wanted), len(self._keys) - 1)
        missing = self._keys[found] != wanted
        if missing.any():
            k = int(np.argmax(missing))
            raise InputError(f"nodes {columns[k]} and {rows[k]} are neither in one tet nor among the couplings")
        return found


class StencilScatter:
    """Adds what belongs to stencils (k, w) to arrays over nodes and over the blocks of a pattern."""

    def __init__(self, stencils: Nodes, finder: BlockFinder) -> None:
        self._nodes = stencils.ravel()
        width = stencils.shape[1]
        self._first, self._second = np.divmod(np.arange(width**2), width)
        rows, columns = stencils[:, self._first], stencils[:, self._second]
        self._lower = rows >= columns  # (k, w^2); both orders of a pair of one node
        blocks = finder.find(rows[self._lower], columns[self._lower])
        self._order = np.argsort(blocks, kind="stable")
        self._targets, self._begin = np.unique(blocks[self._order], return_index=True)

    @np.errstate(invalid="ignore")
    def add_vectors(self, values: FloatArray, target: FloatArray) -> None:
        """Add `values` (k, w, 3) to `target` (n, 3)."""
        flat = values.reshape(-1, 3)
        for axis in range(3):
            target[:, axis] += np.bincount(self._nodes, weights=flat[:, axis], minlength=len(target))

    @np.errstate(invalid="ignore")
    def add_blocks(self, values: FloatArray, scale: float, matrix: _native.BlockMatrix) -> None:
        """Add `scale` times the symmetric `values` (k, 3 w, 3 w) to `matrix`."""
        if len(self._targets) == 0:
            return
        k, width = len(values), values.shape[1] // 3
        pairs = values.reshape(k, width, 3, width, 3).transpose(0, 1, 3, 2, 4).reshape(k, width**2, 3, 3)
        summed = np.add.reduceat(pairs[self._lower][self._order], self._begin, axis=0)
        matrix.values[self._targets] += scale * summed


def positive_semidefinite(matrices: FloatArray) -> FloatArray:
    """The nearest positive semidefinite matrices in the Frobenius norm, shape (k, s, s); what is so already is kept.

    NaN where any of them is not finite.
    """
    if not np.isfinite(matrices).all():
        return np.full_like(matrices, np.nan)
    values, vectors = np.linalg.eigh(matrices)
    negative = np.minimum(values, 0.0)
    return np.asarray(matrices - np.einsum("kia,ka,kja->kij", vectors, negative, vectors))
