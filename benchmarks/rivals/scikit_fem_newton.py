"""scikit-fem (Gustafsson, McBain, BSD-3): its bases, forms and local matrices; ours is Newton's method around them.

Forms on the scalar P1 basis, one for each pair of components: on the vector basis most products would be with zeros.
The local matrices are summed into a fixed pattern, without the sort that `assemble` does in every call.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import skfem

from benchmarks.rivals.newton import NewtonSimulation
from benchmarks.rivals.problem import FloatArray, Problem
from benchmarks.rivals.scatter import Scatter

PAIRS = [(a, b) for a in range(3) for b in range(a, 3)]


def force(v: Any, w: Any) -> Any:
    """P_a . grad v."""
    return sum(w[f"P{j}"] * v.grad[j] for j in range(3))


def stiffness(u: Any, v: Any, w: Any) -> Any:
    """grad v . C_ab grad u."""
    return sum(v.grad[j] * sum(w[f"C{j}{k}"] * u.grad[k] for k in range(3)) for j in range(3))


class ScikitFemEnergy:
    """Eq. 14 of Smith, de Goes, Kim 2018 in NumPy, at the one quadrature point of a tet."""

    def __init__(self, problem: Problem) -> None:
        mesh = skfem.MeshTet(*(np.ascontiguousarray(a.T) for a in (problem.positions, problem.tets)))
        self._force, self._stiffness = skfem.LinearForm(force), skfem.BilinearForm(stiffness)
        self._basis = skfem.Basis(mesh, skfem.ElementTetP1(), intorder=0)
        self._mu, self._lam, self._count = problem.mu, problem.lam, 3 * len(problem.positions)
        self._scatter = Scatter(problem.tets, len(problem.positions))

    def value_gradient(self, x: FloatArray) -> tuple[float, FloatArray]:
        """The deformation gradients are shared."""
        F, cofactor, J, square, alpha = self._state(x)
        mu, lam = self._mu, self._lam
        psi = mu / 2 * (square - 3) + lam / 2 * (J - alpha) ** 2 - mu / 2 * np.log(square + 1)
        P = mu * (1 - 1 / (square + 1)) * F + lam * (J - alpha) * cofactor
        gradient = np.empty((self._count // 3, 3))
        for a in range(3):
            gradient[:, a] = self._force.assemble(self._basis, **{f"P{j}": P[a, j] for j in range(3)})
        return float((psi * self._basis.dx).sum()), gradient.ravel()

    def hessian(self, x: FloatArray, project: bool) -> FloatArray:
        """Its values, block by block of the upper half."""
        C = self._moduli(x)
        if project:
            C = _projected(C)
        local = np.empty((C.shape[2], 4, 3, 4, 3))
        for a, b in PAIRS:
            fields = {f"C{j}{k}": C[3 * a + j, 3 * b + k] for j in range(3) for k in range(3)}
            block = self._stiffness.elemental(self._basis, **fields).tolocal()  # (m, node of u, node of v)
            local[:, :, b, :, a] = block
            local[:, :, a, :, b] = block.transpose(0, 2, 1)
        return self._scatter.sum(local)

    def pattern(self) -> Any:
        """That of the sum of the local matrices."""
        return self._scatter.pattern()

    def _state(self, x: FloatArray) -> tuple[FloatArray, FloatArray, FloatArray, FloatArray, float]:
        F = np.stack([np.asarray(self._basis.interpolate(x[a::3].copy()).grad) for a in range(3)])
        cofactor = np.stack([np.cross(F[(a + 1) % 3], F[(a + 2) % 3], axis=0) for a in range(3)])
        J = (F[0] * cofactor[0]).sum(axis=0)
        return F, cofactor, J, np.einsum("ij...,ij...", F, F), 1 + 0.75 * self._mu / self._lam

    def _moduli(self, x: FloatArray) -> FloatArray:
        """d2 psi/dF2, shape (9, 9, m, 1), F row by row."""
        F, cofactor, J, square, alpha = self._state(x)
        f, c = F.reshape(9, *J.shape), cofactor.reshape(9, *J.shape)
        C = 2 * self._mu / (square + 1) ** 2 * f[:, None] * f[None] + self._lam * c[:, None] * c[None]
        C[np.arange(9), np.arange(9)] += self._mu * (1 - 1 / (square + 1))
        pressure = self._lam * (J - alpha)
        for a in range(3):
            for j in range(3):
                row, up, down = 3 * a + j, (a + 1) % 3, (a + 2) % 3
                right, left = (j + 1) % 3, (j + 2) % 3
                C[row, 3 * up + right] += pressure * F[down, left]
                C[row, 3 * up + left] -= pressure * F[down, right]
                C[row, 3 * down + left] += pressure * F[up, right]
                C[row, 3 * down + right] -= pressure * F[up, left]
        return np.asarray(C)


def _projected(C: FloatArray) -> FloatArray:
    values, vectors = np.linalg.eigh(np.moveaxis(C[..., 0], 2, 0))
    positive = (vectors * np.maximum(values, 0)[:, None]) @ vectors.transpose(0, 2, 1)
    return np.ascontiguousarray(np.moveaxis(positive, 0, 2))[..., None]


def build(problem: Problem, options: dict[str, str]) -> NewtonSimulation:
    """Set it up."""
    assert problem.log, "the forms are those of eq. 14"
    return NewtonSimulation(problem, ScikitFemEnergy(problem), "its assembly, our Newton", options.get("linear"))
