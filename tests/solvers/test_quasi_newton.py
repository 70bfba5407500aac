"""When QLF and QLB factorise, which direction they take, and which pairs they keep."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Simulation, SolverSettings, StableNeoHookean
from qlb.solvers.line_search import Point
from tests.solvers.problems import bar_system, make_solver, problem_of, swinging
from tests.support import finish, left_end, small_bar

INTEGRATORS = ["BDF1", "BDF2", "SDIRK2", "quasistatic"]
SOFT = StableNeoHookean(young=2e4, poisson=0.49)


def bar(solver: str, integrator: str, **arguments: object) -> Simulation:
    mesh = small_bar((4, 2, 2))
    gravity = (lambda t: np.array([0.0, -100.0 * t, 0.0])) if integrator == "quasistatic" else (0.0, -9.81, 0.0)
    defaults = {"material": StableNeoHookean(young=5e4, poisson=0.4), "gravity": gravity, "threads": 1}
    simulation = Simulation(mesh, solver=solver, integrator=integrator, **(defaults | arguments))  # type: ignore[arg-type]
    simulation.pin(left_end(mesh))
    return simulation


@pytest.mark.parametrize(("integrator", "distinct_c"), [("BDF1", 1), ("BDF2", 2), ("SDIRK2", 1), ("quasistatic", 1)])
def test_qlf_factorises_once_for_each_c_in_the_whole_run(integrator: str, distinct_c: int) -> None:
    simulation = bar("QLF", integrator)
    finish(simulation, 8)
    assert simulation.solver.factor.count == distinct_c


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_qlb_factorises_once_a_step(integrator: str) -> None:
    simulation = bar("QLB", integrator)
    assert [result.factorizations for result in simulation.run(8)] == 8 * [1]


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_nd_factorises_once_an_iteration(integrator: str) -> None:
    for result in bar("ND", integrator).run(8):
        assert result.factorizations == result.iterations


def test_both_stages_of_sdirk2_share_the_factor_of_qlb() -> None:
    for result in bar("QLB", "SDIRK2").run(4):
        assert [solve.factorizations for solve in result.solves] == [1, 0]
        assert all(solve.iterations > 0 for solve in result.solves)


@pytest.mark.parametrize("solver", ["QLF", "QLB", "QLA"])
def test_the_first_direction_is_that_of_the_factor(solver: str) -> None:
    system = bar_system()
    problem = problem_of(system, swinging(system))
    exact = {"projection": "always", "precision": "float64"}
    method, newton = make_solver(solver, system, **exact), make_solver("ND", system)
    point = Point.at(problem, problem.start)
    method.begin_step()
    method.begin_solve(problem, point, 0.0)
    p, slope = method.direction(problem, point)
    expected, expected_slope = newton.direction(problem, point)
    np.testing.assert_allclose(p, expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    assert slope == pytest.approx(expected_slope, rel=1e-12)


def test_pairs_are_dropped_before_each_solve() -> None:
    system = bar_system()
    method = make_solver("QLB", system)
    problem = problem_of(system, swinging(system))
    method.minimise(problem)
    assert method.history.pairs > 0  # type: ignore[attr-defined]
    method.begin_solve(problem, Point.at(problem, problem.start), 0.0)
    assert method.history.pairs == 0  # type: ignore[attr-defined]


def test_a_failed_search_drops_the_pairs_once() -> None:
    system = bar_system()
    method = make_solver("QLB", system)
    problem = problem_of(system, swinging(system))
    method.minimise(problem)
    point = Point.at(problem, problem.start)
    assert method.recover(problem, point)
    assert method.history.pairs == 0  # type: ignore[attr-defined]
    assert not method.recover(problem, point)


def test_no_more_pairs_are_kept_than_the_window_holds() -> None:
    system = bar_system()
    for window in (1, 3):
        method = make_solver("QLB", system, window=window)
        result = method.minimise(problem_of(system, swinging(system)))
        assert result.iterations > window
        assert method.history.pairs <= window  # type: ignore[attr-defined]


def test_more_pairs_need_fewer_iterations() -> None:
    # A soft bar that has fallen far from where its factor was taken: 2186, 1258 and 1022 iterations when written.
    counts = []
    for window in (1, 3, 10):
        settings = SolverSettings(window=window, max_iterations=2000)
        simulation = bar("QLF", "BDF1", material=SOFT, step=0.02, solver_settings=settings)
        counts.append(sum(result.iterations for result in simulation.run(20)))
    assert counts[0] > 1.3 * counts[1]
    assert counts[1] > 1.1 * counts[2]


def test_qlf_saves_where_it_took_its_factor() -> None:
    simulation = bar("QLF", "BDF2")
    assert simulation.solver.save() == {}
    finish(simulation, 3)
    saved = simulation.solver.save()
    assert list(saved) == ["start"]
    np.testing.assert_array_equal(saved["start"], simulation.mesh.positions)


@pytest.mark.parametrize("solver", ["ND", "QLB"])
def test_the_others_have_nothing_to_save(solver: str) -> None:
    simulation = bar(solver, "BDF2")
    finish(simulation, 3)
    assert simulation.solver.save() == {}
