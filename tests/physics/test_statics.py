"""Equilibria against closed forms and beam theory."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from qlb import Damping, Simulation, StableNeoHookean, State, TetMesh, Tolerance
from qlb.integrators import INTEGRATORS
from qlb.solvers import SOLVERS
from qlb.system import HeldNodes, StageProblem
from qlb.timing import Timer
from tests.support import (
    ROBUST_NEWTON,
    Array,
    boundary_nodes,
    elastic_gradient,
    finish,
    fitted_slope,
    jittered,
    left_end,
    make_system,
    right_end,
    start_at,
)

AFFINE = np.array([[1.3, 0.2, 0.0], [0.1, 0.8, 0.1], [0.0, -0.2, 1.1]])
SHIFT = np.array([1.0, 2.0, 3.0])


def affine(anchors: Array, time: float) -> Array:
    return anchors + time * (anchors @ AFFINE.T + SHIFT - anchors)


@pytest.mark.parametrize(("solver", "accuracy"), [("ND", 1e-10), ("QLB", 1e-8), ("QLF", 1e-8), ("QLA", 1e-8)])
@pytest.mark.parametrize("poisson", [0.0, 0.4])
def test_patch(solver: str, accuracy: float, poisson: float, rng: np.random.Generator) -> None:
    # An affine motion of the boundary makes the whole body affine, on any mesh and from any start.
    mesh = jittered(TetMesh.box((1.0, 1.0, 1.0), cells=(4, 4, 4)), rng, 0.2)
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(young=1e4, poisson=poisson),
        integrator="quasistatic",
        solver=solver,
        step=1.0,
        gravity=(0.0, 0.0, 0.0),
        tolerance=Tolerance(relative=1e-11),
        solver_settings=ROBUST_NEWTON,
        threads=1,
    )
    simulation.move(boundary_nodes(mesh), affine)
    inner = np.setdiff1d(np.arange(len(mesh.positions)), boundary_nodes(mesh))
    assert len(inner) == 27
    x = mesh.positions.copy()
    x[inner] += 0.03 * rng.normal(size=(len(inner), 3))
    start_at(simulation, x)
    result = simulation.advance()
    np.testing.assert_allclose(result.positions, mesh.positions @ AFFINE.T + SHIFT, rtol=0, atol=accuracy)


def free_side_stretch(s: float, nu: float, young: float) -> tuple[float, float]:
    """Side stretch q and axial stress P11 of a bar stretched by s whose sides are free, from eq. 14 of the paper.

    P22 = 0: mu (1 - 1/(s^2 + 2 q^2 + 1)) + lambda (s q^2 - alpha) s = 0, which grows with q.
    """
    mu_lame, lambda_lame = young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))
    mu, lam = 4 / 3 * mu_lame, lambda_lame + 5 / 6 * mu_lame
    alpha = 1 + 0.75 * mu / lam
    low, high = 0.0, 3.0
    for _ in range(200):
        q = 0.5 * (low + high)
        a = mu * (1 - 1 / (s**2 + 2 * q**2 + 1))
        low, high = (q, high) if a + lam * (s * q**2 - alpha) * s < 0 else (low, q)
    return q, a * s + lam * (s * q**2 - alpha) * q**2


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("stretch", [0.6, 1.5, 2.5])
def test_uniaxial_stretch_on_rollers(stretch: float, poisson: float, rng: np.random.Generator) -> None:
    young, size = 1e4, (1.0, 0.5, 0.4)
    mesh = jittered(TetMesh.box(size, cells=(4, 3, 3)), rng, 0.2)
    X, held = mesh.positions, HeldNodes(len(mesh.positions))
    for axis, name in enumerate("xyz"):
        held.hold(np.flatnonzero(axis_at_zero(X, axis)), X, axes=name)
    held.hold(right_end(mesh), X, lambda a, t: a * [1 + t * (stretch - 1), 1, 1], axes="x")
    system = make_system(mesh, StableNeoHookean(young=young, poisson=poisson), gravity=(0.0, 0.0, 0.0), held=held)
    solver = SOLVERS["ND"](system, ROBUST_NEWTON, Tolerance(relative=1e-11))
    state = State(0.0, X, np.zeros_like(X))
    for _ in range(4):
        stage = next(INTEGRATORS["quasistatic"]().step(state, 0.25))
        result = solver.minimise(StageProblem(system, stage, state, Timer()))
        assert result.reason.converged
        state = State(stage.time, result.positions, np.zeros_like(X))
    side, stress = free_side_stretch(stretch, poisson, young)
    np.testing.assert_allclose(state.positions, X * [stretch, side, side], rtol=0, atol=1e-10)
    pull = elastic_gradient(system, state.positions)[right_end(mesh), 0].sum()
    assert pull == pytest.approx(stress * size[1] * size[2], rel=1e-8)


def axis_at_zero(x: Array, axis: int) -> Array:
    return x[:, axis] < 1e-9


LENGTH, SIDE, YOUNG, DENSITY, GRAVITY = 1.0, 0.2, 1e6, 1000.0, 1e-2


def timoshenko(nu: float) -> float:
    """Tip deflection under its own weight: w L^4/(8 E I) + w L^2/(2 k G A), k of Cowper (1966) for a rectangle."""
    area, inertia = SIDE**2, SIDE**4 / 12
    w, G, k = DENSITY * GRAVITY * area, YOUNG / (2 * (1 + nu)), 10 * (1 + nu) / (12 + 11 * nu)
    return w * LENGTH**4 / (8 * YOUNG * inertia) + w * LENGTH**2 / (2 * k * G * area)


@cache
def tip_deflection(n: int, nu: float) -> float:
    """Mean drop of the free end with n times (10, 2, 2) cells; the strain is 1.5e-4 at most."""
    mesh = TetMesh.box((LENGTH, SIDE, SIDE), cells=(10 * n, 2 * n, 2 * n))
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(young=YOUNG, poisson=nu, density=DENSITY),
        integrator="quasistatic",
        solver="ND",
        step=1.0,
        gravity=(0.0, -GRAVITY, 0.0),
    )
    simulation.pin(left_end(mesh))
    simulation.advance()
    return float((mesh.positions - simulation.state.positions)[right_end(mesh), 1].mean())


# A clamp that also stops the sides from contracting stiffens a bar with nu > 0, by the order of side/length times nu^2.
@pytest.mark.parametrize(("nu", "accuracy"), [(0.0, 0.01), (0.3, 0.03)])
def test_cantilever_bends_as_beam_theory_says(nu: float, accuracy: float) -> None:
    # Linear tets err by h^2, which the two finest meshes tell apart from the limit (Richardson).
    coarse, fine = tip_deflection(3, nu), tip_deflection(4, nu)
    limit = (16 * fine - 9 * coarse) / 7
    assert limit == pytest.approx(timoshenko(nu), rel=accuracy)
    assert fine < limit


def test_cantilever_converges_with_order_two() -> None:
    cells = np.array([2, 3, 4])
    errors = timoshenko(0.0) - np.array([tip_deflection(int(n), 0.0) for n in cells])
    slope = fitted_slope(1 / cells, errors)
    assert 1.6 <= slope <= 2.3, f"order {slope:.2f}"


def test_a_small_load_is_in_proportion() -> None:
    # A hundredth of the load bends a hundredth as far, to the order of the strain, 1e-4.
    mesh = TetMesh.box((LENGTH, SIDE, SIDE), cells=(10, 2, 2))
    drops = []
    for gravity in (GRAVITY, GRAVITY / 100):
        simulation = Simulation(
            mesh,
            material=StableNeoHookean(young=YOUNG, poisson=0.3),
            integrator="quasistatic",
            solver="ND",
            gravity=(0.0, -gravity, 0.0),
            threads=1,
        )
        simulation.pin(left_end(mesh))
        simulation.advance()
        drops.append((mesh.positions - simulation.state.positions)[right_end(mesh), 1].mean())
    assert drops[0] / drops[1] == pytest.approx(100, rel=1e-3)


def hanging(integrator: str, **arguments: object) -> Simulation:
    mesh = TetMesh.box((1.0, 0.25, 0.25), cells=(8, 2, 2))
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(young=2e5, poisson=0.3),
        integrator=integrator,
        solver="ND",
        solver_settings=ROBUST_NEWTON,
        threads=1,
        **arguments,  # type: ignore[arg-type]
    )
    simulation.pin(left_end(mesh))
    return simulation


@pytest.mark.parametrize(("integrator", "damping"), [("BDF1", 0.0), ("BDF1", 20.0), ("SDIRK2", 20.0)])
def test_a_damped_motion_ends_in_the_static_equilibrium(integrator: str, damping: float) -> None:
    static = hanging("quasistatic", step=1.0)
    static.advance()
    assert np.abs(static.state.positions - static.mesh.positions).max() > 0.5
    moving = hanging(integrator, step=0.5, damping=Damping(mass=damping))
    finish(moving, 40)
    np.testing.assert_allclose(moving.state.positions, static.state.positions, rtol=0, atol=1e-6)


def test_an_equilibrium_does_not_depend_on_the_path_of_loading() -> None:
    ends = []
    for steps in (1, 4, 10):
        simulation = hanging("quasistatic", step=1 / steps, gravity=lambda t: np.array([0.0, -9.81 * t, 0.0]))
        ends.append(finish(simulation, steps).positions)
    for end in ends[1:]:
        np.testing.assert_allclose(end, ends[0], rtol=0, atol=1e-6)


def test_reactions_carry_the_weight() -> None:
    simulation = hanging("quasistatic", step=1.0, tolerance=Tolerance(relative=1e-10))
    simulation.advance()
    system, state, held = simulation.system, simulation.state, left_end(simulation.mesh)
    weight = system.gravity.forces(0.0)
    reactions = (elastic_gradient(system, state.positions) - weight)[held]
    total = DENSITY * 0.0625 * 9.81
    np.testing.assert_allclose(reactions.sum(axis=0), [0.0, total, 0.0], rtol=0, atol=1e-7 * total)
    # And their moments balance too, about the origin.
    moment = np.cross(state.positions[held], reactions).sum(axis=0) + np.cross(state.positions, weight).sum(axis=0)
    np.testing.assert_allclose(moment, 0.0, atol=1e-7 * total)


def test_quasistatics_knows_no_mass_damping() -> None:
    ends = [finish(hanging("quasistatic", step=1.0, damping=Damping(mass=alpha)), 1).positions for alpha in (0.0, 50.0)]
    np.testing.assert_array_equal(ends[0], ends[1])
