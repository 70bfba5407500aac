"""Damping as a part of the stage problem: derivatives, forces, what it keeps and what plays no part."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import (
    CompressibleNeoHookean,
    Damping,
    InputError,
    Simulation,
    SolverSettings,
    StableNeoHookean,
    State,
    TetMesh,
    Tolerance,
)
from qlb.energies.damping import KelvinVoigt
from qlb.integrators import INTEGRATORS, Stage
from qlb.integrators.sdirk2 import A
from qlb.system import HeldNodes, StageProblem, System
from qlb.timing import Timer
from tests.support import (
    Array,
    dense,
    difference,
    finish,
    fitted_slope,
    jittered,
    left_end,
    make_system,
    random_rotation,
    right_end,
    start_at,
)
from tests.system.test_stage_problem import STAGES, H, moving_state, stage_of

DAMPINGS = {
    "mass": Damping(mass=30.0),
    "stiffness": Damping(stiffness=0.05),
    "viscosity": Damping(viscosity=200.0),
    "viscosity of each element": Damping(viscosity="1e3 * x * (y > 0.3)"),
    "all": Damping(mass=10.0, stiffness=0.02, viscosity=100.0),
}


@pytest.fixture(params=DAMPINGS)
def damping(request: pytest.FixtureRequest) -> Damping:
    return DAMPINGS[request.param]


@pytest.fixture(params=STAGES.values(), ids=STAGES)
def stage_name(request: pytest.FixtureRequest) -> tuple[str, int]:
    return request.param


def block(rng: np.random.Generator) -> TetMesh:
    return jittered(TetMesh.box((1.0, 0.8, 0.7), cells=(2, 2, 2)), rng, 0.2)


def problem_at(stage_name: tuple[str, int], damping: Damping | None, rng: np.random.Generator) -> StageProblem:
    mesh = block(rng)
    held = HeldNodes(len(mesh.positions))
    held.hold([0, 3, 4], mesh.positions)
    system = make_system(mesh, damping=damping, held=held)
    state = moving_state(mesh, rng)
    return StageProblem(system, stage_of(*stage_name, state, rng), state, Timer())


def somewhere(problem: StageProblem, rng: np.random.Generator, amount: float = 0.03) -> Array:
    mesh = problem.system.mesh
    return problem.system.held.place(
        mesh.positions + amount * rng.normal(size=mesh.positions.shape), problem.stage.time
    )


def test_gradient_and_hessian_are_derivatives(
    stage_name: tuple[str, int], damping: Damping, rng: np.random.Generator
) -> None:
    problem = problem_at(stage_name, damping, rng)
    x, free = somewhere(problem, rng), problem.system.held.fixed == 0
    gradient = problem.value_gradient(x)[1]
    hessian = dense(problem.hessian(x, project=False), problem.system.pattern)
    for _ in range(4):
        d = np.where(free, rng.normal(size=x.shape), 0.0)
        slope = difference(lambda y: np.array(problem.value_gradient(y)[0]), x, d, 1e-4)
        assert slope == pytest.approx(np.sum(gradient * d), rel=1e-8, abs=1e-9 * np.linalg.norm(gradient))
        change = difference(lambda y: problem.value_gradient(y)[1], x, d, 1e-4)
        product = np.where(free, (hessian @ d.ravel()).reshape(-1, 3), 0.0)
        np.testing.assert_allclose(product, change, rtol=0, atol=1e-8 * np.abs(change).max())


def test_projected_hessian_is_positive_and_the_exact_one_where_nothing_is_negative(
    damping: Damping, rng: np.random.Generator
) -> None:
    problem = problem_at(("BDF1", 0), damping, rng)
    crushed = dense(problem.hessian(somewhere(problem, rng, 0.4), project=True), problem.system.pattern)
    values = np.linalg.eigvalsh(crushed)
    assert values[0] >= (1 - 1e-9) * problem.system.mass.min()
    # Blown up from where it was, every element's part is positive as it is.
    mesh = problem.system.mesh
    state = State(0.0, mesh.positions, np.zeros_like(mesh.positions))
    calm = StageProblem(problem.system, stage_of("BDF1", 0, state, rng), state, Timer())
    exact, projected = (
        dense(calm.hessian(1.002 * mesh.positions, project=project), problem.system.pattern)
        for project in (False, True)
    )
    np.testing.assert_allclose(projected, exact, rtol=0, atol=1e-12 * np.abs(exact).max())


def test_stiffness_damping_is_beta_k_v_with_the_projected_stiffness_at_the_predictor(
    stage_name: tuple[str, int], rng: np.random.Generator
) -> None:
    beta, gradients = 0.05, []
    for damping in (Damping(stiffness=beta), None):
        rng = np.random.default_rng(1)
        problem = problem_at(stage_name, damping, rng)
        x = somewhere(problem, rng)
        gradients.append(problem.value_gradient(x)[1])
    stage, system = problem.stage, problem.system
    if not stage.inertial:
        np.testing.assert_array_equal(*gradients)
        return
    elastic = problem_at(("quasistatic", 0), None, np.random.default_rng(1))  # its Hessian is K alone
    K = dense(elastic.hessian(problem.predictor, project=True), system.pattern)
    force = (beta * K @ stage.velocity(x).ravel()).reshape(-1, 3)
    expected = stage.c**2 * np.where(system.held.fixed == 0, force, 0.0)
    np.testing.assert_allclose(gradients[0] - gradients[1], expected, rtol=0, atol=1e-12 * np.abs(expected).max())


# ---- the viscous force against its definition, worked out in NumPy


def shape_gradients(mesh: TetMesh) -> Array:
    """dN_a/dX of each element, shape (m, 4, 3)."""
    corners = mesh.positions[mesh.tets]
    inverse = np.linalg.inv((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))
    return np.concatenate([-inverse.sum(axis=1, keepdims=True), inverse], axis=1)


def gradients_of(mesh: TetMesh, values: Array) -> Array:
    """d(values)/dX of each element, shape (m, 3, 3)."""
    return np.einsum("eai,eaj->eij", values[mesh.tets], shape_gradients(mesh))


def viscous_force(mesh: TetMesh, eta: Array, x: Array, v: Array) -> Array:
    """-sum over elements of volume F (2 eta sym(F^T dF/dt)) dN/dX, shape (n, 3)."""
    F, rate = gradients_of(mesh, x), gradients_of(mesh, v)
    product = F.transpose(0, 2, 1) @ rate
    P = F @ ((eta * mesh.volumes())[:, None, None] * (product + product.transpose(0, 2, 1)))
    force = np.zeros_like(x)
    np.add.at(force, mesh.tets, -np.einsum("eij,eaj->eai", P, shape_gradients(mesh)))
    return force


class Path:
    """A smooth motion of every node that turns, stretches and shears."""

    def __init__(self, mesh: TetMesh, rng: np.random.Generator) -> None:
        self._rest, self._shapes = mesh.positions, 0.3 * rng.normal(size=(2, 3, 3))

    def x(self, t: float) -> Array:
        a, b = self._shapes
        return self._rest + self._rest @ (np.sin(3 * t) * a + (1 - np.cos(2 * t)) * b).T + self._bend(t)

    def v(self, t: float) -> Array:
        a, b = self._shapes
        return self._rest @ (3 * np.cos(3 * t) * a + 2 * np.sin(2 * t) * b).T + 2 * np.cos(2 * t) * self._curve()

    def _bend(self, t: float) -> Array:
        return np.sin(2 * t) * self._curve()

    def _curve(self) -> Array:
        return 0.2 * np.roll(self._rest, 1, axis=1) ** 2

    def state(self, t: float, h: float) -> State:
        return State(t, self.x(t), self.v(t), State(t - h, self.x(t - h), self.v(t - h)))


def force_in(stage: Stage, system: System, x: Array) -> Array:
    term = next(term for term in system.terms if isinstance(term, KelvinVoigt))
    potential, gradient = term.at(stage, x), np.zeros_like(x)
    assert potential is not None
    potential.add_value_gradient(x, 1.0, gradient)
    return -gradient


@pytest.mark.parametrize(("integrator", "order"), [("BDF1", 1), ("BDF2", 2), ("SDIRK2", 2)])
def test_viscous_force_is_the_rate_of_the_green_strain(integrator: str, order: int, rng: np.random.Generator) -> None:
    mesh = block(rng)
    eta = rng.uniform(0.0, 50.0, len(mesh.tets)) * (mesh.centroids()[:, 0] > 0.3)
    path, system, start = Path(mesh, rng), make_system(mesh, damping=Damping(viscosity=eta)), 0.4
    steps, errors = np.array([0.04, 0.02, 0.01, 0.005]), []
    for h in steps:
        stages = INTEGRATORS[integrator]().step(path.state(start, h), h)
        stage = next(stages)
        forces = [force_in(stage, system, path.x(stage.time))]
        expected = viscous_force(mesh, eta, path.x(start + h), path.v(start + h))
        if integrator == "SDIRK2":
            # Each stage is of order 1; the weights (1 - a, a) of the method make the impulse of a step of order 2.
            stage = stages.send(path.x(stage.time))
            forces.append(force_in(stage, system, path.x(stage.time)))
            forces = [(1 - A) * forces[0] + A * forces[1]]
            nodes, weights = np.polynomial.legendre.leggauss(5)
            times = start + h * (nodes + 1) / 2
            expected = sum(
                w / 2 * viscous_force(mesh, eta, path.x(t), path.v(t)) for w, t in zip(weights, times, strict=True)
            )
        errors.append(np.linalg.norm(forces[0] - expected) / np.linalg.norm(expected))
    slope = fitted_slope(steps, np.array(errors))
    assert order - 0.1 <= slope <= order + 0.4, f"order {slope:.2f}, errors {errors}"
    assert errors[-1] < (0.03 if order == 1 else 3e-4)


def test_one_step_of_bdf1_is_the_difference_of_the_green_strain(rng: np.random.Generator) -> None:
    mesh = block(rng)
    eta = rng.uniform(0.0, 50.0, len(mesh.tets))
    path, h = Path(mesh, rng), 0.1
    x0, x1 = path.x(0.3), path.x(0.3 + h)
    stage = next(INTEGRATORS["BDF1"]().step(State(0.3, x0, path.v(0.3)), h))
    F0, F1 = gradients_of(mesh, x0), gradients_of(mesh, x1)
    rate = (F1.transpose(0, 2, 1) @ F1 - F0.transpose(0, 2, 1) @ F0) / (2 * h)
    P = F1 @ (2 * (eta * mesh.volumes())[:, None, None] * rate)
    expected = np.zeros_like(x1)
    np.add.at(expected, mesh.tets, -np.einsum("eij,eaj->eai", P, shape_gradients(mesh)))
    found = force_in(stage, make_system(mesh, damping=Damping(viscosity=eta)), x1)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_a_rigid_motion_feels_no_viscous_force(integrator: str, rng: np.random.Generator) -> None:
    mesh, h = block(rng), 0.1
    system = make_system(mesh, damping=Damping(viscosity=1e3))
    stretched = mesh.positions @ (np.eye(3) + 0.2 * rng.normal(size=(3, 3)))
    turns = {k: random_rotation(rng) for k in range(4)}

    def at(k: int) -> Array:
        return stretched @ turns[k].T + k

    state = State(0.0, at(1), np.zeros_like(stretched), State(-h, at(0), np.zeros_like(stretched)))
    stages = INTEGRATORS[integrator]().step(state, h)
    stage = next(stages)
    scale = 1e3 / h * mesh.volumes().max() * np.abs(shape_gradients(mesh)).max()
    np.testing.assert_allclose(force_in(stage, system, at(2)), 0.0, atol=1e-12 * scale)
    if integrator == "SDIRK2":
        stage = stages.send(at(2))
        np.testing.assert_allclose(force_in(stage, system, at(3)), 0.0, atol=1e-12 * scale)


# ---- what plays no part


def bar(damping: Damping | None, integrator: str, **arguments: object) -> Simulation:
    mesh = TetMesh.box((0.8, 0.2, 0.2), cells=(4, 1, 1))
    defaults: dict[str, object] = {"material": StableNeoHookean(young=5e4, poisson=0.4), "threads": 1}
    simulation = Simulation(mesh, integrator=integrator, damping=damping, **(defaults | arguments))  # type: ignore[arg-type]
    simulation.pin(left_end(mesh))
    return simulation


def test_damping_plays_no_part_in_quasistatics(damping: Damping) -> None:
    def load(time: float) -> Array:
        return np.array([0.0, -200.0 * time, 0.0])

    ends = [finish(bar(d, "quasistatic", solver="ND", gravity=load), 3).positions for d in (damping, None)]
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_no_damping_changes_no_bit(integrator: str) -> None:
    none = Damping(viscosity=np.zeros(24))
    ends = [finish(bar(d, integrator), 5) for d in (none, None)]
    np.testing.assert_array_equal(ends[0].positions, ends[1].positions)


def test_viscosity_acts_where_it_is(rng: np.random.Generator) -> None:
    mesh = block(rng)
    half = (mesh.centroids()[:, 0] > 0.5).astype(float)
    path = Path(mesh, rng)
    stage = next(INTEGRATORS["BDF1"]().step(path.state(0.3, H), H))
    parts = [
        force_in(stage, make_system(mesh, damping=Damping(viscosity=eta)), path.x(0.3 + H))
        for eta in (40.0 * half, 40.0 * (1 - half), np.full(len(half), 40.0))
    ]
    apart = np.setdiff1d(np.arange(len(mesh.positions)), mesh.tets[half > 0])
    np.testing.assert_array_equal(parts[0][apart], 0.0)
    np.testing.assert_allclose(parts[0] + parts[1], parts[2], rtol=0, atol=1e-13 * np.abs(parts[2]).max())


def test_viscosity_by_array_by_expression_and_by_number_are_one() -> None:
    ends = [finish(bar(Damping(viscosity=eta), "BDF2"), 5).positions for eta in (50.0, np.full(24, 50.0), "50 + 0 * x")]
    np.testing.assert_array_equal(ends[0], ends[1])
    np.testing.assert_array_equal(ends[0], ends[2])


@pytest.mark.parametrize("name", ["mass", "stiffness", "viscosity"])
@pytest.mark.parametrize("value", [-1.0, np.nan, np.inf, "much"])
def test_damping_out_of_range_is_refused(name: str, value: object) -> None:
    with pytest.raises(InputError, match=name):
        Damping(**{name: value})  # type: ignore[arg-type]


def test_viscosity_of_another_mesh_is_refused() -> None:
    with pytest.raises(InputError, match=r"damping viscosity has shape \(3,\), must be one number or \(24,\)"):
        bar(Damping(viscosity=[1.0, 2.0, 3.0]), "BDF1").advance()


def test_stiffness_damping_falls_back_on_the_last_positions_where_the_predicted_ones_have_no_stiffness() -> None:
    # So fast that the predictor turns elements inside out, where a material with log J is not defined.
    simulation = bar(
        Damping(stiffness=1e-3),
        "BDF1",
        material=CompressibleNeoHookean(young=1e5, poisson=0.3),
        solver="ND",
        step=0.02,
    )
    mesh = simulation.mesh
    v = np.zeros_like(mesh.positions)
    v[right_end(mesh)] = [-20.0, 0.0, 0.0]
    start_at(simulation, mesh.positions, v)
    assert simulation.advance().converged


# ---- solvers, threads


METHODS = {
    "ND always": ("ND", "always"),
    "ND on demand": ("ND", "on-demand"),
    "ND never": ("ND", "never"),
    "QLF": ("QLF", "always"),
    "QLB": ("QLB", "always"),
    "QLB on demand": ("QLB", "on-demand"),
}
BAR_DAMPINGS = {
    "mass": Damping(mass=3.0),
    "stiffness": Damping(stiffness=0.01),
    "viscosity": Damping(viscosity="2e3 * x"),
    "all": Damping(mass=3.0, stiffness=0.01, viscosity=200.0),
}


@pytest.mark.parametrize("name", BAR_DAMPINGS)
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_solvers_agree(integrator: str, name: str) -> None:
    ends = {}
    for method, (solver, projection) in METHODS.items():
        simulation = bar(
            BAR_DAMPINGS[name],
            integrator,
            solver=solver,
            tolerance=Tolerance(relative=1e-10),
            solver_settings=SolverSettings(projection=projection),  # type: ignore[arg-type]
        )
        simulation.move(right_end(simulation.mesh), lambda anchors, time: anchors - [0.5 * time, time, 0.0])
        ends[method] = finish(simulation, 10).positions
    for found in ends.values():
        np.testing.assert_allclose(found, ends["ND on demand"], rtol=0, atol=1e-9)


@pytest.mark.parametrize("name", BAR_DAMPINGS)
def test_threads_change_no_bit(name: str) -> None:
    mesh, ends = TetMesh.box((1.0, 0.5, 0.5), cells=(16, 8, 8)), []
    for threads in (1, 2):
        simulation = Simulation(mesh, material=StableNeoHookean(), damping=BAR_DAMPINGS[name], threads=threads)
        simulation.pin(left_end(mesh))
        ends.append(finish(simulation, 2))
    np.testing.assert_array_equal(ends[0].positions, ends[1].positions)
    np.testing.assert_array_equal(ends[0].velocities, ends[1].velocities)
