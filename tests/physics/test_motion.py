"""Motions with a known answer: waves, symmetry, units."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Simulation, StableNeoHookean, TetMesh, Tolerance
from tests.support import Array, finish, left_end, right_end, start_at


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
@pytest.mark.parametrize(("poisson", "wave_modulus"), [(0.0, 1.0), (0.3, 1.346)])
def test_a_confined_bar_vibrates_with_the_speed_of_sound(poisson: float, wave_modulus: float, mass: str) -> None:
    # u = sin(pi x/2L) cos(pi c t/2L), c^2 = E (1 - nu)/((1 + nu)(1 - 2 nu))/rho: after 2L/c it is turned round.
    young, density, length, amplitude, steps = 1e4, 800.0, 1.0, 1e-3, 200
    mesh = TetMesh.box((length, 0.2, 0.2), cells=(16, 2, 2))
    half_period = 2 * length / np.sqrt(wave_modulus * young / density)
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(young=young, poisson=poisson, density=density),
        integrator="SDIRK2",
        step=half_period / steps,
        gravity=(0.0, 0.0, 0.0),
        mass=mass,  # type: ignore[arg-type]
        threads=1,
    )
    simulation.pin(np.arange(len(mesh.positions)), axes="yz")
    simulation.pin(left_end(mesh), axes="x")
    shape = np.sin(0.5 * np.pi * mesh.positions[:, :1] / length) * [1.0, 0.0, 0.0]
    start_at(simulation, mesh.positions + amplitude * shape)
    middle, end = finish(simulation, steps // 2), finish(simulation, steps - steps // 2)
    tip = right_end(mesh)
    # 16 cells along a quarter wave give the frequency to some 1e-3; strains of 1e-3 are as good as linear.
    assert abs((middle.positions - mesh.positions)[tip, 0].mean()) <= 0.02 * amplitude
    np.testing.assert_allclose((end.positions - mesh.positions)[tip, 0], -amplitude, rtol=0.01)
    assert abs(end.velocities[tip, 0].mean()) <= 0.05 * amplitude * np.pi / half_period


@pytest.mark.parametrize("solver", ["ND", "QLF", "QLB", "QLA"])
def test_a_symmetric_bar_falls_symmetrically(solver: str) -> None:
    mesh = TetMesh.box((1.0, 0.2, 0.2), cells=(6, 2, 2))
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(young=1e5, poisson=0.4),
        solver=solver,
        tolerance=Tolerance(relative=1e-9),
        threads=1,
    )
    simulation.pin(left_end(mesh))
    x = finish(simulation, 15).positions
    mirrored = mesh.positions * [1, 1, -1] + [0, 0, 0.2]
    image = np.linalg.norm(mirrored[:, None] - mesh.positions[None], axis=2).argmin(axis=1)
    assert np.abs(x - mesh.positions).max() > 0.05
    np.testing.assert_allclose(x[image], x * [1, 1, -1] + [0, 0, 0.2], rtol=0, atol=1e-8)


def drop(scale: float, pressure: float, **arguments: object) -> Array:
    """A bar `scale` times as large and heavy as its length asks, of `pressure` times the modulus and density."""
    mesh = TetMesh.box((scale, 0.2 * scale, 0.2 * scale), cells=(4, 1, 1))
    material = StableNeoHookean(young=1e5 * pressure * scale, poisson=0.4, density=1000.0 * pressure)
    # E/(rho g L) is the same, and times go with the square root of lengths.
    simulation = Simulation(mesh, material=material, step=0.01 * np.sqrt(scale), threads=1, **arguments)  # type: ignore[arg-type]
    simulation.pin(left_end(mesh))
    return finish(simulation, 10).positions / scale


@pytest.mark.parametrize(("scale", "pressure"), [(1.0, 1e6), (1.0, 1e-6), (1e-3, 1.0), (100.0, 1.0)])
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2", "quasistatic"])
@pytest.mark.parametrize("solver", ["ND", "QLB", "QLA"])
def test_units_do_not_matter(solver: str, integrator: str, scale: float, pressure: float) -> None:
    expected = drop(1.0, 1.0, solver=solver, integrator=integrator)
    found = drop(scale, pressure, solver=solver, integrator=integrator)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-6)
