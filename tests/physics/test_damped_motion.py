"""Motions under damping with a known answer: what decays, how fast, and what is kept."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from qlb import Damping, LinearElastic, Simulation, StableNeoHookean, TetMesh, Tolerance
from qlb.system import System
from tests.physics.test_free_body import TIME, angular_momentum, momentum, spinning
from tests.support import Array, dense, elastic_hessian, finish, fitted_slope, left_end, start_at

YOUNG, DENSITY, LENGTH = 1e4, 800.0, 1.0


def linear_bar(
    damping: Damping, *, poisson: float = 0.0, axes: str = "", mass: str = "lumped", **arguments: object
) -> Simulation:
    """Held at its left end, and everywhere along `axes`."""
    mesh = TetMesh.box((LENGTH, 0.2, 0.2), cells=(8, 1, 1))
    simulation = Simulation(
        mesh,
        material=LinearElastic(young=YOUNG, poisson=poisson, density=DENSITY),
        integrator="SDIRK2",
        gravity=(0.0, 0.0, 0.0),
        mass=mass,  # type: ignore[arg-type]
        damping=damping,
        threads=1,
        **arguments,  # type: ignore[arg-type]
    )
    if axes:
        simulation.pin(np.setdiff1d(np.arange(len(mesh.positions)), left_end(mesh)), axes=axes)
    simulation.pin(left_end(mesh))
    return simulation


def mode(system: System, number: int) -> tuple[float, Array]:
    """Angular frequency [1/s] and shape (n, 3), of unit mass, of an undamped free vibration of the mesh."""
    free = system.held.fixed.ravel() == 0
    K = dense(elastic_hessian(system, system.mesh.positions, project=False), system.pattern)[np.ix_(free, free)]
    root = np.sqrt(np.repeat(system.mass, 3)[free])
    values, vectors = np.linalg.eigh(K / np.outer(root, root))
    shape = np.zeros(free.shape)
    shape[free] = vectors[:, number] / root
    return float(np.sqrt(values[number])), shape.reshape(-1, 3)


def amplitudes(simulation: Simulation, omega: float, shape: Array, size: float, steps: int, periods: float) -> Array:
    """How much of `shape` is in the motion after each step; let go at `size` times it, at rest."""
    mesh, system = simulation.mesh, simulation.system
    simulation.step = 2 * np.pi * periods / (omega * steps)
    start_at(simulation, mesh.positions + size * shape)
    weights = system.mass[:, None] * shape
    found = [float(np.sum(weights * (result.positions - mesh.positions))) for result in simulation.run(steps)]
    return np.array([1.0, *(np.array(found) / size)])


def decaying(omega: float, rate: float, times: Array) -> Array:
    """q'' + 2 rate q' + omega^2 q = 0, q(0) = 1, q'(0) = 0."""
    damped = np.sqrt(omega**2 - rate**2)
    return np.exp(-rate * times) * (np.cos(damped * times) + rate / damped * np.sin(damped * times))


# nu = 0: the stress is 2 mu eps and the viscous one 2 eta deps/dt, so the damping matrix is (eta/mu) K.
RATES = {
    "mass": (lambda omega, rate: Damping(mass=2 * rate)),
    "stiffness": (lambda omega, rate: Damping(stiffness=2 * rate / omega**2)),
    "viscosity": (lambda omega, rate: Damping(viscosity=2 * rate / omega**2 * YOUNG / 2)),
}


@pytest.mark.parametrize("number", [0, 3])
@pytest.mark.parametrize("kind", [*RATES, "all"])
def test_a_mode_decays_at_the_rate_of_its_damping(kind: str, number: int) -> None:
    omega, shape = mode(linear_bar(Damping()).system, number)
    rate, periods, steps = 0.05 * omega, 3.0, 300
    parts = [RATES[k](omega, rate / (3 if kind == "all" else 1)) for k in RATES if kind in (k, "all")]
    damping = Damping(**{k: sum(getattr(d, k) for d in parts) for k in RATES})
    found = amplitudes(linear_bar(damping), omega, shape, 1e-5 / np.abs(shape).max(), steps, periods)
    times = np.linspace(0, 2 * np.pi * periods / omega, steps + 1)
    np.testing.assert_allclose(found, decaying(omega, rate, times), rtol=0, atol=2e-3)
    assert np.abs(found[-50:]).max() < 0.5


def test_stretching_decays_by_viscosity_at_its_own_rate() -> None:
    # Confined: sigma = (lambda + 2 mu) eps + 2 eta deps/dt, so the rate is eta omega^2/(lambda + 2 mu) whatever nu is;
    # the wave u = sin(pi x/2L) has omega = pi/2L sqrt((lambda + 2 mu)/rho).
    poisson = 0.3
    modulus = YOUNG * (1 - poisson) / ((1 + poisson) * (1 - 2 * poisson))
    omega = np.pi / (2 * LENGTH) * np.sqrt(modulus / DENSITY)
    rate, periods, steps = 0.05 * omega, 3.0, 300
    simulation = linear_bar(Damping(viscosity=rate * modulus / omega**2), poisson=poisson, axes="yz")
    mesh = simulation.mesh
    shape = np.sin(0.5 * np.pi * mesh.positions[:, :1] / LENGTH) * [1.0, 0.0, 0.0]
    shape /= np.sqrt(np.sum(simulation.system.mass[:, None] * shape**2))
    found = amplitudes(simulation, omega, shape, 1e-5, steps, periods)
    peaks = found[[100, 200, 300]]
    np.testing.assert_allclose(peaks, np.exp(-rate * 2 * np.pi / omega * np.arange(1, 4)), rtol=0.01)


DAMPINGS = {
    "stiffness": Damping(stiffness=0.01),
    "viscosity": Damping(viscosity=50.0),
    "viscosity of a part": Damping(viscosity="200 * (x > 0.3)"),
}


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.parametrize("damping", DAMPINGS.values(), ids=DAMPINGS)
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_momentum_is_kept(integrator: str, damping: Damping, mass: str) -> None:
    simulation = spinning(integrator, 50, mass=mass, damping=damping)
    before = momentum(simulation)
    finish(simulation, 50)
    np.testing.assert_allclose(momentum(simulation), before, rtol=0, atol=1e-10 * np.linalg.norm(before))


@cache
def drifts(integrator: str, viscosity: float) -> list[float]:
    """How much of the angular momentum is lost with 200, 400 and 800 steps."""
    found = []
    for count in (200, 400, 800):
        simulation = spinning(integrator, count, damping=Damping(viscosity=viscosity))
        before = angular_momentum(simulation)
        finish(simulation, count)
        found.append(float(np.linalg.norm(angular_momentum(simulation) - before) / np.linalg.norm(before)))
    return found


@pytest.mark.parametrize(("integrator", "order"), [("BDF1", 0.9), ("BDF2", 1.85), ("SDIRK2", 1.8)])
def test_viscosity_keeps_angular_momentum_to_the_order_of_the_integrator(integrator: str, order: float) -> None:
    measured = drifts(integrator, 50.0)
    slope = fitted_slope(TIME / np.array([200.0, 400.0, 800.0]), np.array(measured))
    assert order <= slope <= order + 0.5, f"order {slope:.2f}, drifts {measured}"


def spun(damping: Damping, integrator: str, spin: float, steps: int, step: float) -> tuple[Simulation, list[float]]:
    """A block that turns about its axis, and its kinetic energy after each step."""
    mesh = TetMesh.box((0.4, 0.4, 0.2), cells=(2, 2, 1))
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(young=1e4, poisson=0.3),
        integrator=integrator,
        gravity=(0.0, 0.0, 0.0),
        step=step,
        damping=damping,
        tolerance=Tolerance(relative=1e-9),
        threads=1,
    )
    r = mesh.positions - mesh.positions.mean(axis=0)
    start_at(simulation, mesh.positions, np.cross([0.0, 0.0, spin], r))
    mass = simulation.system.mass[:, None]
    return simulation, [0.5 * float(np.sum(mass * r.velocities**2)) for r in simulation.run(steps)]


def test_viscosity_lets_a_settled_spin_go_on() -> None:
    # At first it takes the energy of breathing; once the body has settled in its centrifugal stretch it takes nothing.
    spin, step = 4.0, 0.005
    damped, energies = spun(Damping(viscosity=300.0), "BDF2", spin, 400, step)
    free = spun(Damping(), "BDF2", spin, 400, step)[1]
    assert np.ptp(free[200:]) > 0.03 * free[0]
    assert np.ptp(energies[200:]) < 1e-4 * energies[0]
    state = damped.state
    r = state.positions - state.positions.mean(axis=0)
    L = damped.system.mass @ np.cross(r, state.velocities)
    inertia = float(damped.system.mass @ np.sum(r[:, :2] ** 2, axis=1))
    np.testing.assert_allclose(state.velocities, np.cross([0, 0, L[2] / inertia], r), atol=2e-4 * spin)
    start = damped.mesh.positions - damped.mesh.positions.mean(axis=0)
    before = spin * float(damped.system.mass @ np.sum(start[:, :2] ** 2, axis=1))
    assert L[2] == pytest.approx(before, rel=1e-3)


@pytest.mark.parametrize("damping", [Damping(mass=2.0), *DAMPINGS.values()], ids=["mass", *DAMPINGS])
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_energy_only_falls_and_faster_than_without(integrator: str, damping: Damping) -> None:
    def energies(damping: Damping) -> Array:
        simulation = spinning(integrator, 100, damping=damping)
        mass, elastic = simulation.system.mass[:, None], simulation.system.elastic

        def energy(x: Array, v: Array) -> float:
            return 0.5 * float(np.sum(mass * v**2)) + elastic.value(x)

        found = [energy(simulation.state.positions, simulation.state.velocities)]
        found += [energy(result.positions, result.velocities) for result in simulation.run(100)]
        return np.array(found)

    damped, free = energies(damping), energies(Damping())
    assert np.diff(damped).max() <= 1e-9 * damped[0]
    assert damped[-1] < free[-1] - 0.01 * free[0]
