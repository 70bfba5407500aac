"""Energies of a user's own take part like those of the package."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from qlb import Damping, Energy, Simulation, SolverSettings, StableNeoHookean, TetMesh, Tolerance
from qlb.integrators import INTEGRATORS
from qlb.solvers import SOLVERS
from qlb.system import HeldNodes, StageProblem, System
from qlb.timing import Timer
from tests.energies.user_energies import Centre, Gyration, Laplacian, Springs, Tethers, node_mass
from tests.support import (
    Array,
    dense,
    difference,
    finish,
    fitted_slope,
    left_end,
    make_system,
    right_end,
    small_bar,
)
from tests.system.test_stage_problem import STAGES, moving_state, stage_of

MESH = small_bar((3, 1, 1))
N = len(MESH.positions)
FAR = np.stack([left_end(MESH), right_end(MESH)], axis=1)  # in no tet together
ENERGIES: dict[str, Callable[[], Energy]] = {
    "springs": lambda: Springs(FAR, 300.0, 0.6),
    "springs that grow": lambda: Springs(FAR, 300.0, 0.6, growth=0.5),
    "springs that push": lambda: Springs(FAR, 2.0, 2.0),
    "one spring twice, and one back": lambda: Springs([[0, N - 1], [0, N - 1], [N - 1, 0]], 100.0, 0.6),
    "single nodes": lambda: Tethers([5, 5, 9], MESH.positions[[5, 5, 9]] + 0.05, 200.0, (0.1, 0.0, 0.3)),
    "one stencil of many nodes": lambda: Gyration(np.arange(0, N, 2), 2e3, 0.5),
    "repeated nodes in a stencil": lambda: Gyration([3, 7, 3, 12, 7], 2e3, 0.6),
    "graph": lambda: Laplacian(MESH, 500.0),
    "centre of mass": lambda: Centre(node_mass(MESH), 500.0, (0.5, 0.2, 0.1), (0.3, 0.0, 0.0)),
}


@pytest.fixture(params=ENERGIES)
def energy(request: pytest.FixtureRequest) -> Energy:
    return ENERGIES[request.param]()


@pytest.fixture(params=STAGES.values(), ids=STAGES)
def stage_name(request: pytest.FixtureRequest) -> tuple[str, int]:
    return request.param


def system_with(*energies: Energy, threads: int = 1) -> System:
    held = HeldNodes(N)
    held.hold(left_end(MESH), MESH.positions)
    return make_system(MESH, StableNeoHookean(young=1e4, poisson=0.3), held=held, energies=energies, threads=threads)


def problem_of(stage_name: tuple[str, int], *energies: Energy) -> StageProblem:
    rng = np.random.default_rng(7)
    state = moving_state(MESH, rng)
    return StageProblem(system_with(*energies), stage_of(*stage_name, state, rng), state, Timer())


def test_gradient_and_hessian_are_derivatives(
    stage_name: tuple[str, int], energy: Energy, rng: np.random.Generator
) -> None:
    problem = problem_of(stage_name, energy)
    x = problem.system.held.place(MESH.positions + 0.02 * rng.normal(size=(N, 3)), problem.stage.time)
    free = problem.system.held.fixed == 0
    gradient = problem.value_gradient(x)[1]
    hessian = dense(problem.hessian(x, project=False), problem.system.pattern)
    for _ in range(4):
        d = np.where(free, rng.normal(size=x.shape), 0.0)
        slope = difference(lambda y: np.array(problem.value_gradient(y)[0]), x, d, 1e-4)
        assert slope == pytest.approx(np.sum(gradient * d), rel=1e-8, abs=1e-8 * np.linalg.norm(gradient))
        change = difference(lambda y: problem.value_gradient(y)[1], x, d, 1e-4)
        product = np.where(free, (hessian @ d.ravel()).reshape(-1, 3), 0.0)
        np.testing.assert_allclose(product, change, rtol=0, atol=1e-8 * np.abs(change).max())


def test_stencils_are_projected_one_by_one(rng: np.random.Generator) -> None:
    pushing = Springs(FAR, 300.0, 2.0)
    x = MESH.positions + 0.02 * rng.normal(size=(N, 3))
    found = {}
    for project in (False, True):
        parts = [problem_of(("quasistatic", 0), *e) for e in ((pushing,), ())]
        found[project] = np.subtract(*(dense(p.hessian(x, project=project), p.system.pattern) for p in parts))
    assert np.linalg.eigvalsh(found[False])[0] < -10
    expected = np.zeros((N, 3, N, 3))
    for pair in FAR:
        block = np.asarray(Springs(FAR[:1], 300.0, 2.0).hessian(x[None, pair], 0.0))[0]
        values, vectors = np.linalg.eigh(block)
        expected[np.ix_(pair, range(3), pair, range(3))] += ((vectors * np.maximum(values, 0)) @ vectors.T).reshape(
            2, 3, 2, 3
        )
    scale = np.abs(expected).max()
    np.testing.assert_allclose(found[True], expected.reshape(3 * N, 3 * N), rtol=0, atol=1e-9 * scale)


# ---- against a dense Newton that shares no line with the package but the elastic energy


def dense_derivatives(energy: Energy, x: Array, time: float) -> tuple[Array, Array]:
    """Gradient (3n,) and Hessian (3n, 3n) of an energy, added up stencil by stencil."""
    if isinstance(energy, Laplacian | Centre):
        return np.asarray(energy.gradient(x, time)).ravel(), energy.hessian(x, time, False).toarray()
    nodes = np.asarray(energy.stencils)  # type: ignore[attr-defined]
    gradient, hessian = np.zeros((N, 3)), np.zeros((N, 3, N, 3))
    forces = np.asarray(energy.gradient(x[nodes], time))  # type: ignore[attr-defined]
    w = nodes.shape[1]
    blocks = np.asarray(energy.hessian(x[nodes], time)).reshape(-1, w, 3, w, 3)  # type: ignore[attr-defined]
    for s, stencil in enumerate(nodes):
        for a, i in enumerate(stencil):
            gradient[i] += forces[s, a]
            for b, j in enumerate(stencil):
                hessian[i, :, j, :] += blocks[s, a, :, b, :]
    return gradient.ravel(), hessian.reshape(3 * N, 3 * N)


def dense_newton(stage_name: tuple[str, int], energy: Energy) -> Array:
    problem = problem_of(stage_name)
    free, x, scale = problem.system.held.fixed.ravel() == 0, problem.start.copy(), problem.force_scale
    for _ in range(100):
        g, H = dense_derivatives(energy, x, problem.stage.time)
        g = problem.value_gradient(x)[1].ravel() + scale * g
        H = dense(problem.hessian(x, project=False), problem.system.pattern) + scale * H
        if np.linalg.norm(g[free]) <= 1e-12 * scale * 1e3:
            return x
        values, vectors = np.linalg.eigh(H[np.ix_(free, free)])
        step = vectors @ ((vectors.T @ g[free]) / np.maximum(np.abs(values), 1e-3 * values.max()))
        x.reshape(-1)[free] -= min(1.0, 0.05 / np.abs(step).max()) * step
        if np.abs(step).max() < 1e-14:
            return x
    raise AssertionError("the dense Newton did not converge")


def test_a_stage_is_solved_as_by_a_dense_newton(stage_name: tuple[str, int], energy: Energy) -> None:
    expected = dense_newton(stage_name, energy)
    settings = SolverSettings(projection="on-demand", max_iterations=2000)
    for name, solver in SOLVERS.items():
        problem = problem_of(stage_name, energy)
        tight = Tolerance(relative=1e-10, absolute=1e-9 * problem.force_scale)
        result = solver(problem.system, settings, tight).solve(problem)
        assert result.reason.converged, name
        np.testing.assert_allclose(result.positions, expected, rtol=0, atol=2e-8, err_msg=name)


def bar(energy: Energy | None, integrator: str = "BDF2", solver: str = "ND", **arguments: object) -> Simulation:
    defaults: dict[str, object] = {"material": StableNeoHookean(young=1e4, poisson=0.3), "threads": 1}
    simulation = Simulation(MESH, integrator=integrator, solver=solver, **(defaults | arguments))  # type: ignore[arg-type]
    simulation.pin(left_end(MESH))
    if energy is not None:
        simulation.add(energy)
    return simulation


METHODS = [("ND", "on-demand"), ("ND", "always"), ("ND", "never"), ("QLF", "always"), ("QLB", "always")]


@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_solvers_agree(energy: Energy, integrator: str) -> None:
    ends = {}
    for solver, projection in METHODS:
        simulation = bar(
            energy,
            integrator,
            solver,
            tolerance=Tolerance(relative=1e-9, absolute=1e-8 if integrator == "quasistatic" else 0.0),
            gravity=(0.0, -3.0, 0.0),
            solver_settings=SolverSettings(projection=projection, max_iterations=2000),  # type: ignore[arg-type]
        )
        ends[solver, projection] = finish(simulation, 5).positions
    for found in ends.values():
        np.testing.assert_allclose(found, ends["ND", "on-demand"], rtol=0, atol=1e-7)
    alone = finish(bar(None, integrator, gravity=(0.0, -3.0, 0.0)), 5).positions
    assert np.abs(ends["ND", "always"] - alone).max() > 5e-5


@pytest.mark.parametrize("solver", ["ND", "QLB"])
def test_bits_are_the_same_again_and_with_more_threads(energy: Energy, solver: str) -> None:
    ends = [finish(bar(energy, solver=solver, threads=threads), 5) for threads in (1, 1, 2)]
    for end in ends[1:]:
        np.testing.assert_array_equal(end.positions, ends[0].positions)
        np.testing.assert_array_equal(end.velocities, ends[0].velocities)


# ---- known answers


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_body_hangs_from_the_spring_of_its_centre_of_mass(solver: str) -> None:
    # k (x_c - p) = m g, and no element feels it
    mass, k, g = node_mass(MESH), 800.0, np.array([0.3, -9.81, 0.0])
    place = np.array([0.375, 0.6, 0.125])
    simulation = Simulation(
        MESH,
        material=StableNeoHookean(young=5e4),
        integrator="BDF1",
        solver=solver,
        step=0.1,
        gravity=tuple(g),
        damping=Damping(mass=8.0),
        threads=1,
    )
    simulation.add(Centre(mass, k, place))
    x = finish(simulation, 100).positions
    moved = place + mass.sum() * g / k - mass @ MESH.positions / mass.sum()
    np.testing.assert_allclose(x, MESH.positions + moved, rtol=0, atol=1e-6)


def two_blocks() -> tuple[TetMesh, Array, Array]:
    """One block above the other, apart; and the four corners of the lower one's top, with those above them."""
    block = TetMesh.box((0.2, 0.2, 0.2), cells=(2, 2, 2))
    n = len(block.positions)
    lower = block.positions - [0.0, 0.5, 0.0]
    mesh = TetMesh(np.concatenate([block.positions, lower]), np.concatenate([block.tets, block.tets + n]))
    corner = np.isin(block.positions[:, 0], [0.0, 0.2]) & np.isin(block.positions[:, 2], [0.0, 0.2])
    low = np.flatnonzero(corner & (block.positions[:, 1] < 1e-9))
    top = np.flatnonzero(corner & (block.positions[:, 1] > 0.2 - 1e-9))
    return mesh, np.stack([low, n + top], axis=1), np.arange(n)


