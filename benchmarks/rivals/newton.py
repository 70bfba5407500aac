"""The best Newton's method we know around an energy that another package evaluates.

It is qlb's ND at its best: it starts from the predictor, takes the exact Hessian, projects only where Cholesky fails,
and stops at the same tolerance. The symbolic analysis and the pattern of the matrix are made once.
"""

from __future__ import annotations

from typing import Any, Protocol

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse

from benchmarks.rivals.factor import Factor, NotPositiveDefinite, fastest_factor
from benchmarks.rivals.problem import FloatArray, Problem

MAX_ITERATIONS = 100
SDIRK = 1 - 0.5 * 2**0.5


class Energy(Protocol):
    """The elastic energy of a package. Positions are flat, (3n,), node after node."""

    def value_gradient(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Energy [J] and its gradient [N], shape (3n,)."""

    def hessian(self, x: FloatArray, project: bool) -> FloatArray:
        """The values of the Hessian [N/m] in the order of `pattern`, projected per element if asked."""

    def pattern(self) -> Any:
        """A CSR or CSC matrix with the pattern of the Hessian, which is the same at all times."""


class FreeMatrix:
    """Rows and columns of the free degrees of freedom, by one gather: values, plus the diagonal."""

    def __init__(self, pattern: Any, free: npt.NDArray[np.int64]) -> None:
        numbered = pattern.copy()
        numbered.data = np.arange(1, len(pattern.data) + 1, dtype=np.float64)
        block = sparse.csr_matrix(numbered)[free][:, free]
        block.sort_indices()
        self.take: npt.NDArray[np.int64] = block.data.astype(np.int64) - 1
        rows = np.repeat(np.arange(len(free)), np.diff(block.indptr))
        self.diagonal = np.flatnonzero(block.indices == rows)
        self.block = block

    def values(self, scale: float, hessian: FloatArray, diagonal: FloatArray) -> FloatArray:
        """scale * hessian + diag(diagonal), in the block's order."""
        data: FloatArray = scale * hessian[self.take]
        data[self.diagonal] += diagonal
        return data


class NewtonSimulation:
    """Time steps of `problem`, the energy from elsewhere."""

    def __init__(self, problem: Problem, energy: Energy, words: str, linear: str | None = None) -> None:
        self.problem, self.energy = problem, energy
        self.x = problem.positions.ravel().copy()
        self.v, self.acceleration = np.zeros_like(self.x), np.zeros_like(self.x)
        self.before: tuple[FloatArray, FloatArray] | None = None  # x and v one step ago
        self.free = np.flatnonzero(~np.repeat(problem.fixed, 3)).astype(np.int64)
        self.mass = np.repeat(problem.masses(), 3)
        self.weight = self.mass * np.tile(problem.gravity, len(problem.positions))
        self.matrix = FreeMatrix(energy.pattern(), self.free)
        h = problem.step
        values = self.matrix.values(h**2, energy.hessian(self.x, False), self.mass[self.free])
        self.matrix.block.data = values
        self.factor: Factor = fastest_factor(self.matrix.block, linear)
        self.settings = f"{words}, {self.factor.name}"
        self._force = energy.value_gradient(self.x)[1]  # at x: that of the last iterate, which is the next reference

    def positions(self) -> FloatArray:
        """Now [m], shape (n, 3)."""
        return self.x.reshape(-1, 3)

    def step(self) -> int:
        """Advance by h; the iterations that it took."""
        h, old = self.problem.step, (self.x, self.v)
        if self.problem.integrator == "BDF1":
            x, v, iterations = self._stage(h, h, self.x, self.v, self._force)
        elif self.before is None:
            x, v, iterations = self._start()
        else:
            x_b, v_b = ((4 * now - then) / 3 for now, then in zip(old, self.before, strict=True))
            x, v, iterations = self._stage(2 * h / 3, h, x_b, v_b, self._force)
        self.acceleration = (v - self.v) / h
        self.x, self.v, self.before = x, v, old
        return iterations

    def _start(self) -> tuple[FloatArray, FloatArray, int]:
        """One step of SDIRK2."""
        c, h, force = SDIRK * self.problem.step, self.problem.step, self._force
        _, v_a, first = self._stage(c, c, self.x, self.v, force)
        x_b = self.x + (1 - SDIRK) * h * v_a
        v_b = self.v + (1 - SDIRK) / SDIRK * (v_a - self.v)
        x, v, second = self._stage(c, h, x_b, v_b, force)
        return x, v, first + second

    def _stage(
        self, c: float, t: float, x_b: FloatArray, v_b: FloatArray, force: FloatArray
    ) -> tuple[FloatArray, FloatArray, int]:
        """Minimise E from the predictor for time t; `force` is the elastic gradient at x_k."""
        free, x_hat = self.free, x_b + c * v_b
        goal = self.problem.relative * np.linalg.norm(self._residual(self.x, c, x_hat, force)[free])
        x = self.x + t * self.v + 0.5 * t**2 * self.acceleration
        x[np.repeat(self.problem.fixed, 3)] = self.problem.positions[self.problem.fixed].ravel()
        E, g, self._force = self._evaluate(x, c, x_hat)
        for iteration in range(MAX_ITERATIONS):
            if np.linalg.norm(g[free]) <= goal:
                return x, (x - x_b) / c, iteration
            self._factorise(x, c)
            p = np.zeros_like(x)
            p[free] = -self.factor.solve(g[free])
            x, E, g = self._search(x, p, E, g, c, x_hat)
        raise RuntimeError(f"not converged after {MAX_ITERATIONS} iterations")

    def _search(
        self, x: FloatArray, p: FloatArray, E: float, g: FloatArray, c: float, x_hat: FloatArray
    ) -> tuple[FloatArray, float, FloatArray]:
        """Backtrack to Armijo's condition; where E is down to rounding, accept what does not raise |g|."""
        slope, alpha, residual = float(g @ p), 1.0, np.linalg.norm(g[self.free])
        for _ in range(40):
            trial = x + alpha * p
            E_new, g_new, force = self._evaluate(trial, c, x_hat)
            small = abs(E_new - E) <= 1e-11 * abs(E) and np.linalg.norm(g_new[self.free]) <= residual
            if E_new <= E + 1e-4 * alpha * slope or small:
                self._force = force
                return trial, E_new, g_new
            alpha /= 2
        raise RuntimeError("the line search failed")

    def _factorise(self, x: FloatArray, c: float) -> None:
        mass = self.mass[self.free]
        try:
            self.factor.factorise(self.matrix.values(c**2, self.energy.hessian(x, False), mass))
        except NotPositiveDefinite:
            self.factor.factorise(self.matrix.values(c**2, self.energy.hessian(x, True), mass))

    def _evaluate(self, x: FloatArray, c: float, x_hat: FloatArray) -> tuple[float, FloatArray, FloatArray]:
        elastic, force = self.energy.value_gradient(x)
        inertia = x - x_hat
        E = 0.5 * float(inertia @ (self.mass * inertia)) + c**2 * (elastic - float(self.weight @ x))
        return E, self._residual(x, c, x_hat, force), force

    def _residual(self, x: FloatArray, c: float, x_hat: FloatArray, force: FloatArray) -> FloatArray:
        return np.asarray(self.mass * (x - x_hat) + c**2 * (force - self.weight))
