"""Energies and momentum against the mass matrix, rigid motion, and what an undamped run may lose."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.sparse import csr_matrix

import qlb
from qlb.analysis import Constitution, Snapshot
from qlb.system.system import mass_matrix
from tests.support import left_end, small_bar, start_at


def energy_over_time(simulation: qlb.Simulation, steps: int) -> list:
    constitution = Constitution.of(simulation)
    states = [Snapshot.of(simulation, constitution).energies]
    return states + [Snapshot.of(simulation, constitution).energies for _ in simulation.run(steps)]


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_kinetic_energy_and_momentum_are_those_of_the_mass_matrix(mass, rng):
    mesh = small_bar()
    material = qlb.StableNeoHookean(density="1000 * (1 + x)")
    simulation = qlb.Simulation(mesh, material=material, mass=mass, threads=1)
    x = mesh.positions + 0.02 * rng.normal(size=mesh.positions.shape)
    v = rng.normal(size=x.shape)
    state = Snapshot.of(start_at(simulation, x, v))
    density = 1000 * (1 + mesh.centroids()[:, 0])
    begin, columns, values = mass_matrix(mesh, density * mesh.volumes(), mass)
    M = csr_matrix((values, columns, begin))
    assert state.energies.kinetic == pytest.approx(0.5 * np.sum(v * (M @ v)), rel=1e-12)
    np.testing.assert_allclose(state.linear_momentum, (M @ v).sum(axis=0), rtol=1e-12)
    about = np.array([0.3, -1.0, 2.0])
    np.testing.assert_allclose(state.angular_momentum(about), np.cross(x - about, M @ v).sum(axis=0), rtol=1e-10)
    np.testing.assert_allclose(state.constitution.node_mass, simulation.system.mass, rtol=1e-12)


def test_a_box_that_spins_has_the_inertia_of_a_box():
    mesh = small_bar()  # 0.75 x 0.25 x 0.25 m of 1000 kg/m^3; linear shape functions hold a rotation exactly
    simulation = qlb.Simulation(mesh, material=qlb.StableNeoHookean(), mass="consistent", threads=1)
    centre, spin = mesh.positions.mean(axis=0), np.array([0.5, 2.0, -1.0])
    v = np.cross(spin, mesh.positions - centre) + np.array([3.0, 0, 0])
    state = Snapshot.of(start_at(simulation, mesh.positions, v))
    m, a, b = 1000 * 0.75 * 0.25**2, 0.75**2, 0.25**2
    inertia = m / 12 * np.array([2 * b, a + b, a + b])
    np.testing.assert_allclose(state.angular_momentum(centre), inertia * spin, rtol=1e-12)
    np.testing.assert_allclose(state.linear_momentum, [3 * m, 0, 0], atol=1e-10)
    assert state.energies.kinetic == pytest.approx(0.5 * m * 9 + 0.5 * spin @ (inertia * spin), rel=1e-12)


def test_the_balance_of_an_undamped_swing_closes_to_the_loss_of_sdirk2():
    # What a method of order 2 loses of a smooth swing goes with h^3 at least.
    lost = []
    for steps in (20, 40, 80):
        mesh = small_bar()
        simulation = qlb.Simulation(
            mesh,
            material=qlb.StableNeoHookean(young=1e5, poisson=0.4),
            integrator="SDIRK2",
            step=0.2 / steps,
            tolerance=qlb.Tolerance(relative=1e-10),
            threads=1,
        )
        simulation.pin(left_end(mesh))
        states = energy_over_time(simulation, steps)
        totals = np.array([state.total for state in states])
        scale = max(state.elastic for state in states)
        assert scale > 0.1
        assert states[0].total == 0
        assert np.abs(totals).max() < 0.01 * scale
        lost.append(-totals[-1] / scale)
    assert lost[2] > 0
    assert lost[0] > 4 * lost[1] > 16 * lost[2]


def test_the_balance_closes_over_a_bounce():
    # Without friction: what falls is given back, but for the loss of the integrator, and contact holds some on the way.
    cube = qlb.Body(
        qlb.TetMesh.box((0.1, 0.1, 0.1), cells=(2, 2, 2)),
        qlb.StableNeoHookean(young=1e5, poisson=0.3),
        placement=qlb.Placement(translation=(0, 0.02, 0)),
    )
    ground = qlb.Plane((0, 0, 0), (0, 1, 0))
    contact = qlb.Contact(dhat=5e-3)
    simulation = qlb.Simulation(
        cube, obstacles=[ground], contact=contact, integrator="SDIRK2", step=5e-4, solver="ND", threads=1
    )
    states = energy_over_time(simulation, 300)
    before, after = states[0].total, states[-1].total
    fallen = before - min(state.gravity for state in states)
    assert max(state.contact for state in states) > 0.1 * fallen
    assert states[-1].contact == 0
    assert -0.03 * fallen < after - before < 1e-3 * fallen


def test_loads_and_gravity_in_time():
    # A dead load f on one node moved by u has -f.u; gravity g on a body of mass m moved by u has -m g.u.
    mesh = small_bar()
    simulation = qlb.Simulation(
        mesh, material=qlb.StableNeoHookean(), gravity=lambda time: np.array([0, -2.0 * time, 0]), threads=1
    )
    simulation.add(qlb.PointForce([3], lambda time: (0.0, 0.0, 5.0 + time)))
    start_at(simulation, mesh.positions + np.array([0, 0.5, 0.1]))
    simulation.restore(qlb.State(2.0, simulation.state.positions, simulation.state.velocities), 0, {})
    energies = Snapshot.of(simulation).energies
    assert energies.loads == pytest.approx(-0.7)
    assert energies.gravity == pytest.approx(1000 * 0.75 * 0.25**2 * 4.0 * 0.5)
    assert energies.kinetic == 0
    assert energies.elastic == pytest.approx(0, abs=1e-10)
    assert energies.total == pytest.approx(energies.loads + energies.gravity)