@pytest.mark.parametrize(("integrator", "solver"), [("quasistatic", "ND"), ("quasistatic", "QLB"), ("BDF1", "QLB")])
def test_a_block_hangs_from_four_springs_stretched_by_its_weight(integrator: str, solver: str) -> None:
    mesh, pairs, upper = two_blocks()
    k, weight = 500.0, 1000.0 * 0.2**3 * 9.81
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(young=1e8, poisson=0.3),
        integrator=integrator,
        solver=solver,
        step=0.3 if integrator == "BDF1" else 0.01,
        tolerance=Tolerance(relative=1e-9, absolute=1e-9),
        threads=1,
    )
    simulation.pin(upper)
    simulation.add(Springs(pairs, k, 0.3))
    # BDF1's own damping lets the swing die out
    x = finish(simulation, 60 if integrator == "BDF1" else 1).positions
    stretch = np.linalg.norm(x[pairs[:, 1]] - x[pairs[:, 0]], axis=1) - 0.3
    np.testing.assert_allclose(stretch, weight / (4 * k), rtol=1e-3)
    assert k * stretch.sum() == pytest.approx(weight, rel=1e-5)


@pytest.mark.parametrize(("integrator", "order"), [("BDF1", 1), ("BDF2", 2), ("SDIRK2", 2)])
def test_the_centre_swings_on_its_spring_as_a_point_does(integrator: str, order: int) -> None:
    # m x_c'' = -k (x_c - p - v t): the elastic forces have no part in it
    mass, omega, time = node_mass(MESH), 6.0, 0.5
    place, velocity = np.array([0.5, 0.3, 0.1]), np.array([0.2, 0.0, -0.1])
    start = mass @ MESH.positions / mass.sum()
    exact = place + velocity * time + (start - place) * np.cos(omega * time) - velocity / omega * np.sin(omega * time)
    counts, errors = np.array([20, 40, 80]), []
    for count in counts:
        simulation = Simulation(
            MESH,
            material=StableNeoHookean(young=1e5),
            integrator=integrator,
            step=time / count,
            gravity=(0.0, 0.0, 0.0),
            tolerance=Tolerance(relative=1e-9),
            threads=1,
        )
        simulation.add(Centre(mass, omega**2 * mass.sum(), place, velocity))
        errors.append(np.linalg.norm(mass @ finish(simulation, int(count)).positions / mass.sum() - exact))
    slope = fitted_slope(time / counts, np.array(errors))
    assert order - 0.15 <= slope <= order + 0.3, f"order {slope:.2f}, errors {errors}"


