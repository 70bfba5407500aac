"""Every way in which a solve can end."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Reason, Tolerance
from qlb.solvers import SOLVERS
from tests.solvers.problems import (
    NoPrediction,
    WrongGradient,
    bar_system,
    fixed_state,
    make_solver,
    problem_of,
    swinging,
)
from tests.support import TIGHT, make_system, small_bar


@pytest.fixture(params=SOLVERS)
def solver(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.mark.parametrize("relative", [1e-2, 1e-6, 1e-10])
def test_converged_relative(solver: str, relative: float) -> None:
    system = bar_system()
    problem = problem_of(system, swinging(system))
    result = make_solver(solver, system, Tolerance(relative=relative)).minimise(problem)
    assert result.reason is Reason.CONVERGED_RELATIVE
    assert result.residual <= relative * result.reference
    assert result.rows[-2].residual > relative * result.reference
    assert problem.residual(problem.value_gradient(result.positions)[1]) == result.residual


def test_converged_absolute(solver: str) -> None:
    system = bar_system()
    problem = problem_of(system, swinging(system))
    goal = 1e-3 * problem.residual(problem.value_gradient(problem.start)[1])
    result = make_solver(solver, system, Tolerance(relative=1e-12, absolute=goal)).minimise(problem)
    assert result.reason is Reason.CONVERGED_ABSOLUTE
    assert result.residual <= goal < result.rows[-2].residual


def test_converged_scaled(solver: str) -> None:
    system = bar_system()
    problem = problem_of(system, swinging(system))
    result = make_solver(solver, system, Tolerance(relative=1e-12, scaled=1e-5)).minimise(problem)
    assert result.reason is Reason.CONVERGED_ABSOLUTE
    assert result.residual <= 1e-5 * problem.residual_scale < result.rows[-2].residual


def test_max_iterations(solver: str) -> None:
    system = bar_system()
    result = make_solver(solver, system, TIGHT, max_iterations=2).minimise(problem_of(system, swinging(system)))
    assert result.reason is Reason.MAX_ITERATIONS
    assert result.iterations == 2
    assert not result.reason.converged


def test_a_solve_that_needs_all_its_iterations_has_converged(solver: str) -> None:
    system = bar_system()
    free = make_solver(solver, system).minimise(problem_of(system, swinging(system)))
    capped = make_solver(solver, system, max_iterations=free.iterations)
    assert capped.minimise(problem_of(system, swinging(system))).reason is Reason.CONVERGED_RELATIVE


def test_line_search_failed(solver: str) -> None:
    system = bar_system()
    problem = problem_of(system, swinging(system), kind=WrongGradient)
    result = make_solver(solver, system, initial_guess="previous").minimise(problem)
    assert result.reason is Reason.LINE_SEARCH_FAILED
    np.testing.assert_array_equal(result.positions, problem.start)
    assert result.rows[-1].step_length == 0.0


def test_not_finite_when_the_energy_overflows(solver: str) -> None:
    system = bar_system()
    state = swinging(system)
    state.velocities[:] = 1e200
    result = make_solver(solver, system).minimise(problem_of(system, state))
    assert result.reason is Reason.NOT_FINITE
    assert result.iterations == 0


def test_at_rest_there_is_nothing_to_do(solver: str) -> None:
    mesh = small_bar()
    system = make_system(mesh, gravity=(0.0, 0.0, 0.0))
    result = make_solver(solver, system).minimise(problem_of(system, fixed_state(mesh)))
    assert result.reason.converged
    assert (result.iterations, result.factorizations) == (0, 0)


def test_a_tolerance_of_zero_is_pursued_down_to_rounding(solver: str) -> None:
    system = bar_system()
    tolerance = Tolerance(relative=0.0, absolute=0.0, scaled=0.0)
    result = make_solver(solver, system, tolerance, max_iterations=50).minimise(problem_of(system, swinging(system)))
    assert result.residual <= 1e-12 * result.reference


@pytest.mark.parametrize("guess", ["previous", "predictor"])
def test_relative_reference_is_the_residual_at_the_last_state(solver: str, guess: str) -> None:
    system = bar_system()
    problem = problem_of(system, swinging(system))
    result = make_solver(solver, system, initial_guess=guess).minimise(problem)
    assert result.reference == problem.residual(problem.value_gradient(problem.start)[1])
    if guess == "predictor":
        assert result.rows[0].residual != result.reference


def test_a_predictor_that_is_not_finite_is_not_used(solver: str) -> None:
    system = bar_system()
    problem = problem_of(system, swinging(system), kind=NoPrediction)
    result = make_solver(solver, system, initial_guess="predictor").minimise(problem)
    assert result.reason is Reason.CONVERGED_RELATIVE
    assert result.rows[0].residual == result.reference


def test_rows_tell_the_story_of_the_solve(solver: str) -> None:
    system = bar_system()
    problem = problem_of(system, swinging(system))
    method = make_solver(solver, system)
    result = method.minimise(problem)
    assert [row.iteration for row in result.rows] == list(range(result.iterations + 1))
    assert result.rows[0].step_length == 0.0
    assert all(0 < row.step_length <= 1 for row in result.rows[1:])
    assert result.rows[-1].residual == result.residual
    assert result.rows[-1].energy == problem.value_gradient(result.positions)[0]
    assert result.factorizations == sum(row.factorizations for row in result.rows) == method.factor.count


def test_energy_falls_at_every_iteration(solver: str) -> None:
    system = bar_system(poisson=0.49)
    state = swinging(system)
    state.velocities[:] *= 5
    result = make_solver(solver, system).minimise(problem_of(system, state))
    energies = np.array([row.energy for row in result.rows])
    assert len(energies) > 3
    assert (np.diff(energies) <= 1e-11 * np.abs(energies[1:])).all()
