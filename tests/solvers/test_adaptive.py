"""QLA: when its factor is kept, turned and made anew, and that it gets through what defeats the others."""

from __future__ import annotations

from collections.abc import Callable
from math import inf

import numpy as np
import pytest

from qlb import Damping, Rotation, Simulation, SolverSettings, StableNeoHookean, State, StVenantKirchhoff, TetMesh
from qlb.solvers.adaptive import PATIENCE, QLA, stretch_weight
from qlb.solvers.line_search import Point
from tests.solvers.problems import bar_system, crushed, make_solver, problem_of, swinging
from tests.support import Array, dense, left_end, make_system, random_rotation, right_end, small_bar


def bar(cells: tuple[int, int, int] = (8, 2, 2), **arguments: object) -> Simulation:
    mesh = TetMesh.box((1.0, 0.25, 0.25), cells=cells)
    defaults: dict[str, object] = {"material": StableNeoHookean(), "solver": "QLA", "threads": 1}
    simulation = Simulation(mesh, **(defaults | arguments))  # type: ignore[arg-type]
    simulation.pin(left_end(mesh))
    return simulation


def with_dear_factor(simulation: Simulation) -> Simulation:
    """As if the mesh were fine: a factor costs as much as ten iterations."""
    assert isinstance(simulation.solver, QLA)
    simulation.solver.kappa = 10.0
    return simulation


def adaptive(system: object, **settings: object) -> QLA:
    solver = make_solver("QLA", system, **settings)  # type: ignore[arg-type]
    assert isinstance(solver, QLA)
    return solver


def test_a_factor_lives_over_several_steps() -> None:
    results = list(with_dear_factor(bar()).run(60))
    factors = sum(result.factorizations for result in results)
    assert factors <= 60 / 3
    assert all(result.converged for result in results)


def test_both_stages_of_sdirk2_use_one_factor() -> None:
    results = list(with_dear_factor(bar(integrator="SDIRK2")).run(20))
    assert sum(result.factorizations for result in results) <= 20 / 2


@pytest.mark.parametrize(
    ("settings", "at_least"), [({"keep_factor": False}, 1.0), ({"carry_factor": False}, 0.0), ({}, 0.0)]
)
def test_without_the_kept_factor_there_is_one_a_solve(settings: dict[str, object], at_least: float) -> None:
    results = list(bar(solver_settings=SolverSettings(**settings)).run(20))  # type: ignore[arg-type]
    factors = [solve.factorizations for result in results[1:] for solve in result.solves]
    assert np.mean(factors) >= at_least


def test_carrying_the_factor_saves_factors_and_iterations() -> None:
    work = []
    for turned in (True, False):
        simulation = bar(solver_settings=SolverSettings(carry_factor=turned))
        simulation.move(right_end(simulation.mesh), Rotation((1.0, 0.0, 0.0), (1.0, 0.125, 0.125), rate=1.0))
        results = list(with_dear_factor(simulation).run(40))
        work.append([sum(r.iterations for r in results), sum(r.factorizations for r in results)])
    assert work[0][0] < work[1][0]
    assert work[0][1] < work[1][1]