def test_energies_add_up() -> None:
    weak = finish(bar(Springs(FAR, 100.0, 0.6)), 5).positions
    simulation = bar(Springs(FAR, 50.0, 0.6))
    simulation.add(Springs(FAR, 50.0, 0.6))
    np.testing.assert_allclose(finish(simulation, 5).positions, weak, rtol=0, atol=1e-8)


def test_an_energy_sees_the_time_of_each_stage() -> None:
    times = []

    class Watch(Tethers):
        def gradient(self, x: Array, time: float) -> Array:
            times.append(time)
            return super().gradient(x, time)  # type: ignore[return-value]

    simulation = bar(Watch([5], MESH.positions[[5]], 1.0), "SDIRK2", step=0.1)
    finish(simulation, 2)
    a = 1 - np.sqrt(0.5)
    np.testing.assert_allclose(np.unique(times), [0.1 * a, 0.1, 0.1 + 0.1 * a, 0.2], rtol=1e-12)


@pytest.mark.parametrize("integrator", ["quasistatic", "BDF2", "SDIRK2"])
def test_what_is_ten_thousand_times_stiffer_than_the_body_converges_to_rounding(integrator: str) -> None:
    # |g| of a body at rest is then nothing but rounding in the springs, which the body's own stiffness does not tell.
    simulation = bar(Springs(FAR[:2], 1e9, 0.75), integrator, gravity=(0.0, -1.0, 0.0), step=0.01)
    for result in simulation.run(6):
        assert result.converged
    x = simulation.state.positions
    np.testing.assert_allclose(np.linalg.norm(x[FAR[:2, 1]] - x[FAR[:2, 0]], axis=1), 0.75, rtol=1e-7)
