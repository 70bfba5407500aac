"""Bodies under pressure, traction and forces against closed forms, and the follower load after a solve."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from qlb import PointForce, Pressure, Simulation, StableNeoHookean, TetMesh, Tolerance, Traction
from qlb.system import StageProblem
from qlb.timing import Timer
from tests.energies.surfaces import follower_forces, hollow_sphere, near_cavity
from tests.physics.test_statics import free_side_stretch
from tests.support import (
    ROBUST_NEWTON,
    Array,
    elastic_gradient,
    finish,
    jittered,
    left_end,
    right_end,
    small_bar,
)

NOTHING = (0.0, 0.0, 0.0)
SIZE = (1.0, 0.5, 0.4)
CLOSE = Tolerance(relative=1e-8, scaled=0.0)


def static(mesh: TetMesh, material: StableNeoHookean, **arguments: object) -> Simulation:
    defaults = {
        "integrator": "quasistatic",
        "solver": "ND",
        "step": 1.0,
        "gravity": NOTHING,
        "tolerance": Tolerance(relative=1e-10),
        "solver_settings": ROBUST_NEWTON,
        "threads": 1,
    }
    return Simulation(mesh, material=material, **(defaults | arguments))  # type: ignore[arg-type]


def on_rollers(simulation: Simulation) -> Simulation:
    """Held at the planes x, y, z = 0, each along its normal: free to grow and shrink."""
    for axis, name in enumerate("xyz"):
        simulation.pin(np.flatnonzero(np.abs(simulation.mesh.positions[:, axis]) < 1e-9), axes=name)
    return simulation


def far_faces(mesh: TetMesh, axes: str = "xyz") -> Array:
    """Those at the far ends of a box along `axes`."""
    columns, high = ["xyz".index(axis) for axis in axes], mesh.positions.max(axis=0)
    return mesh.faces_where(lambda x: (x[:, columns] > high[columns] - 1e-9).any(axis=1))  # type: ignore[return-value]


# The follower load


def bending_pressure(mesh: TetMesh) -> Pressure:
    top = mesh.faces_where(lambda x: x[:, 1] > 0.25 - 1e-9)
    return Pressure(top, lambda t: 40.0 * t)


def follower_residual(simulation: Simulation, x: Array, pressure: Pressure, time: float) -> float:
    """|f| over the free nodes [N], the load of the pressure written down a second time."""
    p = pressure.pressure(time)  # type: ignore[operator,misc]
    total = follower_forces(x, np.asarray(pressure.faces), p) - elastic_gradient(simulation.system, x)
    return float(np.linalg.norm(simulation.system.clear_held(total)))


@pytest.mark.parametrize("solver", ["ND", "QLB"])
def test_in_statics_a_pressure_on_an_open_set_follows_the_surface_it_has_bent(solver: str) -> None:
    mesh = small_bar((6, 2, 2))
    simulation = static(mesh, StableNeoHookean(young=5e3, poisson=0.3), solver=solver, step=0.5, tolerance=CLOSE)
    simulation.pin(left_end(mesh))
    pressure = bending_pressure(mesh)
    simulation.add(pressure)
    for result in simulation.run(4):
        [solve] = result.solves
        residual = follower_residual(simulation, result.positions, pressure, result.time)
        # The solve ends with what is lagged taken at a point from which it did not move any more.
        assert residual <= 1e-8 * solve.reference
    assert np.abs(result.positions - mesh.positions).max() > 0.2


def test_without_taking_what_is_lagged_anew_it_would_not_follow() -> None:
    mesh = small_bar((6, 2, 2))
    simulation = static(mesh, StableNeoHookean(young=5e3, poisson=0.3), tolerance=CLOSE)
    simulation.pin(left_end(mesh))
    pressure = bending_pressure(mesh)
    simulation.add(pressure)
    stage = next(simulation.integrator.step(simulation.state, 1.0))
    problem = StageProblem(simulation.system, stage, simulation.state, Timer())
    once, often = simulation.solver.minimise(problem), simulation.solver.solve(problem)
    assert once.reason.converged
    assert often.reason.converged
    assert follower_residual(simulation, once.positions, pressure, 1.0) > 1e-3 * once.reference
    assert follower_residual(simulation, often.positions, pressure, 1.0) <= 1e-8 * once.reference
    assert often.iterations > once.iterations


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_in_motion_what_is_lagged_errs_less_with_the_step(integrator: str) -> None:
    mesh = small_bar()
    missing = []
    for step in (4e-3, 2e-3):
        simulation = Simulation(
            mesh,
            material=StableNeoHookean(young=5e3, poisson=0.3),
            integrator=integrator,
            step=step,
            gravity=NOTHING,
            tolerance=Tolerance(relative=1e-10),
            threads=1,
        )
        simulation.pin(left_end(mesh))
        faces = mesh.faces_where(lambda x: x[:, 1] > 0.25 - 1e-9)
        simulation.add(Pressure(faces, 100.0))
        state = finish(simulation, round(0.1 / step))
        stage = next(simulation.integrator.step(state, step))
        problem = StageProblem(simulation.system, stage, state, Timer())
        x = simulation.solver.minimise(problem).positions
        anew = StageProblem(simulation.system, stage, state, Timer(), x)
        change = problem.value_gradient(x)[1] - anew.value_gradient(x)[1]
        missing.append(np.abs(change).max() / problem.force_scale)
    assert missing[1] < 0.3 * missing[0]


# Closed forms


@pytest.mark.parametrize("poisson", [0.0, 0.3, 0.49])
@pytest.mark.parametrize("stretch", [0.7, 1.5])
def test_uniaxial_traction(stretch: float, poisson: float, rng: np.random.Generator) -> None:
    # A traction is a nominal stress: P11 of the closed form stretches the bar by just as much.
    side, stress = free_side_stretch(stretch, poisson, 1e4)
    mesh = jittered(TetMesh.box(SIZE, cells=(4, 3, 3)), rng, 0.2)
    simulation = on_rollers(static(mesh, StableNeoHookean(young=1e4, poisson=poisson), step=0.25))
    simulation.add(Traction(far_faces(mesh, "x"), lambda t: (stress * min(1.0, t), 0.0, 0.0)))
    finish(simulation, 5)
    expected = mesh.positions * [stretch, side, side]
    np.testing.assert_allclose(simulation.state.positions, expected, rtol=0, atol=1e-8)


@pytest.mark.parametrize("load", ["traction", "pressure"])
def test_a_small_uniaxial_load_strains_by_its_share_of_young_s_modulus(load: str) -> None:
    young, poisson, stress = 1e4, 0.3, 1e-2
    mesh = TetMesh.box(SIZE, cells=(3, 2, 2))
    simulation = on_rollers(static(mesh, StableNeoHookean(young=young, poisson=poisson)))
    faces = far_faces(mesh, "x")
    simulation.add(Traction(faces, (stress, 0.0, 0.0)) if load == "traction" else Pressure(faces, -stress))
    strain = simulation.advance().positions / np.where(mesh.positions > 0, mesh.positions, np.inf)
    strain = strain[np.argmax(mesh.positions.sum(axis=1))] - 1
    np.testing.assert_allclose(strain, stress / young * np.array([1, -poisson, -poisson]), rtol=1e-4)


def hydrostatic_pressure(s: float, young: float, nu: float) -> float:
    """p at F = s 1: dpsi/ds = -p d(s^3)/ds with psi of eq. 14 of Smith, de Goes, Kim 2018."""
    mu_lame, lambda_lame = young / (2 * (1 + nu)), young * nu / ((1 + nu) * (1 - 2 * nu))
    mu, lam = 4 / 3 * mu_lame, lambda_lame + 5 / 6 * mu_lame
    alpha = 1 + 0.75 * mu / lam
    slope = 3 * mu * s + 3 * lam * (s**3 - alpha) * s**2 - 3 * mu * s / (3 * s**2 + 1)
    return -slope / (3 * s**2)


@pytest.mark.parametrize("closed", [True, False], ids=["all faces", "far faces"])
@pytest.mark.parametrize(("stretch", "poisson"), [(0.8, 0.3), (0.8, 0.45), (1.2, 0.3)])
def test_finite_hydrostatic_pressure(stretch: float, poisson: float, closed: bool, rng: np.random.Generator) -> None:
    mesh = jittered(TetMesh.box(SIZE, cells=(4, 3, 3)), rng, 0.2)
    pressure = hydrostatic_pressure(stretch, 1e4, poisson)
    assert (pressure > 0) == (stretch < 1)
    simulation = on_rollers(static(mesh, StableNeoHookean(young=1e4, poisson=poisson), step=0.25))
    faces = mesh.boundary_triangles() if closed else far_faces(mesh)
    simulation.add(Pressure(faces, lambda t: pressure * min(1.0, t)))
    finish(simulation, 5)
    np.testing.assert_allclose(simulation.state.positions, stretch * mesh.positions, rtol=0, atol=1e-8)


INNER, OUTER, YOUNG, POISSON, INSIDE = 0.5, 1.0, 1e6, 0.3, 1e3


def lame(r: float) -> float:
    """Radial displacement of a sphere with pressure in its cavity (Lame; Timoshenko, Goodier 1970, art. 136)."""
    ratio = INSIDE * INNER**3 / (OUTER**3 - INNER**3)
    return ratio * r / YOUNG * ((1 - 2 * POISSON) + (1 + POISSON) / 2 * (OUTER / r) ** 3)


@cache
def inflated(cells: int, eighth: bool) -> tuple[TetMesh, Array]:
    mesh = hollow_sphere(cells, INNER, eighth=eighth)
    simulation = on_rollers(static(mesh, StableNeoHookean(young=YOUNG, poisson=POISSON)))
    simulation.add(Pressure(mesh.faces_where(near_cavity(INNER)), INSIDE))
    return mesh, simulation.advance().positions - mesh.positions


def growth(cells: int, radius: float) -> float:
    """Mean radial displacement of the nodes at `radius`."""
    mesh, moved = inflated(cells, eighth=True)
    at = np.abs(np.linalg.norm(mesh.positions, axis=1) - radius) < 1e-9
    return float(np.mean(np.sum(moved[at] * mesh.positions[at], axis=1) / radius))


def test_a_cavity_inflates_as_lame_says() -> None:
    for radius in (INNER, OUTER):
        coarse, fine = (growth(cells, radius) / lame(radius) - 1 for cells in (6, 12))
        assert abs(fine) < 0.03, f"at {radius} m: off by {coarse:.3f}, {fine:.3f}"
        assert abs(fine) < 0.4 * abs(coarse), f"at {radius} m: off by {coarse:.3f}, {fine:.3f}"
        limit = (4 * fine - coarse) / 3  # linear tets err by h^2
        assert abs(limit) < 0.01, f"at {radius} m: limit off by {limit:.4f}"


def test_the_closed_cavity_of_the_whole_sphere_inflates_as_the_open_one_of_its_eighth() -> None:
    whole, moved = inflated(8, eighth=False)
    part, moved_part = inflated(4, eighth=True)
    for x, u in zip(part.positions, moved_part, strict=True):
        i = np.argmin(np.abs(whole.positions - x).sum(axis=1))
        np.testing.assert_allclose(moved[i], u, rtol=0, atol=1e-8 * lame(INNER))


# Work and energy


def test_a_dead_load_that_grows_in_statics_does_the_work_that_is_stored() -> None:
    mesh, steps = small_bar((4, 1, 1)), 40
    simulation = static(mesh, StableNeoHookean(young=5e3, poisson=0.3), step=1 / steps)
    simulation.pin(left_end(mesh))
    corner, faces = [int(right_end(mesh)[0])], mesh.faces_where(lambda x: x[:, 0] > 0.75 - 1e-9)
    force, traction = np.array([0.0, 1.0, -0.5]), np.array([0.0, -100.0, 20.0])
    simulation.add(PointForce(corner, lambda t: t * force))
    simulation.add(Traction(faces, lambda t: t * traction))
    share = np.zeros(len(mesh.positions))
    for face in faces:
        share[face] += 0.5 * np.linalg.norm(np.cross(*(mesh.positions[face[1:]] - mesh.positions[face[0]]))) / 3
    forces = np.outer(share, traction)
    forces[corner] += force
    work, last = 0.0, mesh.positions
    for result in simulation.run(steps):
        work += np.sum((result.time - 0.5 / steps) * forces * (result.positions - last))  # trapezoids
        last = result.positions
    assert np.abs(last - mesh.positions).max() > 0.1
    assert work == pytest.approx(simulation.system.elastic.value(last), rel=1e-3)


def swing(load: str) -> float:
    """Largest change of kinetic, elastic and load energy together, in units of the largest elastic energy."""
    mesh = small_bar((4, 1, 1))
    simulation = Simulation(
        mesh,
        material=StableNeoHookean(young=1e4, poisson=0.3),
        integrator="SDIRK2",
        step=2.5e-3,
        gravity=NOTHING,
        tolerance=Tolerance(relative=1e-9),
        threads=1,
    )
    simulation.pin(left_end(mesh))
    traction, pressure = np.array([0.0, -150.0, 0.0]), 2e3
    faces = mesh.faces_where(lambda x: x[:, 0] > 0.75 - 1e-9)
    simulation.add(Traction(faces, traction) if load == "traction" else Pressure(mesh.boundary_triangles(), pressure))
    totals, elastic, state = [], [], simulation.state
    for _ in range(101):
        x, v = state.positions, state.velocities
        corners = x[mesh.tets]
        volume = np.linalg.det(corners[:, 1:] - corners[:, :1]).sum() / 6
        moved = (x - mesh.positions)[faces].mean(axis=1)  # each face carries an equal share
        potential = -float(moved.mean(axis=0) @ traction) * 0.25**2 if load == "traction" else pressure * volume
        elastic.append(simulation.system.elastic.value(x))
        totals.append(0.5 * float(simulation.system.mass @ np.sum(v**2, axis=1)) + elastic[-1] + potential)
        state = finish(simulation, 1)
    return float(np.abs(np.array(totals) - totals[0]).max() / max(elastic))


@pytest.mark.parametrize("load", ["traction", "pressure"])
def test_energy_is_kept_under_a_load_that_has_a_potential(load: str) -> None:
    assert swing(load) < 0.02