def test_the_carried_factor_of_a_free_body_is_that_of_the_turned_body(rng: np.random.Generator) -> None:
    # H(Q x) = Q H(x) Q^T for an objective energy and an isotropic mass.
    system = make_system(small_bar((3, 1, 1)), gravity=(0.0, 0.0, 0.0))
    x = system.mesh.positions + 0.01 * rng.normal(size=system.mesh.positions.shape)
    Q = random_rotation(rng)
    problem, turned = (problem_of(system, State(0.0, y, np.zeros_like(y)), h=0.01) for y in (x, x @ Q.T))
    solver = adaptive(system)
    solver.begin_solve(problem, Point.at(problem, x), 0.0)
    point = Point.at(turned, x @ Q.T)
    solver.begin_solve(turned, point, 0.0)
    b, found = rng.normal(size=x.shape), np.empty_like(x)
    solver.inverse.apply(b, found)
    exact = np.linalg.solve(dense(turned.hessian(point.x, project=False), system.pattern), b.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(found, exact, rtol=0, atol=1e-5 * np.abs(exact).max())
    assert solver.factor.count == 1


@pytest.mark.parametrize("weight", [0.0, 0.4, 1.0])
def test_nodal_maps_and_least_volume_ratio_are_those_of_numpy(weight: float, rng: np.random.Generator) -> None:
    system = make_system(small_bar((3, 2, 1)))
    mesh = system.mesh
    x, reference = (mesh.positions + 0.03 * rng.normal(size=mesh.positions.shape) for _ in range(2))
    now, then = (_deformation_gradients(mesh, y) for y in (x, reference))
    sums = np.zeros((2, len(x), 3, 3))
    for corner in mesh.tets.T:
        for total, F in zip(sums, (now, then), strict=True):
            np.add.at(total, corner, mesh.volumes()[:, None, None] * F @ then.transpose(0, 2, 1))
    U, _, Vt = np.linalg.svd(sums[0])
    U[:, :, 2] *= np.linalg.det(U @ Vt)[:, None]
    expected = (1 - weight) * U @ Vt + weight * sums[0] @ np.linalg.inv(sums[1])
    found = np.empty((len(x), 3, 3))
    system.geometry.nodal_maps(x, x, weight, found)  # what it keeps of a reference must not outlive it
    np.testing.assert_allclose(found, np.broadcast_to(np.eye(3), found.shape), atol=1e-12)
    system.geometry.nodal_maps(x, reference, weight, found)
    np.testing.assert_allclose(found, expected, atol=1e-12)
    assert system.geometry.least_J(x) == pytest.approx(np.linalg.det(now).min(), rel=1e-12)


def test_stretch_counts_where_a_material_is_close_to_incompressible() -> None:
    def weight(poisson: float) -> float:
        return stretch_weight(make_system(small_bar(), StableNeoHookean(poisson=poisson)).incompressibility)

    assert weight(0.0) == weight(0.4) == 0.0
    assert weight(0.49) == pytest.approx(0.41, abs=0.01)
    assert 0.49 < weight(0.499) < 0.5


def _deformation_gradients(mesh: TetMesh, x: Array) -> Array:
    rest, now = (y[mesh.tets[:, 1:]] - y[mesh.tets[:, :1]] for y in (mesh.positions, x))
    return np.asarray(np.linalg.solve(rest, now).transpose(0, 2, 1))


@pytest.mark.parametrize("inverted", [False, True])
def test_an_inverted_or_broken_state_is_seen(inverted: bool, rng: np.random.Generator) -> None:
    system = bar_system()
    state = crushed(system, rng) if inverted else swinging(system)
    assert system.is_inverted(state.positions) == inverted
    broken = state.positions.copy()
    broken[3, 1] = np.nan
    assert system.is_inverted(broken)


def test_a_predictor_that_inverts_tets_is_not_taken(rng: np.random.Generator) -> None:
    system = bar_system()
    state = State(0.0, system.mesh.positions, 20.0 * rng.normal(size=system.mesh.positions.shape))
    problem = problem_of(system, state)
    assert system.is_inverted(problem.predictor)
    assert adaptive(system)._initial_point(problem).x is problem.start


def test_where_the_exact_hessian_is_not_definite_the_factor_is_of_the_projected_one(rng: np.random.Generator) -> None:
    system = bar_system()
    problem = problem_of(system, crushed(system, rng))
    solver = adaptive(system)
    solver.begin_solve(problem, Point.at(problem, problem.start), 0.0)
    assert solver.factor.projected
    assert solver.factor.count == 2


def test_a_solve_dearer_than_the_mean_calls_for_a_new_factor() -> None:
    solver = adaptive(bar_system())
    solver.kappa = 10.0
    for iterations, stale in ((4, False), (4, False), (6, False), (9, True)):  # means: 14, 9, 8, 33/4
        solver._iterations, solver._marked_at = iterations, 0
        solver.end_solve()
        assert solver._stale == stale


def test_the_iterations_to_come_are_those_of_the_mean_contraction() -> None:
    system = bar_system()
    solver = adaptive(system)
    point = Point(np.zeros((1, 3)), 0.0, np.zeros((1, 3)), 1e-3, np.zeros((1, 3)))
    solver._goal, solver._marked, solver._marked_at = 1e-6, 1.0, 2
    solver._iterations = 2 + PATIENCE - 1
    assert solver._needed(point) == 0.0
    solver._iterations = 2 + 6  # 1e-3 in six: another six
    assert solver._needed(point) == pytest.approx(6.0)
    solver._marked = 1e-4
    assert solver._needed(point) == inf


HARD: dict[str, Callable[[], Simulation]] = {
    "nearly incompressible": lambda: bar(material=StableNeoHookean(poisson=0.499)),
    "large steps, BDF2": lambda: bar(step=5e-2),
    "large steps, BDF1": lambda: bar(step=0.1, integrator="BDF1"),
    "fast twist": lambda: _moved(Rotation((1.0, 0.0, 0.0), (1.0, 0.125, 0.125), rate=4.0)),
    "quasistatic": lambda: bar(
        integrator="quasistatic", step=0.05, gravity=lambda t: np.array([0.0, -9.81 * min(t, 1.0), 0.0])
    ),
    "squashed": lambda: _moved(_squash, StableNeoHookean(poisson=0.45), integrator="quasistatic", step=0.05),
    "squashed StVK": lambda: _moved(_squash, StVenantKirchhoff(poisson=0.45), integrator="quasistatic", step=0.05),
    "flattened": lambda: _started(lambda x, rng: np.column_stack([x[:, 0], np.full(len(x), 0.125), x[:, 2]])),
    "random": lambda: _started(lambda x, rng: rng.uniform(0.0, 1.0, x.shape)),
}


@pytest.mark.slow
@pytest.mark.parametrize("case", HARD.values(), ids=HARD)
def test_no_step_fails_in_hard_cases(case: Callable[[], Simulation]) -> None:
    results = list(case().run(20))
    assert all(result.converged for result in results)


def _squash(anchors: Array, time: float) -> Array:
    return anchors - np.array([0.6 * min(time, 1.0), 0.0, 0.0])


def _moved(motion: Callable[[Array, float], Array], material: object = None, **arguments: object) -> Simulation:
    simulation = bar(material=material or StableNeoHookean(), gravity=(0.0, 0.0, 0.0), **arguments)
    simulation.move(right_end(simulation.mesh), motion)
    return simulation


def _started(placed: Callable[[Array, np.random.Generator], Array]) -> Simulation:
    simulation = bar(gravity=(0.0, 0.0, 0.0))
    x = placed(simulation.mesh.positions, np.random.default_rng(1))
    held = left_end(simulation.mesh)
    x[held] = simulation.mesh.positions[held]
    simulation.restore(State(0.0, x, np.zeros_like(x)), 0, {})
    return simulation


def slender(**settings: object) -> Simulation:
    """A quasistatic thread, too ill-conditioned for float32."""
    mesh = TetMesh.box((100.0, 1.0, 1.0), cells=(200, 2, 2))
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(young=1e9, poisson=0.49),
        integrator="quasistatic",
        step=0.2,
        gravity=lambda t: np.array([0.0, -0.01 * t, 0.0]),
        solver_settings=SolverSettings(**settings),  # type: ignore[arg-type]
        threads=1,
    )
    simulation.pin(left_end(mesh))
    return simulation


