"""Every solver, projection and initial guess goes the same way: they differ by no more than their tolerance."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from qlb import (
    PointForce,
    Pressure,
    Rotation,
    Simulation,
    SolverSettings,
    StableNeoHookean,
    TetMesh,
    TimeExpression,
    TimeTable,
    Tolerance,
    Traction,
)
from qlb.solvers import SOLVERS
from tests.support import Array, left_end, right_end

LENGTH = 1.0
STEPS = 20
MESH = TetMesh.box((LENGTH, 0.25, 0.25), cells=(6, 2, 2))
TWIST = Rotation(axis=(1.0, 0.0, 0.0), origin=(LENGTH, 0.125, 0.125), rate=0.5)
INTEGRATORS = ["BDF1", "BDF2", "SDIRK2", "quasistatic"]
METHODS = {
    "ND always": ("ND", {"projection": "always"}),
    "ND on demand": ("ND", {"projection": "on-demand"}),
    "ND never": ("ND", {"projection": "never"}),
    "QLF": ("QLF", {}),
    "QLF on demand": ("QLF", {"projection": "on-demand"}),
    "QLB": ("QLB", {}),
    "QLB on demand": ("QLB", {"projection": "on-demand"}),
    "QLA": ("QLA", {}),
    "QLA, a factor a solve": ("QLA", {"keep_factor": False}),
    "QLA, not turned": ("QLA", {"carry_factor": False}),
    "QLB window 1": ("QLB", {"window": 1}),
}
DEFAULT = Tolerance()
CLOSE = Tolerance(relative=1e-10)
# In statics |g| is a force: 1e-9 N move the tip of this bar by less than 1e-12 m.
BEST = {"quasistatic": Tolerance(relative=1e-11, absolute=1e-9)}


def slowly(time: float) -> Array:
    """A load that QLF, too, can follow: its factor is of the straight bar."""
    return np.array([0.0, -5.0 * time, 0.0])


def trajectory(
    variant: str,
    integrator: str,
    solver: str,
    tolerance: Tolerance,
    material: StableNeoHookean,
    settings: dict[str, object],
) -> Array:
    """Positions after each step, (steps, n, 3)."""
    simulation = Simulation(
        MESH,
        material=material,
        integrator=integrator,
        solver=solver,
        step=0.01,
        gravity=slowly if integrator == "quasistatic" else (0.0, -9.81, 0.0),
        tolerance=tolerance,
        solver_settings=SolverSettings(**settings),  # type: ignore[arg-type]
        threads=1,
    )
    simulation.pin(left_end(MESH))
    if variant == "twist":
        simulation.move(right_end(MESH), TWIST)
    return np.stack([result.positions for result in simulation.run(STEPS)])


STIFF = StableNeoHookean(young=1e5, poisson=0.45)


@cache
def reference(variant: str, integrator: str) -> Array:
    best = BEST.get(integrator, Tolerance(relative=1e-11, absolute=1e-12))
    return trajectory(variant, integrator, "ND", best, STIFF, {"projection": "on-demand"})


@pytest.mark.parametrize("guess", ["previous", "predictor"])
@pytest.mark.parametrize(("solver", "settings"), METHODS.values(), ids=METHODS)
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("variant", ["drop", "twist"])
def test_trajectories_agree(
    variant: str, integrator: str, solver: str, settings: dict[str, object], guess: str
) -> None:
    # 20 steps, each right to 1e-6 of its own motion, and each carried on by the next.
    for tolerance, accuracy in ((DEFAULT, 1e-6), (CLOSE, 2e-10)):
        found = trajectory(variant, integrator, solver, tolerance, STIFF, settings | {"initial_guess": guess})
        error = np.abs(found - reference(variant, integrator)).max()
        assert error <= accuracy * LENGTH, f"error {error:.2g} m at tolerance {tolerance.relative}"


def under_loads(integrator: str, solver: str, settings: dict[str, object]) -> Array:
    """Positions after each step under a pressure on an open set, a traction and a force, each in time."""
    simulation = Simulation(
        MESH,
        material=STIFF,
        integrator=integrator,
        solver=solver,
        step=0.01,
        gravity=(0.0, 0.0, 0.0),
        tolerance=CLOSE,
        solver_settings=SolverSettings(**{"max_iterations": 3000} | settings),  # type: ignore[arg-type]
        threads=1,
    )
    simulation.pin(left_end(MESH))
    simulation.add(Pressure(MESH.faces_where(lambda x: x[:, 1] > 0.25 - 1e-9), TimeExpression("1e3 * t")))
    simulation.add(Traction(MESH.faces_where(lambda x: x[:, 0] > 1 - 1e-9), TimeTable([0, 1], [[0] * 3, [0, 0, 5e3]])))
    simulation.add(PointForce(right_end(MESH)[:1], lambda t: (-50 * t, 0, 0)))
    return np.stack([result.positions for result in simulation.run(10)])


@cache
def reference_under_loads(integrator: str) -> Array:
    return under_loads(integrator, "ND", {"projection": "on-demand"})


@pytest.mark.parametrize(("solver", "settings"), METHODS.values(), ids=METHODS)
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_trajectories_under_loads_agree(integrator: str, solver: str, settings: dict[str, object]) -> None:
    best = reference_under_loads(integrator)
    assert np.abs(best[-1] - MESH.positions).max() > 5e-4
    np.testing.assert_allclose(under_loads(integrator, solver, settings), best, rtol=0, atol=1e-9 * LENGTH)


@pytest.mark.parametrize("variant", ["drop", "twist"])
@pytest.mark.parametrize("integrator", INTEGRATORS)
def test_the_body_moves_far_enough_to_tell(variant: str, integrator: str) -> None:
    assert np.abs(reference(variant, integrator)[-1] - MESH.positions).max() > 0.01


@pytest.mark.parametrize("solver", SOLVERS)
def test_solvers_agree_on_the_bar_of_the_paper(solver: str) -> None:
    # Soft and nearly incompressible, and bending far.
    soft, settings = StableNeoHookean(young=2e4, poisson=0.49), {"max_iterations": 3000}
    newton = {"projection": "on-demand"}
    best = trajectory("drop", "BDF2", "ND", Tolerance(relative=1e-11, absolute=1e-12), soft, newton)
    found = trajectory("drop", "BDF2", solver, DEFAULT, soft, settings)
    assert np.abs(found - best).max() <= 1e-5 * LENGTH


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_consistent_and_lumped_mass_agree_as_the_mesh_is_refined(integrator: str) -> None:
    differences = []
    for cells in ((6, 2, 2), (12, 4, 4)):
        mesh, tips = TetMesh.box((LENGTH, 0.25, 0.25), cells=cells), []
        for mass in ("lumped", "consistent"):
            simulation = Simulation(mesh, material=STIFF, integrator=integrator, mass=mass, threads=1)  # type: ignore[arg-type]
            simulation.pin(left_end(mesh))
            for _ in simulation.run(10):
                pass
            tips.append(simulation.state.positions[right_end(mesh)].mean(axis=0))
        differences.append(np.linalg.norm(tips[0] - tips[1]))
    assert differences[1] < 0.5 * differences[0]
