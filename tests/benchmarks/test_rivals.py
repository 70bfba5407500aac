"""The comparison with other packages: it runs with whatever is installed, qlb at least."""

from __future__ import annotations

from pathlib import Path
from typing import Any

import numpy as np
import pytest
from benchmarks.rivals import qlb_itself, runner
from benchmarks.rivals.newton import NewtonSimulation
from benchmarks.rivals.problem import FloatArray, Problem
from benchmarks.rivals.registry import ACCURATE, BEST_ND, RIVALS, Rival
from benchmarks.rivals.scatter import Scatter

import qlb

CELLS = (4, 2, 2)
STEPS = 3


class NumpyEnergy:
    """The energy that an adapter would bring, from qlb's density at single deformation gradients."""

    def __init__(self, problem: Problem) -> None:
        self.material, self.tets = qlb_itself.material(problem), problem.tets
        edges = problem.positions[problem.tets]
        inverse = np.linalg.inv((edges[:, 1:] - edges[:, :1]).transpose(0, 2, 1))
        self.shape_gradients = np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)  # (m, 4, 3)
        self.volumes = problem.volumes()
        self.scatter = Scatter(problem.tets, len(problem.positions))

    def value_gradient(self, x: FloatArray) -> tuple[float, FloatArray]:
        psi, P, _ = self._evaluate(x, False)
        gradient = np.zeros((len(x) // 3, 3))
        np.add.at(gradient, self.tets, np.einsum("e,eij,enj->eni", self.volumes, P, self.shape_gradients))
        return float(psi @ self.volumes), gradient.ravel()

    def hessian(self, x: FloatArray, project: bool) -> FloatArray:
        C = self._evaluate(x, project)[2].reshape(-1, 3, 3, 3, 3)
        G = self.shape_gradients
        local = np.einsum("e,eijkl,enj,eml->enimk", self.volumes, C, G, G)
        return self.scatter.sum(local)

    def pattern(self) -> Any:
        return self.scatter.pattern()

    def _evaluate(self, x: FloatArray, project: bool) -> tuple[FloatArray, FloatArray, FloatArray]:
        F = np.einsum("eni,enj->eij", x.reshape(-1, 3)[self.tets], self.shape_gradients)
        return self.material.evaluate(F, project=project)


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2"])
@pytest.mark.parametrize("log", [True, False])
def test_newton_around_an_energy_agrees_with_qlb(log: bool, integrator: str) -> None:
    problem = runner.bar(CELLS, log=log, integrator=integrator)
    ours = qlb_itself.build(problem, BEST_ND)
    theirs = NewtonSimulation(problem, NumpyEnergy(problem), "NumPy", "superlu")
    iterations = [(ours.step(), theirs.step()) for _ in range(STEPS)]
    assert runner.distance(theirs.positions(), ours.positions(), problem) < 1e-8
    assert [a for a, _ in iterations] == [b for _, b in iterations]


@pytest.mark.slow
@pytest.mark.parametrize("log", [True, False])
def test_every_installed_package_gives_the_same_answer(log: bool) -> None:
    settings = runner.Settings(steps=STEPS, repeats=1)
    ready, _ = runner.chosen([], settings, runner.installed(settings.python))
    rivals = [rival for rival in ready if rival.log == log]
    outcomes = runner.measure(runner.bar(CELLS, log=log, integrator="BDF1"), rivals, settings)
    assert [o.rival.name for o in outcomes][:2] == ["qlb QLA", "qlb ND"]
    assert [o.failure for o in outcomes] == [""] * len(outcomes)
    assert max(o.error for o in outcomes) < ACCURATE
    assert all(o.cpu > 0 and o.iterations > 0 for o in outcomes)


@pytest.mark.slow
def test_what_fails_is_reported() -> None:
    broken = Rival("broken", "qlb_itself", True, options={"solver": "no such solver"})
    settings = runner.Settings(steps=1, repeats=1)
    (outcome,) = runner.measure(runner.bar(CELLS, log=True, integrator="BDF1"), [broken], settings)
    assert "no such solver" in outcome.failure
    assert "failed" in runner.rows_of(96, [outcome], 1)[0][2]


def test_packages_that_are_missing_are_named() -> None:
    ready, missing = runner.chosen([], runner.Settings(), {})
    assert all(rival.is_qlb for rival in ready)
    assert {rival.name for rival in missing} == {rival.name for rival in RIVALS if not rival.is_qlb}
    ready, missing = runner.chosen(["simkit"], runner.Settings(), {"simkit": "1"})
    assert [rival.name for rival in ready if not rival.is_qlb] == ["simkit"]
    assert missing == []


def test_rivals_that_cannot_integrate_by_bdf2_are_left_out() -> None:
    ready, missing = runner.chosen([], runner.Settings(integrator="BDF2"), {})
    assert not {rival.name for rival in ready + missing} & {"pbatoolkit VBD", "newton VBD"}


def test_distance_is_relative_to_the_longest_side() -> None:
    problem = runner.bar(CELLS, log=True, integrator="BDF1")
    moved = problem.positions * 2
    moved[3] += (0.0, 3.0, 4.0)
    double = Problem(**{**problem.__dict__, "positions": problem.positions * 2})
    assert runner.distance(moved, double.positions, double) == pytest.approx(2.5)


def test_a_problem_survives_its_file(tmp_path: Path) -> None:
    problem = runner.bar(CELLS, log=False, integrator="BDF2")
    problem.save(tmp_path / "problem.npz")
    read = Problem.load(tmp_path / "problem.npz")
    assert (read.log, read.integrator, read.mu, read.relative) == (False, "BDF2", problem.mu, 1e-6)
    np.testing.assert_array_equal(read.positions, problem.positions)
    assert read.masses().sum() == pytest.approx(1000 * 0.25**2)


def test_the_built_in_density_has_the_problems_constants() -> None:
    problem = runner.bar(CELLS, log=True, integrator="BDF1")
    material = qlb_itself.material(problem)
    assert isinstance(material, qlb.StableNeoHookean)
    assert material.kernel_parameters() == pytest.approx((problem.mu, problem.lam))