def test_precision_goes_over_to_float64_where_float32_does_not_do_and_says_so() -> None:
    auto, double = slender(), slender(precision="float64")
    iterations = [sum(result.iterations for result in simulation.run(3)) for simulation in (auto, double)]
    assert isinstance(auto.solver, QLA)
    assert auto.solver.factor.raised
    assert iterations[0] <= 3 * iterations[1]  # 500 and more in float32 throughout


def test_a_run_that_has_gone_over_to_float64_resumes_to_the_same_bits() -> None:
    whole, part, rest = slender(), slender(), slender()
    for _ in whole.run(4):
        pass
    for _ in part.run(2):
        pass
    rest.restore(part.state, part.steps_done, part.solver.save())
    assert isinstance(rest.solver, QLA)
    assert rest.solver.factor.raised
    for _ in rest.run(2):
        pass
    np.testing.assert_array_equal(rest.state.positions, whole.state.positions)


@pytest.mark.parametrize(
    ("arguments", "saved"),
    [
        ({}, {"reference", "account"}),
        ({"damping": Damping(mass=2.0), "integrator": "SDIRK2"}, {"reference", "account"}),
        ({"damping": Damping(viscosity=20.0)}, {"reference", "account", "matrix"}),
    ],
    ids=["plain", "mass damping", "viscous"],
)
def test_a_kept_factor_resumes_to_the_same_bits(arguments: dict[str, object], saved: set[str]) -> None:
    whole, part, rest = (with_dear_factor(bar(**arguments)) for _ in range(3))
    for _ in whole.run(12):
        pass
    for _ in part.run(6):
        pass
    arrays = part.solver.save()
    assert set(arrays) == saved
    rest.restore(part.state, part.steps_done, arrays)
    results = list(rest.run(6))
    np.testing.assert_array_equal(rest.state.positions, whole.state.positions)
    assert sum(result.factorizations for result in results) < 6  # it went on with the old one
