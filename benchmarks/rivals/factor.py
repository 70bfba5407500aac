"""The Cholesky factorisations that a Python user can get from PyPI, under one interface."""

from __future__ import annotations

from collections.abc import Callable
from importlib.util import find_spec
from time import perf_counter
from typing import Any, Protocol

import numpy as np
import scipy.sparse as sparse

from benchmarks.rivals.problem import FloatArray


class NotPositiveDefinite(Exception):
    """The matrix has no Cholesky factor."""


class Factor(Protocol):
    """A Cholesky factor of matrices of one pattern, which is analysed when it is made."""

    name: str

    def factorise(self, data: FloatArray) -> None:
        """Factor the matrix with these values in the pattern's order.

        Raises:
            NotPositiveDefinite: it has no factor.
        """

    def solve(self, b: FloatArray) -> FloatArray:
        """A^-1 b."""


class Pardiso:
    """Intel MKL PARDISO through pypardiso, METIS order, upper triangle only."""

    name = "PARDISO (MKL)"

    def __init__(self, pattern: Any) -> None:
        from pypardiso import PyPardisoSolver

        rows = np.repeat(np.arange(pattern.shape[0]), np.diff(pattern.indptr))
        self._take = np.flatnonzero(pattern.indices >= rows)
        indptr = np.concatenate([[0], np.cumsum(np.bincount(rows[self._take], minlength=pattern.shape[0]))])
        values = pattern.data[self._take]
        upper = (values, pattern.indices[self._take].astype(np.int32), indptr.astype(np.int32))
        self._matrix = sparse.csr_matrix(upper, shape=pattern.shape)
        self._solver, self._zero = PyPardisoSolver(mtype=2), np.zeros(pattern.shape[0])
        for index, value in {1: 1, 2: 3, 8: 0}.items():  # not the defaults, nested dissection, no refinement
            self._solver.set_iparm(index, value)
        self._call(11, self._zero)

    def factorise(self, data: FloatArray) -> None:
        """Numerical factorisation."""
        from pypardiso.pardiso_wrapper import PyPardisoError

        np.take(data, self._take, out=self._matrix.data)
        try:
            self._call(22, self._zero)
        except PyPardisoError as error:
            raise NotPositiveDefinite from error

    def solve(self, b: FloatArray) -> FloatArray:
        """Forward and backward substitution."""
        return self._call(33, b)

    def _call(self, phase: int, b: FloatArray) -> FloatArray:
        self._solver.set_phase(phase)
        x: FloatArray = self._solver._call_pardiso(self._matrix, b)
        return x


class Cholmod:
    """CHOLMOD, supernodal, in the best order that it finds, through scikit-sparse."""

    name = "CHOLMOD"

    def __init__(self, pattern: Any) -> None:
        from sksparse.cholmod import analyze

        self._matrix = sparse.csc_matrix((pattern.data, pattern.indices, pattern.indptr), shape=pattern.shape)
        self._factor = analyze(self._matrix, mode="supernodal", ordering_method="best")

    def factorise(self, data: FloatArray) -> None:
        """Numerical factorisation."""
        from sksparse.cholmod import CholmodNotPositiveDefiniteError

        self._matrix.data[:] = data
        try:
            self._factor.cholesky_inplace(self._matrix)
        except CholmodNotPositiveDefiniteError as error:
            raise NotPositiveDefinite from error

    def solve(self, b: FloatArray) -> FloatArray:
        """Forward and backward substitution."""
        x: FloatArray = self._factor(b)
        return x


class SuperLu:
    """SciPy's LU, which is what there is without further packages. It does not see indefiniteness."""

    name = "SuperLU (SciPy)"

    def __init__(self, pattern: Any) -> None:
        self._matrix = sparse.csc_matrix((pattern.data, pattern.indices, pattern.indptr), shape=pattern.shape)
        self._solve: Callable[[FloatArray], FloatArray] | None = None

    def factorise(self, data: FloatArray) -> None:
        """Analyse and factorise."""
        from scipy.sparse.linalg import splu

        self._matrix.data[:] = data
        options = {"SymmetricMode": True}
        self._solve = splu(self._matrix, permc_spec="MMD_AT_PLUS_A", diag_pivot_thresh=0.0, options=options).solve

    def solve(self, b: FloatArray) -> FloatArray:
        """Forward and backward substitution."""
        assert self._solve is not None
        return self._solve(b)


KINDS: dict[str, tuple[str, type[Any]]] = {
    "pardiso": ("pypardiso", Pardiso),
    "cholmod": ("sksparse", Cholmod),
    "superlu": ("scipy", SuperLu),
}


def fastest_factor(pattern: Any, kind: str | None = None) -> Factor:
    """A factor for symmetric matrices of this pattern (CSR, sorted): of those installed, the fastest on this one.

    The values of `pattern` must be positive definite. SuperLU only takes part where nothing else is installed.
    """
    names = [kind] if kind else [name for name, (module, _) in KINDS.items() if find_spec(module)]
    if len(names) > 1:
        names = [name for name in names if name != "superlu"]
    factors: list[Factor] = [KINDS[name][1](pattern.copy()) for name in names]
    return min(factors, key=lambda factor: _seconds(factor, pattern.data)) if len(factors) > 1 else factors[0]


def _seconds(factor: Factor, data: FloatArray) -> float:
    best = float("inf")
    for _ in range(3):
        start = perf_counter()
        factor.factorise(data)
        factor.solve(np.ones(len(data))[: _size(factor)])
        best = min(best, perf_counter() - start)
    return best


def _size(factor: Any) -> int:
    return int(factor._matrix.shape[0])
