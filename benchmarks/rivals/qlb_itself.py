"""qlb under the same interface; its ND with a tight tolerance gives the reference that all are held against."""

from __future__ import annotations

import numpy as np
import sympy

import qlb
from benchmarks.rivals.problem import FloatArray, Problem
from qlb.materials import Material
from qlb.solvers import SolverSettings, Tolerance


class QlbSimulation:
    """A problem under one of qlb's solvers."""

    def __init__(self, problem: Problem, solver: str, settings: SolverSettings) -> None:
        mesh = qlb.TetMesh(problem.positions, problem.tets)
        self.simulation = qlb.Simulation(
            mesh,
            material=material(problem),
            integrator=problem.integrator,
            solver=solver,
            step=problem.step,
            gravity=tuple(problem.gravity),
            tolerance=Tolerance(relative=problem.relative, scaled=1e-16),
            solver_settings=settings,
        )
        self.simulation.pin(np.flatnonzero(problem.fixed))
        _ = self.simulation.solver  # ordering and symbolic analysis
        self.settings = "its built-in density" if problem.log else "the density interpreted"

    def step(self) -> int:
        """Advance by h; the iterations that it took."""
        return self.simulation.advance().iterations

    def positions(self) -> FloatArray:
        """Now [m], shape (n, 3)."""
        return self.simulation.state.positions


def material(problem: Problem) -> Material:
    """The problem's density: the built-in one, or without its logarithm through `qlb.SymbolicMaterial`."""
    if problem.log:
        return _built_in(problem)
    I1, _, J = qlb.SymbolicMaterial.invariants
    mu, lam = sympy.symbols("mu lam", positive=True)
    psi = mu / 2 * (I1 - 3) + lam / 2 * (J - 1 - mu / lam) ** 2
    parameters = {"mu": problem.mu, "lam": problem.lam}
    return qlb.SymbolicMaterial(psi=psi, parameters=parameters, density=problem.density)


def _built_in(problem: Problem) -> qlb.StableNeoHookean:
    """Young's modulus and Poisson's ratio back from mu = 4/3 mu_Lame, lam = lambda_Lame + 5/6 mu_Lame."""
    mu = 0.75 * problem.mu
    lam = problem.lam - 5 / 6 * mu
    young, poisson = mu * (3 * lam + 2 * mu) / (lam + mu), lam / (2 * (lam + mu))
    return qlb.StableNeoHookean(young=young, poisson=poisson, density=problem.density)


def build(problem: Problem, options: dict[str, str]) -> QlbSimulation:
    """Set it up; the options are `solver` and that solver's settings."""
    rest = dict(options)
    return QlbSimulation(problem, rest.pop("solver", "QLA"), SolverSettings.model_validate(rest))
