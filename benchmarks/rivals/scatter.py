"""The sum of the elements' matrices into a fixed pattern: one pass, where SciPy sorts on every call."""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse

from benchmarks.rivals.problem import FloatArray


class Scatter:
    """For matrices (m, 12, 12) of tets, rows and columns node after node, each with its 3 components."""

    def __init__(self, tets: npt.NDArray[np.int64], nodes: int) -> None:
        self._count = 3 * nodes
        dofs = (3 * tets[:, :, None] + np.arange(3)).reshape(len(tets), 12)
        keys = dofs[:, :, None] * self._count + dofs[:, None, :]
        unique, self._slots = np.unique(keys.ravel(), return_inverse=True)
        self._indices = unique % self._count
        self._indptr = np.searchsorted(unique // self._count, np.arange(self._count + 1))

    def sum(self, local: FloatArray) -> FloatArray:
        """The values of the sum, in the pattern's order."""
        return np.asarray(np.bincount(self._slots, local.ravel(), len(self._indices)), dtype=np.float64)

    def pattern(self) -> Any:
        """CSR, sorted, the values ones."""
        return sparse.csr_matrix((np.ones(len(self._indices)), self._indices, self._indptr), shape=(self._count,) * 2)
