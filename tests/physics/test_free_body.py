"""A body that nothing holds: momentum, angular momentum, free fall, damping."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Damping, Simulation, StableNeoHookean, TetMesh, Tolerance
from tests.support import ROBUST_NEWTON, TIGHT, Array, finish, fitted_slope, start_at

MESH = TetMesh.box((0.6, 0.3, 0.2), cells=(3, 2, 1))
TIME = 0.5
DRIFT, SPIN = np.array([0.5, 0.2, -0.1]), np.array([1.0, 2.0, -3.0])
STRAIN = np.array([[0.1, 0.08, 0.0], [0.0, -0.05, 0.05], [0.03, 0.0, 0.0]])


def spinning(integrator: str, count: int, **arguments: object) -> Simulation:
    """A stretched body with a spin and a drift, that takes `count` steps to `TIME`."""
    defaults = {
        "material": StableNeoHookean(young=1e4, poisson=0.35),
        "solver": "ND",
        "gravity": (0.0, 0.0, 0.0),
        "tolerance": TIGHT,
        "solver_settings": ROBUST_NEWTON,
        "threads": 1,
    }
    simulation = Simulation(MESH, integrator=integrator, step=TIME / count, **(defaults | arguments))  # type: ignore[arg-type]
    r = MESH.positions - MESH.positions.mean(axis=0)
    x = MESH.positions + r @ STRAIN.T
    return start_at(simulation, x, DRIFT + np.cross(SPIN, r))


def momentum(simulation: Simulation) -> Array:
    return simulation.system.mass @ simulation.state.velocities


def angular_momentum(simulation: Simulation) -> Array:
    state = simulation.state
    return simulation.system.mass @ np.cross(state.positions, state.velocities)


def centre(simulation: Simulation) -> Array:
    mass = simulation.system.mass
    return mass @ simulation.state.positions / mass.sum()


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_momentum_is_kept(integrator: str, mass: str) -> None:
    simulation = spinning(integrator, 50, mass=mass)
    before = momentum(simulation)
    finish(simulation, 50)
    np.testing.assert_allclose(momentum(simulation), before, rtol=0, atol=1e-10 * np.linalg.norm(before))


@pytest.mark.parametrize("solver", ["ND", "QLF", "QLB", "QLA"])
def test_momentum_is_kept_to_the_default_tolerance(solver: str) -> None:
    simulation = spinning("BDF2", 50, solver=solver, tolerance=Tolerance())
    before = momentum(simulation)
    finish(simulation, 50)
    np.testing.assert_allclose(momentum(simulation), before, rtol=0, atol=1e-5 * np.linalg.norm(before))


@pytest.mark.parametrize(("integrator", "order"), [("BDF1", 0.9), ("BDF2", 1.85), ("SDIRK2", 1.8)])
def test_drift_of_angular_momentum_falls_with_the_order(integrator: str, order: float) -> None:
    counts, drifts = np.array([200, 400, 800]), []
    for count in counts:
        simulation = spinning(integrator, int(count))
        before = angular_momentum(simulation)
        finish(simulation, int(count))
        drifts.append(np.linalg.norm(angular_momentum(simulation) - before) / np.linalg.norm(before))
    slope = fitted_slope(TIME / counts, np.array(drifts))
    assert order <= slope <= order + 0.4, f"order {slope:.2f}, drifts {drifts}"


def test_sdirk2_keeps_angular_momentum_best() -> None:
    drifts = []
    for integrator in ("BDF1", "BDF2", "SDIRK2"):
        simulation = spinning(integrator, 100)
        before = angular_momentum(simulation)
        finish(simulation, 100)
        drifts.append(np.linalg.norm(angular_momentum(simulation) - before))
    assert drifts[0] > 10 * drifts[1] > 50 * drifts[2]


@pytest.mark.parametrize(("integrator", "late"), [("BDF1", TIME / 25), ("BDF2", 0.0), ("SDIRK2", 0.0)])
def test_the_centre_of_mass_falls_on_a_parabola(integrator: str, late: float) -> None:
    # x_0 + v_0 t + g t^2/2, which the methods of order 2 meet exactly; BDF1 gives g t (t + h)/2.
    gravity = np.array([1.0, -9.81, 2.0])
    simulation = spinning(integrator, 25, gravity=tuple(gravity))
    x, v, t = centre(simulation), momentum(simulation) / simulation.system.mass.sum(), TIME
    finish(simulation, 25)
    np.testing.assert_allclose(centre(simulation), x + v * t + gravity * t * (t + late) / 2, rtol=0, atol=1e-11)
    mean = momentum(simulation) / simulation.system.mass.sum()
    np.testing.assert_allclose(mean, v + gravity * t, rtol=0, atol=1e-11)


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_a_body_at_rest_falls_without_changing_its_shape(integrator: str) -> None:
    simulation = Simulation(
        MESH, material=StableNeoHookean(), integrator=integrator, tolerance=Tolerance(relative=1e-9), threads=1
    )
    finish(simulation, 10)
    fall = simulation.state.positions - MESH.positions
    assert fall[:, 1].max() < -0.03
    np.testing.assert_allclose(fall, np.broadcast_to(fall[0], fall.shape), rtol=0, atol=1e-9)


@pytest.mark.parametrize(
    ("integrator", "factor"),
    [
        # The stability functions at z = -alpha h
        ("BDF1", lambda z: 1 / (1 - z)),
        ("SDIRK2", lambda z: (1 + (np.sqrt(2) - 1) * z) / (1 - (1 - np.sqrt(0.5)) * z) ** 2),
    ],
)
def test_mass_damping_slows_a_drifting_body(integrator: str, factor: object) -> None:
    # v' = -alpha v
    alpha, h, count = 7.0, 0.02, 25
    simulation = Simulation(
        MESH,
        material=StableNeoHookean(),
        integrator=integrator,
        step=h,
        gravity=(0.0, 0.0, 0.0),
        velocity=tuple(DRIFT),
        damping=Damping(mass=alpha),
        tolerance=Tolerance(relative=1e-9),
        threads=1,
    )
    finish(simulation, count)
    expected = DRIFT * factor(-alpha * h) ** count  # type: ignore[operator]
    np.testing.assert_allclose(simulation.state.velocities, np.tile(expected, (len(MESH.positions), 1)), rtol=1e-6)
    assert np.linalg.norm(expected) == pytest.approx(np.linalg.norm(DRIFT) * np.exp(-alpha * h * count), rel=0.3)


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_motion_does_not_depend_on_where_and_how_the_body_lies(integrator: str, rng: np.random.Generator) -> None:
    ends = []
    Q, _ = np.linalg.qr(rng.normal(size=(3, 3)))
    R, shift = Q * np.linalg.det(Q), np.array([3.0, -2.0, 1.0])
    for turn, move in ((np.eye(3), np.zeros(3)), (R, shift)):
        mesh = TetMesh(MESH.positions @ turn.T + move, MESH.tets)
        simulation = Simulation(
            mesh,
            material=StableNeoHookean(young=1e4, poisson=0.35),
            integrator=integrator,
            solver="ND",
            gravity=tuple(turn @ [0.0, -9.81, 0.0]),
            tolerance=Tolerance(relative=1e-10),
            solver_settings=ROBUST_NEWTON,
            threads=1,
        )
        r = MESH.positions - MESH.positions.mean(axis=0)
        x = (MESH.positions + r @ STRAIN.T) @ turn.T + move
        start_at(simulation, x, (DRIFT + np.cross(SPIN, r)) @ turn.T)
        ends.append((finish(simulation, 15).positions - move) @ turn)
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-8)
