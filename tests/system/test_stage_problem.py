"""The whole stage problem, at the stages that the integrators really give."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import pytest

from qlb import Damping, StableNeoHookean, State, TetMesh, Translation
from qlb.integrators import INTEGRATORS, Stage
from qlb.system import HeldNodes, StageProblem, System
from qlb.timing import Timer
from tests.support import Array, dense, difference, elastic_gradient, jittered, make_system, multiply

H = 0.02
GRAVITY = np.array([1.0, -9.81, 2.0])
STAGES = {
    "BDF1": ("BDF1", 0),
    "BDF2": ("BDF2", 0),
    "SDIRK2 first": ("SDIRK2", 0),
    "SDIRK2 second": ("SDIRK2", 1),
    "quasistatic": ("quasistatic", 0),
}


@dataclass
class Case:
    system: System
    stage: Stage
    state: State
    problem: StageProblem
    x: Array
    free: Array
    M: Array


def moving_state(mesh: TetMesh, rng: np.random.Generator) -> State:
    def shaken() -> Array:
        return mesh.positions + 0.02 * rng.normal(size=mesh.positions.shape)

    def speeds() -> Array:
        return rng.normal(size=mesh.positions.shape)

    return State(0.3, shaken(), speeds(), State(0.3 - H, shaken(), speeds()))


def stage_of(name: str, index: int, state: State, rng: np.random.Generator) -> Stage:
    steps = INTEGRATORS[name]().step(state, H)
    stage = next(steps)
    for _ in range(index):
        stage = steps.send(state.positions + 0.01 * rng.normal(size=state.positions.shape))
    return stage


def node_mass(system: System) -> Array:
    """The dense mass matrix over all degrees of freedom, from its definition."""
    mesh, n = system.mesh, system.nodes
    M = np.zeros((n, n))
    for tet, volume in zip(mesh.tets, mesh.volumes(), strict=True):
        M[np.ix_(tet, tet)] += 1000 * volume * (np.ones((4, 4)) + np.eye(4)) / 20
    return M


@pytest.fixture(params=STAGES.values(), ids=STAGES)
def case(request: pytest.FixtureRequest, mass: str, damping: float, rng: np.random.Generator) -> Case:
    mesh = jittered(TetMesh.box((1.0, 0.8, 0.7), cells=(2, 2, 2)), rng, 0.2)
    held = HeldNodes(len(mesh.positions))
    held.hold([0, 3, 4], mesh.positions)
    held.hold([7, 8], mesh.positions, Translation((0.1, 0.2, 0.3)))
    held.hold([11], mesh.positions, axes="y")
    system = make_system(mesh, gravity=tuple(GRAVITY), mass=mass, damping=Damping(mass=damping), held=held)
    state = moving_state(mesh, rng)
    stage = stage_of(*request.param, state, rng)
    problem = StageProblem(system, stage, state, Timer())
    x = held.place(mesh.positions + 0.03 * rng.normal(size=mesh.positions.shape), stage.time)
    M = node_mass(system) if mass == "consistent" else np.diag(system.mass)
    return Case(system, stage, state, problem, x, held.fixed == 0, M)


@pytest.fixture(params=["lumped", "consistent"])
def mass(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(params=[0.0, 30.0], ids=["undamped", "damped"])
def damping(request: pytest.FixtureRequest) -> float:
    return request.param


def test_gradient_is_the_derivative_of_the_value(case: Case, rng: np.random.Generator) -> None:
    gradient = case.problem.value_gradient(case.x)[1]
    scale = np.linalg.norm(gradient)
    for _ in range(5):
        d = np.where(case.free, rng.normal(size=case.x.shape), 0.0)
        measured = difference(lambda y: np.array(case.problem.value_gradient(y)[0]), case.x, d, 1e-4)
        assert measured == pytest.approx(np.sum(gradient * d), rel=0, abs=1e-8 * scale * np.linalg.norm(d))


def test_hessian_is_the_derivative_of_the_gradient(case: Case, rng: np.random.Generator) -> None:
    matrix = case.problem.hessian(case.x, project=False)
    full = dense(matrix, case.system.pattern)
    for _ in range(3):
        d = np.where(case.free, rng.normal(size=case.x.shape), 0.0)
        measured = difference(lambda y: case.problem.value_gradient(y)[1], case.x, d, 1e-4)
        scale = np.abs(measured).max()
        product = np.where(case.free, multiply(matrix, d), 0.0)
        np.testing.assert_allclose(product, measured, rtol=0, atol=1e-8 * scale)
        from_dense = np.where(case.free, (full @ d.ravel()).reshape(-1, 3), 0.0)
        np.testing.assert_allclose(from_dense, measured, rtol=0, atol=1e-8 * scale)


def test_gradient_is_that_of_the_supplement(case: Case) -> None:
    # g = M (x - x_hat) - c^2 f(x, v), v = (x - x_b)/c, x_hat = x_b + c v_b; in quasistatics g = -f
    system, stage, x = case.system, case.stage, case.x
    force = case.M.sum(axis=1)[:, None] * GRAVITY - elastic_gradient(system, x)
    expected = -force
    if stage.inertial:
        v = (x - stage.x_b) / stage.c
        damping = -system.damping.mass * case.M @ v
        expected = case.M @ (x - stage.x_b - stage.c * stage.v_b) - stage.c**2 * (force + damping)
    gradient = case.problem.value_gradient(x)[1]
    np.testing.assert_allclose(gradient[case.free], expected[case.free], rtol=0, atol=1e-12 * np.abs(expected).max())


def test_value_is_the_documented_energy_up_to_a_constant(case: Case, rng: np.random.Generator) -> None:
    system, stage, M = case.system, case.stage, case.M

    def square(r: Array) -> float:
        return float(np.sum(r * (M @ r)))

    def energy(x: Array) -> float:
        load = M.sum(axis=1)[:, None] * GRAVITY
        potential = system.elastic.value(x) - float(np.sum(load * x))
        if not stage.inertial:
            return potential
        kinetic = 0.5 * square(x - stage.x_b - stage.c * stage.v_b)
        return kinetic + stage.c**2 * potential + 0.5 * stage.c * system.damping.mass * square(x - stage.x_b)

    other = case.x + 0.01 * rng.normal(size=case.x.shape)
    values = [case.problem.value_gradient(y)[0] for y in (case.x, other)]
    scale = abs(energy(case.x)) + abs(energy(other))
    assert values[0] - values[1] == pytest.approx(energy(case.x) - energy(other), rel=0, abs=1e-12 * scale)


def test_gradient_is_zero_where_nodes_are_held(case: Case) -> None:
    gradient = case.problem.value_gradient(case.x)[1]
    np.testing.assert_array_equal(gradient[~case.free], 0.0)
    assert (gradient[case.free] != 0).all()


def test_projected_hessian_of_a_dynamic_stage_is_positive_definite(case: Case, rng: np.random.Generator) -> None:
    crushed = case.x + 0.5 * rng.normal(size=case.x.shape)
    full = dense(case.problem.hessian(crushed, project=True), case.system.pattern)
    values = np.linalg.eigvalsh(full)
    floor = np.linalg.eigvalsh(case.M)[0] if case.stage.inertial else 0.0
    assert values[0] >= floor - 1e-12 * values[-1]


def test_start_is_the_last_state_with_the_held_nodes_in_place(case: Case) -> None:
    start = case.problem.start
    np.testing.assert_array_equal(start[case.free], case.state.positions[case.free])
    anchors = case.system.mesh.positions
    np.testing.assert_array_equal(start[[0, 3, 4]], anchors[[0, 3, 4]])
    np.testing.assert_array_equal(start[[7, 8]], anchors[[7, 8]] + case.stage.time * np.array([0.1, 0.2, 0.3]))
    assert start[11, 1] == anchors[11, 1]


def test_predictor_goes_on_with_velocity_and_acceleration(case: Case) -> None:
    # x_k + t v_k + t^2/2 (v_k - v_{k-1})/h, or x_k + t v_k in quasistatics
    state, t = case.state, case.stage.time - case.state.time
    expected = state.positions + t * state.velocities
    if case.stage.inertial:
        expected += t**2 / 2 * (state.velocities - state.previous.velocities) / H  # type: ignore[union-attr]
    guess = case.problem.predictor
    np.testing.assert_allclose(guess[case.free], expected[case.free], rtol=1e-13)
    np.testing.assert_array_equal(guess[~case.free], case.problem.start[~case.free])


def test_predictor_without_an_earlier_state_uses_the_velocity(case: Case) -> None:
    state = case.state.without_history()
    guess = StageProblem(case.system, case.stage, state, Timer()).predictor
    expected = state.positions + (case.stage.time - state.time) * state.velocities
    np.testing.assert_allclose(guess[case.free], expected[case.free], rtol=1e-14)


def test_residual_is_the_norm_of_the_gradient(case: Case) -> None:
    gradient = case.problem.value_gradient(case.x)[1]
    assert case.problem.residual(gradient) == pytest.approx(np.linalg.norm(gradient), rel=1e-13)


def test_residual_scale_is_a_force_of_order_one_strain(case: Case) -> None:
    # |c^2 E V_i^(2/3)|, V_i a quarter of the volume of the tets at node i
    mesh = case.system.mesh
    volume = np.zeros(len(mesh.positions))
    for tet, v in zip(mesh.tets, mesh.volumes(), strict=True):
        volume[tet] += v / 4
    scale = case.stage.c**2 if case.stage.inertial else 1.0
    expected = scale * 2e4 * np.linalg.norm(volume ** (2 / 3))
    assert case.problem.residual_scale == pytest.approx(expected, rel=1e-12)


def test_a_stage_that_begins_where_another_ended_evaluates_no_element_again(case: Case) -> None:
    system, problem = case.system, case.problem
    energy, gradient = problem.value_gradient(case.x)
    kept, system.potentials = system.potentials, []
    try:
        following = StageProblem(system, problem.stage, case.state, Timer())
        again, same = following.value_gradient(case.x.copy())
    finally:
        system.potentials = kept
    assert again == energy
    np.testing.assert_array_equal(same, gradient)


def test_evaluation_leaves_the_positions_alone(case: Case) -> None:
    before = case.x.copy()
    case.problem.value_gradient(case.x)
    case.problem.hessian(case.x, project=True)
    np.testing.assert_array_equal(case.x, before)


@pytest.mark.parametrize("integrator", ["BDF1", "quasistatic"])
@pytest.mark.parametrize("poisson", [0.3, 0.49, 0.4999])
@pytest.mark.parametrize("cells", [(4, 2, 2), (16, 8, 8)], ids=str)
def test_rounding_is_no_larger_than_the_problem_says(
    cells: tuple[int, int, int], poisson: float, integrator: str, rng: np.random.Generator
) -> None:
    # Positions off by an eps change E and g by what cannot be resolved, and the end of a solve rests on it. Stored
    # positions are off by a third of that, root mean square.
    mesh = jittered(TetMesh.box((0.75, 0.25, 0.25), cells=cells), rng, 0.2)
    system = make_system(mesh, StableNeoHookean(poisson=poisson), gravity=(0.0, -1e-6, 0.0))
    state = State(0.0, mesh.positions, np.zeros_like(mesh.positions))
    problem = StageProblem(system, stage_of(integrator, 0, state, rng), state, Timer())
    x = mesh.positions * (1 + 1e-7)
    energies, changes = [], []
    reference = problem.value_gradient(x)[1]
    for _ in range(20):
        energy, gradient = problem.value_gradient(x * (1 + 2e-16 * rng.integers(-1, 2, size=x.shape)))
        energies.append(energy)
        changes.append(problem.residual(gradient - reference))
    assert np.ptp(energies) <= problem.energy_rounding
    assert np.mean(changes) <= 3 * problem.residual_rounding
