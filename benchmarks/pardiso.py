"""MKL PARDISO as a rival of our factors, where the `mkl` package is installed; nothing of it is needed otherwise."""

from __future__ import annotations

import ctypes
import os
import sys
from pathlib import Path

import numpy as np
import scipy.sparse
from numpy.typing import NDArray

from qlb import _native
from qlb.arrays import FloatArray

SYMMETRIC_POSITIVE_DEFINITE = 2
ANALYSE, FACTORISE, SOLVE = 11, 22, 33


def find_mkl() -> Path | None:
    """The MKL of this Python environment."""
    return next(iter(sorted((Path(sys.prefix) / "lib").glob("libmkl_rt.so*"))), None)


def upper_triangle(matrix: _native.BlockMatrix, pattern: _native.BlockPattern, free: NDArray[np.bool_]) -> object:
    """The free part as compressed rows of its upper triangle."""
    begin = np.asarray(pattern.column_begin)
    i, j = np.asarray(pattern.rows), np.repeat(np.arange(pattern.nodes), np.diff(begin))
    shape = matrix.values.shape
    row = np.broadcast_to(3 * i[:, None, None] + np.arange(3)[:, None], shape).ravel()
    column = np.broadcast_to(3 * j[:, None, None] + np.arange(3), shape).ravel()
    place = np.cumsum(free) - 1
    keep = (row >= column) & free[row] & free[column]
    entries = (matrix.values.ravel()[keep], (place[column[keep]], place[row[keep]]))
    upper = scipy.sparse.csr_matrix(entries, shape=(free.sum(), free.sum()))
    upper.sort_indices()
    return upper


class Pardiso:
    """Analyses at once, with its own METIS; then factorises and solves the same matrix over and over."""

    def __init__(self, library: Path, upper: object) -> None:
        os.environ.setdefault("MKL_THREADING_LAYER", "SEQUENTIAL")
        self._mkl = ctypes.CDLL(str(library))
        self._handle = np.zeros(64, dtype=np.int64)
        self._settings = np.zeros(64, dtype=np.int32)
        self._settings[[0, 1, 34]] = 1, 2, 1  # not the defaults; METIS; indices from zero
        self._values: FloatArray = upper.data  # type: ignore[attr-defined]
        self._begin = upper.indptr.astype(np.int32)  # type: ignore[attr-defined]
        self._column = upper.indices.astype(np.int32)  # type: ignore[attr-defined]
        self._right = np.ones(len(self._begin) - 1)
        self._solution = np.zeros_like(self._right)
        self._call(ANALYSE)

    def factorise(self) -> None:
        """Numeric factorisation."""
        self._call(FACTORISE)

    def solve(self) -> None:
        """One right-hand side."""
        self._call(SOLVE)

    def _call(self, phase: int) -> None:
        def number(value: int) -> object:
            return ctypes.byref(ctypes.c_int(value))

        def array(values: NDArray[np.generic]) -> object:
            return values.ctypes.data_as(ctypes.c_void_p)

        error = ctypes.c_int(0)
        self._mkl.pardiso(
            array(self._handle),
            *(number(k) for k in (1, 1, SYMMETRIC_POSITIVE_DEFINITE, phase, len(self._right))),
            *(array(part) for part in (self._values, self._begin, self._column)),
            None,
            number(1),
            array(self._settings),
            number(0),
            array(self._right),
            array(self._solution),
            ctypes.byref(error),
        )
        if error.value:
            raise RuntimeError(f"PARDISO failed in phase {phase} (error {error.value})")
