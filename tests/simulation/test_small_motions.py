"""Motions and loads so small that the energy is lost in its rounding: solves must converge all the same."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Simulation, StableNeoHookean, TetMesh
from tests.support import Array, left_end, right_end

MESH = TetMesh.box((0.75, 0.25, 0.25), cells=(8, 3, 3))


def bar(**arguments: object) -> Simulation:
    defaults: dict[str, object] = {"material": StableNeoHookean(young=1e5, poisson=0.45), "threads": 1}
    simulation = Simulation(MESH, **(defaults | arguments))  # type: ignore[arg-type]
    simulation.pin(left_end(MESH))
    return simulation


@pytest.mark.parametrize("solver", ["ND", "QLB"])
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
@pytest.mark.parametrize("h", [1e-2, 1e-4])
def test_a_load_that_sets_in_smoothly_is_followed_from_rest(h: float, integrator: str, solver: str) -> None:
    simulation = bar(
        integrator=integrator,
        solver=solver,
        step=h,
        gravity=lambda time: np.array([0.0, -2.0 * (1 - np.cos(3 * time)), 0.0]),
    )
    assert all(result.converged for result in simulation.run(20))


@pytest.mark.parametrize("solver", ["ND", "QLB"])
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_a_scripted_end_that_sets_off_smoothly_is_followed_from_rest(integrator: str, solver: str) -> None:
    simulation = bar(integrator=integrator, solver=solver, step=1e-3, gravity=(0.0, 0.0, 0.0))
    simulation.move(right_end(MESH), lambda x, t: x + np.array([0.0, 0.01 * (1 - np.cos(10 * t)), 0.0]))
    assert all(result.converged for result in simulation.run(20))


@pytest.mark.parametrize("solver", ["ND", "QLB"])
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2", "quasistatic"])
@pytest.mark.parametrize("gravity", [1e-2, 1e-6])
def test_a_tiny_load_moves_the_bar_in_proportion(gravity: float, integrator: str, solver: str) -> None:
    def drop(g: float) -> Array:
        simulation = bar(integrator=integrator, solver=solver, gravity=(0.0, -g, 0.0), step=0.02)
        for _ in simulation.run(3):
            pass
        return (simulation.state.positions - MESH.positions)[right_end(MESH)]

    tiny, small = drop(gravity), drop(10 * gravity)
    # Strains below 1e-3 are linear to as much; and positions near 1 m hold displacements to 1e-16 m.
    np.testing.assert_allclose(10 * tiny, small, rtol=0, atol=5e-3 * np.abs(small).max() + 1e-14)


@pytest.mark.parametrize("solver", ["ND", "QLB"])
def test_a_bar_that_has_come_to_rest_stays_there(solver: str) -> None:
    simulation = bar(integrator="BDF1", solver=solver, step=0.5, mass_damping=20.0)
    for _ in simulation.run(30):
        pass
    resting = simulation.state.positions
    for result in simulation.run(5):
        assert result.converged
    np.testing.assert_allclose(simulation.state.positions, resting, rtol=0, atol=1e-6)
