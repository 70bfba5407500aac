"""Motions and loads so small that the energy is lost in its rounding: solves must converge all the same."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Damping, Simulation, SolverSettings, StableNeoHookean, TetMesh
from tests.support import Array, left_end, right_end

MESH = TetMesh.box((0.75, 0.25, 0.25), cells=(8, 3, 3))


def bar(**arguments: object) -> Simulation:
    defaults: dict[str, object] = {"material": StableNeoHookean(young=1e5, poisson=0.45), "threads": 1}
    simulation = Simulation(MESH, **(defaults | arguments))  # type: ignore[arg-type]
    simulation.pin(left_end(MESH))
    return simulation


@pytest.mark.parametrize("solver", ["ND", "QLB", "QLA"])
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


@pytest.mark.parametrize("solver", ["ND", "QLB", "QLA"])
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_a_scripted_end_that_sets_off_smoothly_is_followed_from_rest(integrator: str, solver: str) -> None:
    simulation = bar(integrator=integrator, solver=solver, step=1e-3, gravity=(0.0, 0.0, 0.0))
    simulation.move(right_end(MESH), lambda x, t: x + np.array([0.0, 0.01 * (1 - np.cos(10 * t)), 0.0]))
    assert all(result.converged for result in simulation.run(20))


@pytest.mark.parametrize("solver", ["ND", "QLB", "QLA"])
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


@pytest.mark.parametrize("solver", ["ND", "QLB", "QLA"])
def test_a_bar_that_has_come_to_rest_stays_there(solver: str) -> None:
    simulation = bar(integrator="BDF1", solver=solver, step=0.5, damping=Damping(mass=20.0))
    for _ in simulation.run(30):
        pass
    resting = simulation.state.positions
    for result in simulation.run(5):
        assert result.converged
    np.testing.assert_allclose(simulation.state.positions, resting, rtol=0, atol=1e-6)


@pytest.mark.parametrize("solver", ["ND", "QLB", "QLA"])
@pytest.mark.parametrize("poisson", [0.3, 0.49, 0.4999])
def test_an_equilibrium_under_a_constant_load_is_found_again(poisson: float, solver: str) -> None:
    # From the second step on |g(x_k)| is nothing but what the first has left.
    material = StableNeoHookean(young=1e5, poisson=poisson)
    simulation = bar(integrator="quasistatic", solver=solver, material=material, gravity=(0.0, -0.1, 0.0))
    first = simulation.advance().positions
    for _ in simulation.run(4):
        pass
    np.testing.assert_allclose(simulation.state.positions, first, rtol=0, atol=1e-7)


@pytest.mark.parametrize("solver", ["ND", "QLB", "QLA"])
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2", "quasistatic"])
def test_a_light_load_moves_a_nearly_incompressible_body(integrator: str, solver: str) -> None:
    # Rounding of the positions alone makes forces of eps |K||x|, K here 1700 times Young's modulus: with 6144 tets
    # 1e-8 N, where the load is 1e-3 N. What is left of it must not keep a solve from ending.
    mesh = TetMesh.box((0.75, 0.25, 0.25), cells=(16, 8, 8))
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(young=1e5, poisson=0.4999),
        integrator=integrator,
        solver=solver,
        gravity=(0.0, -1e-4, 0.0),
        solver_settings=SolverSettings(max_iterations=60),
    )
    simulation.pin(left_end(mesh))
    assert all(result.converged for result in simulation.run(3))
    assert (simulation.state.positions - mesh.positions)[right_end(mesh), 1].max() < 0
