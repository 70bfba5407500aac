"""Contact and friction against laws of mechanics."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Body, Contact, ContactPair, Damping, Obstacle, Plane, TetMesh, Tolerance, Translation
from tests.contact.scenes import (
    BY_GRADIENT,
    SOFT,
    SOLVERS,
    UP,
    block,
    box_surface,
    checked,
    contact_forces,
    finish_checked,
    simulate,
)
from tests.support import Array, mechanical_energy, random_rotation

G = 9.81
DHAT = 2e-3


def on_incline(kind: str, angle: float, mu: float, solver: str, **given):
    """A block lying on a slope, given by turned gravity, a turned plane, or a turned plate; and the way down."""
    low, rotation = -0.05 - 0.98 * DHAT, (0.0, 0.0, angle)
    down, normal = np.array([np.cos(angle), np.sin(angle), 0]), np.array([-np.sin(angle), np.cos(angle), 0])
    ground: Plane | Obstacle
    if kind == "gravity":
        rotation, down, normal = (0.0, 0.0, 0.0), np.array([1.0, 0, 0]), np.array([0.0, 1.0, 0])
    if kind == "plate":
        x, triangles = box_surface((6.0, 0.2, 1.0), (1.0, low - 0.1, 0.0))
        ground = Obstacle(np.outer(x[:, 0], down) + np.outer(x[:, 1], normal) + x[:, [2]] * [0, 0, 1], triangles)
    else:
        ground = Plane(tuple(low * normal), tuple(normal))
    gravity = (-G * np.sin(angle), -G * np.cos(angle), 0.0) if kind == "gravity" else (0.0, -G, 0.0)
    contact = Contact(dhat=DHAT, friction=mu)
    return simulate(block(rotation=rotation), ground, gravity=gravity, contact=contact, solver=solver, **given), down


def speed_along(simulation, way: Array) -> float:
    mass = simulation.system.mass[:, None]
    return float((mass * simulation.state.velocities).sum(axis=0) @ way / mass.sum())


INCLINES = ["gravity", pytest.param("plane", marks=pytest.mark.slow), pytest.param("plate", marks=pytest.mark.slow)]


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", INCLINES)
def test_a_block_slides_down_an_incline_with_coulombs_acceleration(kind, solver):
    angle, mu = 0.5, 0.3
    simulation, way = on_incline(kind, angle, mu, solver, tolerance=BY_GRADIENT)
    speeds = [speed_along(simulation, way) for _ in checked(simulation, 30)]
    slope = np.polyfit(0.01 * np.arange(10, 30), speeds[10:], 1)[0]
    assert slope == pytest.approx(-G * (np.sin(angle) - mu * np.cos(angle)), rel=0.01)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", INCLINES)
def test_a_block_stays_on_an_incline(kind, solver):
    angle = 0.4
    simulation, way = on_incline(kind, angle, 1.1 * np.tan(angle), solver, tolerance=BY_GRADIENT)
    start = simulation.state.positions
    states = [start, *(result.positions for result in checked(simulation, 30))]
    body, creep = simulation.nodes_of(0), simulation.system.contact.friction_velocity
    assert np.abs((states[30] - start)[body] @ way).max() < 1e-3  # it sways when it is let go
    assert np.abs((states[30] - states[10])[body] @ way).max() < 0.2 * creep


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_default_tolerance_keeps_friction_within_a_tenth(solver):
    """|p| <= dhat/100 is a large part of how far this light block presses into the reach of contact."""
    angle, mu = 0.5, 0.3
    simulation, way = on_incline("plane", angle, mu, solver)
    speeds = [speed_along(simulation, way) for _ in checked(simulation, 30)]
    slope = np.polyfit(0.01 * np.arange(10, 30), speeds[10:], 1)[0]
    assert slope == pytest.approx(-G * (np.sin(angle) - mu * np.cos(angle)), rel=0.1)


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", ["plane", "plate"])
def test_the_ground_bears_the_weight(kind, solver):
    simulation, _ = on_incline(
        kind, 0.0, 0.3, solver, integrator="BDF1", damping=Damping(mass=20.0), tolerance=BY_GRADIENT
    )
    result = finish_checked(simulation, 40)
    n = len(simulation.mesh.positions)
    force, weight = contact_forces(simulation, result), G * simulation.system.mass.sum()
    np.testing.assert_allclose(force[:n].sum(axis=0), [0, weight, 0], atol=1e-4 * weight)
    if kind == "plate":  # which has nodes of its own
        np.testing.assert_allclose(force[n:].sum(axis=0), [0, -weight, 0], atol=1e-4 * weight)


def momenta(simulation) -> tuple[Array, Array]:
    m, state = simulation.system.mass[:, None], simulation.state
    return (m * state.velocities).sum(axis=0), np.cross(state.positions, m * state.velocities).sum(axis=0)


def colliding(solver: str, mu: float = 0.0, **given):
    """Two blocks that meet off-centre and obliquely."""
    a = block((0.2, 0.2, 0.2), (-0.15, 0.0, 0.0), cells=(2, 2, 2), velocity=(1.0, 0, 0), name="a")
    b = block((0.2, 0.2, 0.2), (0.15, 0.11, 0.04), cells=(2, 2, 2), rotation=(0.2, 0.3, 0.4), velocity=(-1.0, 0, 0))
    contact = Contact(dhat=5e-3, friction=mu)
    return simulate([a, b], solver=solver, gravity=(0, 0, 0), contact=contact, **({"tolerance": BY_GRADIENT} | given))


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("mu", [0.0, 0.5])
def test_a_collision_keeps_momentum(mu, solver):
    simulation = colliding(solver, mu)
    before, spin = momenta(simulation)
    energy = kinetic = mechanical_energy(simulation)
    scale, touched, torques = float(np.sum(simulation.system.mass)), 0, []
    for result in checked(simulation, 25):
        x, force = result.positions, contact_forces(simulation, result)
        touched = max(touched, result.solves[-1].contact.count)
        size = np.abs(force).sum()
        assert np.abs(force.sum(axis=0)).max() <= 1e-12 * size
        torques.append(np.abs(np.cross(x, force).sum(axis=0)).max() / max(size, 1e-300))
        after, _ = momenta(simulation)
        np.testing.assert_allclose(after, before, atol=1e-7 * scale)
        assert mechanical_energy(simulation) <= energy * (1 + 1e-6)
    assert touched > 0
    assert max(torques) < 1e-12 + mu * 5e-3  # friction acts on both sides of a gap of up to dhat
    _, end = momenta(simulation)
    assert np.linalg.norm(end - spin) < 0.02 * scale * 0.1
    assert kinetic * 0.2 < mechanical_energy(simulation) < kinetic
    n = len(simulation.nodes_of(0))
    assert simulation.state.velocities[:n, 0].mean() < 0.7  # it was hit


@pytest.mark.parametrize("solver", SOLVERS)
def test_angular_momentum_changes_only_as_the_integrator_says(solver):
    """BDF1 changes it by h sum of m v_{k+1} x v_k in a step, with or without contact."""
    simulation = colliding(solver, integrator="BDF1", step=5e-3)
    m, scale = simulation.system.mass[:, None], 0.1 * float(np.sum(simulation.system.mass))
    before, (_, spin) = simulation.state, momenta(simulation)
    for result in simulation.run(25):
        _, after = momenta(simulation)
        expected = simulation.step * np.cross(result.velocities, m * before.velocities).sum(axis=0)
        np.testing.assert_allclose(after - spin, expected, atol=1e-7 * scale)
        before, spin = simulation.state, after


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", ["plane", "plate"])
def test_a_moving_ground_drags_a_block_along(kind, solver):
    """At mu g until it moves with the ground."""
    mu, speed, low = 0.4, 0.5, -0.05 - 0.98 * DHAT
    motion = Translation((speed, 0.0, 0.0))
    ground: Plane | Obstacle = Plane((0, low, 0), UP, motion=motion)
    if kind == "plate":
        ground = Obstacle(*box_surface((2.0, 0.2, 1.0), (0.5, low - 0.1, 0.0)), motion=motion)
    contact = Contact(dhat=DHAT, friction=mu)
    tolerance = Tolerance(relative=1e-5, step=0.0)
    simulation = simulate(block(), ground, solver=solver, contact=contact, tolerance=tolerance)
    speeds, body = [], len(simulation.mesh.positions)
    for result in checked(simulation, 25):
        speeds.append(speed_along(simulation, np.array([1.0, 0, 0])))
        force = contact_forces(simulation, result)
        if result.step <= 10:
            assert force[:body, 0].sum() == pytest.approx(mu * force[:body, 1].sum(), rel=0.02)
        if kind == "plate":
            assert np.abs(force.sum(axis=0)).max() < 1e-9 * np.abs(force).sum()
    assert np.polyfit(0.01 * np.arange(2, 10), speeds[2:10], 1)[0] == pytest.approx(mu * G, rel=0.03)
    assert speeds[-1] == pytest.approx(speed, rel=0.02)


@pytest.mark.parametrize("solver", SOLVERS)
def test_friction_is_that_of_the_pair(solver):
    """Two blocks on one slope: the one with friction stays, the other slides as if there were none."""
    angle = 0.4
    gravity = (-G * np.sin(angle), -G * np.cos(angle), 0.0)
    bodies = [block(at=(0.0, 0.0, z), name=name) for z, name in ((-0.3, "holds"), (0.3, "slides"))]
    pairs = [ContactPair(between=("holds", "ground"), friction=0.8), ContactPair(between=("slides", "ground"))]
    contact = Contact(dhat=DHAT, pairs=pairs)
    ground = Plane((0, -0.05 - 0.98 * DHAT, 0), UP, name="ground")
    simulation = simulate(bodies, ground, solver=solver, gravity=gravity, contact=contact, tolerance=BY_GRADIENT)
    finish_checked(simulation, 20)
    speeds = [simulation.state.velocities[simulation.nodes_of(name), 0].mean() for name in ("holds", "slides")]
    assert abs(speeds[0]) < 5e-3
    assert speeds[1] == pytest.approx(-G * np.sin(angle) * 0.2, rel=0.01)


def moved(values, turn: Array, by: Array) -> tuple[float, float, float]:
    return tuple((turn @ np.asarray(values) + by).tolist())


@pytest.mark.parametrize(("mu", "solver"), [(0.0, "ND"), (0.0, "QLB"), (0.4, "ND")])
def test_a_scene_turned_and_shifted_does_the_same(mu, solver, rng):
    """A block that lands on one edge on a plane, beside a plate."""
    turn, by = random_rotation(rng), np.array([3.0, -2.0, 5.0])
    body = block((0.2, 0.2, 0.2), rotation=(0.3, 0.2, 0.6), material=SOFT, cells=(2, 2, 2))
    side = body.placed.positions[:, 0].min() - 6e-3
    plate, ends = box_surface((0.1, 0.6, 0.6), (side - 0.05, 0.0, 0.0)), []
    for R, d in ((np.eye(3), np.zeros(3)), (turn, by)):
        mesh = TetMesh(body.placed.positions @ R.T + d, body.mesh.tets)
        low = body.placed.positions[:, 1].min() - 6e-3
        simulation = simulate(
            Body(mesh, SOFT, velocity=moved((-1.0, -1.0, 0.5), R, np.zeros(3))),
            Plane(moved((0, low, 0), R, d), moved(UP, R, np.zeros(3))),
            Obstacle(plate[0] @ R.T + d, plate[1]),
            solver=solver,
            gravity=moved((0, -G, 0), R, np.zeros(3)),
            contact=Contact(dhat=5e-3, friction=mu),
            tolerance=BY_GRADIENT,
        )
        contacts = [result.solves[-1].contact.count for result in checked(simulation, 12)]
        ends.append((simulation.state.positions - d) @ R)
    assert max(contacts) > 3
    np.testing.assert_allclose(ends[1], ends[0], atol=1e-5)
