"""SimKit (Benchekroun, MIT): its vectorised element energies and deformation Jacobian; ours is Newton around them.

Its own `stable_neo_hookean_hessian_x` makes a block-diagonal matrix in a Python loop over the elements and multiplies
sparse matrices; here the same blocks are summed into a fixed pattern. Its `spsolve` (SuperLU) gives way to Cholesky.
"""

from __future__ import annotations

from typing import Any

import numpy as np
import numpy.typing as npt
import scipy.sparse as sparse
from simkit.deformation_jacobian import deformation_jacobian
from simkit.energies import stable_neo_hookean as snh
from simkit.psd_project import psd_project
from simkit.volume import volume

from benchmarks.rivals.newton import NewtonSimulation
from benchmarks.rivals.problem import FloatArray, Problem
from benchmarks.rivals.scatter import Scatter


class SimKitEnergy:
    """J^T (vol H_F) J with its J and H_F, element by element."""

    def __init__(self, problem: Problem) -> None:
        X, T = problem.positions, problem.tets
        count = len(T)
        self._J = sparse.csr_matrix(deformation_jacobian(X, T))
        self._JT = sparse.csr_matrix(self._J.T)
        self._volumes = np.asarray(volume(X, T)).reshape(-1, 1, 1)
        self._mu, self._lam = np.full((count, 1), problem.mu), np.full((count, 1), problem.lam)
        self._B = _element_blocks(self._J, T)
        self._BT = np.ascontiguousarray(self._B.transpose(0, 2, 1))
        self._scatter = Scatter(T, len(X))

    def value_gradient(self, x: FloatArray) -> tuple[float, FloatArray]:
        """The deformation gradients are shared."""
        F = self._deformation(x)
        energy = self._volumes[:, 0] * snh.stable_neo_hookean_energy_element_F(F, self._mu, self._lam)
        stress = self._volumes * snh.stable_neo_hookean_gradient_element_F(F, self._mu, self._lam)
        return float(energy.sum()), np.asarray(self._JT @ stress.ravel())

    def hessian(self, x: FloatArray, project: bool) -> FloatArray:
        """Its values; SciPy's products keep the pattern and the order."""
        blocks = self._volumes * snh.stable_neo_hookean_hessian_element_F(self._deformation(x), self._mu, self._lam)
        if project:
            blocks = psd_project(blocks)
        return self._scatter.sum(self._BT @ (blocks @ self._B))

    def pattern(self) -> Any:
        """That of the sum of the elements' matrices."""
        return self._scatter.pattern()

    def _deformation(self, x: FloatArray) -> FloatArray:
        return np.asarray(self._J @ x).reshape(-1, 3, 3)


def _element_blocks(J: Any, tets: npt.NDArray[np.int64]) -> FloatArray:
    """The 9 rows of J that belong to each element, at its 12 columns, shape (m, 9, 12)."""
    columns = np.repeat((3 * tets[:, :, None] + np.arange(3)).reshape(len(tets), 1, 12), 9, axis=1)
    rows = np.repeat(np.arange(9 * len(tets)).reshape(-1, 9, 1), 12, axis=2)
    return np.asarray(J[rows.ravel(), columns.ravel()]).reshape(-1, 9, 12)


def build(problem: Problem, options: dict[str, str]) -> NewtonSimulation:
    """Set it up."""
    assert problem.log, "its density is eq. 14"
    return NewtonSimulation(problem, SimKitEnergy(problem), "its element kernels, our Newton", options.get("linear"))
