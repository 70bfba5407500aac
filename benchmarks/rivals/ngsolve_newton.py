"""NGSolve (Schoeberl, LGPL-2.1): its symbolic energy, which it differentiates and compiles to C++; ours is Newton.

Its own Newton's method would do as well; ours stops at the same residual and takes the faster Cholesky there is.
"""

from __future__ import annotations

from typing import Any

import ngsolve
import numpy as np
import scipy.sparse as sparse
from netgen.meshing import Element3D, MeshPoint, Pnt
from netgen.meshing import Mesh as NetgenMesh

from benchmarks.rivals.newton import NewtonSimulation
from benchmarks.rivals.problem import FloatArray, Problem


class NgsolveEnergy:
    """`Variation` of either density on `VectorH1` of order 1. NGSolve numbers component after component."""

    def __init__(self, problem: Problem) -> None:
        space = ngsolve.VectorH1(_mesh(problem), order=1)
        self._rest = problem.positions.T.ravel()
        psi = _density(space.TrialFunction(), problem)
        try:
            compiled, self.words = psi.Compile(realcompile=True, wait=True), "its assembly compiled to C++, our Newton"
        except Exception:  # it has no type of its own where there is no C++ compiler
            compiled, self.words = psi.Compile(), "its assembly (no C++ compiler found), our Newton"
        self._form = ngsolve.BilinearForm(space)
        self._form += ngsolve.Variation(compiled * ngsolve.dx(bonus_intorder=-2))
        self._u = ngsolve.GridFunction(space).vec
        self._gradient = self._u.CreateVector()
        self._order: Any = None

    def value_gradient(self, x: FloatArray) -> tuple[float, FloatArray]:
        """Energy and its variation."""
        self._displace(x)
        self._form.Apply(self._u, self._gradient)
        return float(self._form.Energy(self._u)), self._gradient.FV().NumPy().reshape(3, -1).T.ravel()

    def hessian(self, x: FloatArray, project: bool) -> FloatArray:
        """Its values, in the order of `pattern`; it has no projection of elements, and none is needed in this scene."""
        if project:
            raise RuntimeError("NGSolve does not project element matrices, and Cholesky failed on the exact one")
        self._displace(x)
        self._form.AssembleLinearization(self._u)
        values: FloatArray = self._form.mat.CSR()[0].NumPy()
        return values if self._order is None else values[self._order]

    def pattern(self) -> Any:
        """Renumbered node after node."""
        values = self.hessian(self._rest.reshape(3, -1).T.ravel(), False)
        _, columns, starts = (part.NumPy().astype(np.int64) for part in self._form.mat.CSR())
        nodes = len(self._rest) // 3
        new = 3 * (np.arange(3 * nodes) % nodes) + np.arange(3 * nodes) // nodes
        rows = np.repeat(np.arange(3 * nodes), np.diff(starts))
        numbers = np.arange(1, len(values) + 1, dtype=np.float64)
        renumbered = sparse.csr_matrix((numbers, (new[rows], new[columns])), shape=(3 * nodes,) * 2)
        self._order = renumbered.data.astype(np.int64) - 1
        return renumbered

    def _displace(self, x: FloatArray) -> None:
        self._u.FV().NumPy()[:] = x.reshape(-1, 3).T.ravel() - self._rest


def _density(u: Any, problem: Problem) -> Any:
    F = ngsolve.Id(3) + ngsolve.Grad(u)
    square, J, mu, lam = ngsolve.InnerProduct(F, F), ngsolve.Det(F), problem.mu, problem.lam
    if problem.log:
        return mu / 2 * (square - 3 - ngsolve.log(square + 1)) + lam / 2 * (J - 1 - 0.75 * mu / lam) ** 2
    return mu / 2 * (square - 3) + lam / 2 * (J - 1 - mu / lam) ** 2


def _mesh(problem: Problem) -> Any:
    mesh = NetgenMesh(dim=3)
    nodes = [mesh.Add(MeshPoint(Pnt(*map(float, x)))) for x in problem.positions]
    for tet in problem.tets:
        mesh.Add(Element3D(1, [nodes[i] for i in tet]))
    return ngsolve.Mesh(mesh)


def build(problem: Problem, options: dict[str, str]) -> NewtonSimulation:
    """Set it up."""
    energy = NgsolveEnergy(problem)
    return NewtonSimulation(problem, energy, energy.words, options.get("linear"))
