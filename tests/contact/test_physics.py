"""Contact and friction against laws of mechanics."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Body, Contact, Damping, LinearElastic, Obstacle, Plane, Tolerance, Translation, shapes
from tests.contact.scenes import ALL_SOLVERS, BY_GRADIENT, STIFF, UP, block, box_surface, checked, contact_forces
from tests.contact.scenes import finish_checked, simulate
from tests.support import Array

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


@pytest.mark.parametrize("solver", ALL_SOLVERS)
@pytest.mark.parametrize("kind", ["gravity", "plane", "plate"])
def test_a_block_slides_down_an_incline_with_coulombs_acceleration(kind, solver):
    angle, mu = 0.5, 0.3
    simulation, way = on_incline(kind, angle, mu, solver)
    speeds = [speed_along(simulation, way) for _ in checked(simulation, 30)]
    slope = np.polyfit(0.01 * np.arange(10, 30), speeds[10:], 1)[0]
    assert slope == pytest.approx(-G * (np.sin(angle) - mu * np.cos(angle)), rel=0.01)


@pytest.mark.parametrize("solver", ALL_SOLVERS)
@pytest.mark.parametrize("kind", ["gravity", "plane", "plate"])
def test_a_block_stays_on_an_incline(kind, solver):
    angle = 0.4
    simulation, way = on_incline(kind, angle, 1.1 * np.tan(angle), solver)
    start = simulation.state.positions
    speeds = [speed_along(simulation, way) for _ in checked(simulation, 30)]
    assert np.abs(speeds[5:]).max() < simulation.system.contact.friction_velocity
    assert np.abs((simulation.state.positions - start)[: len(simulation.mesh.positions)] @ way).max() < 1e-3
