"""PBA toolkit (Ton-That, MIT): its compiled energy, gradient and Hessian assembly; ours is Newton's method around it.

Its wheels hold neither CHOLMOD nor MKL, only Eigen's simplicial LDL^T, so the factor comes from elsewhere too.
"""

from __future__ import annotations

from functools import partial
from typing import Any

import numpy as np
import pbatoolkit
import scipy.sparse as sparse

from benchmarks.rivals.newton import NewtonSimulation
from benchmarks.rivals.problem import FloatArray, Problem

fem = pbatoolkit.pbat.fem


class PbaEnergy:
    """`hyper_elastic_potential` on linear tets with one quadrature point."""

    def __init__(self, problem: Problem) -> None:
        element = fem.Element.Tetrahedron
        X = np.asfortranarray(problem.positions.T)
        E = np.asfortranarray(problem.tets.T)
        weights = fem.mesh_quadrature_weights(E, X, element, order=1, quadrature_order=1)
        constants = {"mug": np.full(weights.size, problem.mu), "lambdag": np.full(weights.size, problem.lam)}
        self._rest = np.ravel(X, order="F")
        self._potential = partial(
            fem.hyper_elastic_potential,
            E=E,
            n_nodes=X.shape[1],
            eg=np.ravel(fem.mesh_quadrature_elements(E, weights)),
            wg=np.ravel(weights),
            GNeg=fem.shape_function_gradients(E, X, element=element, order=1, quadrature_order=1),
            **constants,
            energy=fem.HyperElasticEnergy.StableNeoHookean,
            element=element,
            order=1,
            dims=3,
        )
        self._none = fem.HyperElasticSpdCorrection.NoCorrection
        self._projection = fem.HyperElasticSpdCorrection.Projection
        self._flags = fem.ElementElasticityComputationFlags

    def value_gradient(self, x: FloatArray) -> tuple[float, FloatArray]:
        """In one call."""
        flags = self._flags.Potential | self._flags.Gradient
        energy, gradient, _ = self._potential(x=x, flags=flags, spd_correction=self._none)
        return float(energy), gradient

    def hessian(self, x: FloatArray, project: bool) -> FloatArray:
        """Its values; the pattern never changes."""
        data: FloatArray = self._hessian(x, self._projection if project else self._none).data
        return data

    def pattern(self) -> Any:
        """At rest."""
        return sparse.csr_matrix(self._hessian(self._rest, self._none))

    def _hessian(self, x: FloatArray, correction: Any) -> Any:
        return self._potential(x=x, flags=self._flags.Hessian, spd_correction=correction)[2]


def build(problem: Problem, options: dict[str, str]) -> NewtonSimulation:
    """Set it up."""
    assert not problem.log, "its density is that without the logarithm"
    return NewtonSimulation(problem, PbaEnergy(problem), "its assembly, our Newton", options.get("linear"))
