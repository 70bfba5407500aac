"""Newton's direction, convergence and projections, and what it tries after a failure."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Tolerance
from qlb.solvers.line_search import Point
from tests.solvers.problems import bar_system, crushed, make_solver, problem_of, swinging
from tests.support import Array, dense

PROJECTIONS = ["always", "on-demand", "never"]


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_direction_is_that_of_newton(projection: str) -> None:
    # p = -H^-1 g over the free degrees of freedom, H projected only where asked for
    system = bar_system()
    problem = problem_of(system, swinging(system))
    point = Point.at(problem, problem.start + 0.05 * problem.start**2 * (system.held.fixed == 0))
    p, slope = make_solver("ND", system, projection=projection).direction(problem, point)
    free = system.held.fixed.ravel() == 0
    H = dense(problem.hessian(point.x, project=projection == "always"), system.pattern)[np.ix_(free, free)]
    expected = np.zeros(p.size)
    expected[free] = -np.linalg.solve(H, point.gradient.ravel()[free])
    np.testing.assert_allclose(p.ravel(), expected, rtol=0, atol=1e-11 * np.abs(expected).max())
    assert slope == pytest.approx(np.sum(p * point.gradient))
    assert slope < 0


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("start", ["swinging", "crushed"])
def test_every_projection_converges(projection: str, start: str, rng: np.random.Generator) -> None:
    system = bar_system()
    state = swinging(system) if start == "swinging" else crushed(system, rng)
    result = make_solver("ND", system, projection=projection).minimise(problem_of(system, state))
    assert result.reason.converged


@pytest.mark.parametrize("projection", ["always", "on-demand"])
def test_one_factor_for_each_iteration_of_a_tame_solve(projection: str) -> None:
    system = bar_system()
    result = make_solver("ND", system, projection=projection).minimise(problem_of(system, swinging(system)))
    assert [row.factorizations for row in result.rows] == [0] + result.iterations * [1]


def test_on_demand_projects_where_cholesky_fails_and_only_there(rng: np.random.Generator) -> None:
    system = bar_system()
    solver = make_solver("ND", system, projection="on-demand")
    problem = problem_of(system, crushed(system, rng), h=1.0)
    solver.direction(problem, Point.at(problem, problem.start))
    assert (solver.factor.count, solver.factor.projected) == (2, True)
    tame = problem_of(system, swinging(system))
    solver.direction(tame, Point.at(tame, tame.start))
    assert (solver.factor.count, solver.factor.projected) == (3, False)


def test_never_shifts_the_diagonal_until_cholesky_succeeds(rng: np.random.Generator) -> None:
    system = bar_system()
    solver = make_solver("ND", system, projection="never")
    problem = problem_of(system, crushed(system, rng), h=1.0)
    point = Point.at(problem, problem.start)
    p, slope = solver.direction(problem, point)
    assert slope < 0
    assert not solver.factor.projected
    # The shift is 10^-10 of the largest entry, times 10 with every try: (H + shift I) p = -g tells which.
    free = system.held.fixed.ravel() == 0
    matrix = problem.hessian(point.x, project=False)
    H = dense(matrix, system.pattern)[np.ix_(free, free)]
    shift = np.abs(matrix.values).max() * 10.0 ** (-10 + solver.factor.count - 2)
    assert np.linalg.eigvalsh(H)[0] + shift > 0 > np.linalg.eigvalsh(H)[0] + 0.1 * shift
    residual = (H + shift * np.eye(len(H))) @ p.ravel()[free] + point.gradient.ravel()[free]
    np.testing.assert_allclose(residual, 0.0, atol=1e-8 * np.abs(point.gradient).max())


def test_convergence_is_quadratic_near_the_solution() -> None:
    system = bar_system()
    tight = Tolerance(relative=1e-12)
    result = make_solver("ND", system, tight, projection="never").minimise(problem_of(system, swinging(system)))
    residuals = np.array([row.residual for row in result.rows]) / result.reference
    # Each of the last steps that rounding does not yet limit squares the residual, up to a constant.
    near = residuals[(residuals < 1e-1) & (residuals > 1e-13)]
    assert len(near) >= 2
    exponents = np.log(near[1:]) / np.log(near[:-1])
    assert exponents.max() >= 1.7, f"residuals {near}"


def test_the_linear_problem_takes_one_iteration() -> None:
    # Hardly any deformation: the gradient is linear to some 1e-7.
    system = bar_system(gravity=(0.0, 0.0, 0.0))
    state = swinging(system)
    state.velocities[:] *= 1e-6
    result = make_solver("ND", system, Tolerance(relative=1e-5)).minimise(problem_of(system, state))
    assert result.iterations == 1


def test_after_a_failed_search_the_projected_hessian_is_tried_once() -> None:
    system = bar_system()
    solver = make_solver("ND", system, projection="on-demand")
    problem = problem_of(system, swinging(system))
    point = Point.at(problem, problem.start)
    solver.begin_solve(problem, Point.at(problem, problem.start), 0.0)
    solver.direction(problem, point)
    assert not solver.factor.projected
    assert solver.recover(problem, point)
    solver.direction(problem, point)
    assert solver.factor.projected
    assert not solver.recover(problem, point)


def test_an_accepted_step_goes_back_to_the_exact_hessian() -> None:
    system = bar_system()
    solver = make_solver("ND", system, projection="on-demand")
    problem = problem_of(system, swinging(system))
    point = Point.at(problem, problem.start)
    solver.direction(problem, point)
    solver.recover(problem, point)
    solver.accept(problem, point, point, limited=False)
    solver.direction(problem, point)
    assert not solver.factor.projected


@pytest.mark.parametrize("projection", ["always", "never"])
def test_nothing_is_left_to_try_with_one_kind_of_hessian(projection: str) -> None:
    system = bar_system()
    solver = make_solver("ND", system, projection=projection)
    problem = problem_of(system, swinging(system))
    point = Point.at(problem, problem.start)
    solver.direction(problem, point)
    assert not solver.recover(problem, point)


def test_a_hessian_with_no_numbers_is_an_error() -> None:
    system = bar_system()
    problem = problem_of(system, swinging(system))
    bad: Array = problem.start.copy()
    bad[-1] = np.nan
    solver = make_solver("ND", system)
    with pytest.raises(FloatingPointError, match="not finite"):
        solver.factor.update(problem, bad, "always")
