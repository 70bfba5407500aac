"""Loads as potentials: their forces against sums over the faces, their derivatives against differences."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import (
    InputError,
    PointForce,
    Pressure,
    Simulation,
    StableNeoHookean,
    TetMesh,
    TimeExpression,
    TimeTable,
    Traction,
    _native,
)
from qlb.energies import Energy, Potential
from qlb.integrators import Stage
from tests.energies.surfaces import Faces, follower_forces, hollow_sphere, near_cavity
from tests.support import Array, dense, difference, make_system, right_end

PRESSURE = 300.0
BOX = TetMesh.box((1.0, 0.5, 0.4), cells=(3, 2, 2))
HOLLOW = hollow_sphere(4, 0.5)
SCALE = 0.7


def potential_of(energy: Energy, mesh: TetMesh, guess: Array, time: float = 0.0) -> Potential:
    stage = Stage(time, 0.1, ((1.0, mesh.positions),), np.zeros_like(mesh.positions))
    system = make_system(mesh, energies=[energy])
    potential = system.terms[-1].at(stage, guess)
    assert potential is not None
    return potential


def forces(potential: Potential, x: Array) -> Array:
    gradient = np.zeros_like(x)
    potential.add_value_gradient(x, SCALE, gradient)
    return -gradient / SCALE


def value(potential: Potential, x: Array) -> float:
    return potential.add_value_gradient(x, SCALE, np.zeros_like(x)) / SCALE


def hessian(potential: Potential, mesh: TetMesh, x: Array, *, project: bool = False) -> Array:
    pattern = make_system(mesh).pattern
    matrix = _native.BlockMatrix(pattern)
    matrix.set_zero(1)
    potential.add_hessian(x, SCALE, project, matrix)
    return dense(matrix, pattern) / SCALE


def deformed(mesh: TetMesh, rng: np.random.Generator) -> Array:
    return mesh.positions @ (np.eye(3) + 0.3 * rng.normal(size=(3, 3))) + 0.05 * rng.normal(size=mesh.positions.shape)


CLOSED = {
    "all faces of a box": (BOX, BOX.boundary_triangles()),
    "the cavity of a sphere": (HOLLOW, HOLLOW.faces_where(near_cavity(0.5))),
    "cavity and outside of a sphere": (HOLLOW, HOLLOW.boundary_triangles()),
}
OPEN = {
    "one end": (BOX, BOX.faces_where(lambda x: x[:, 0] > 1 - 1e-9)),
    "two ends": (BOX, BOX.faces_where(lambda x: np.abs(x[:, 0] - 0.5) > 0.5 - 1e-9)),
    "all but one face": (BOX, BOX.boundary_triangles()[1:]),
    "a single face": (BOX, BOX.boundary_triangles()[5:6]),
    "two faces that meet in a node": (BOX, BOX.boundary_triangles()[[0, 3]]),
    "a ring": (BOX, BOX.faces_where(lambda x: (x[:, 0] > 1e-9) & (x[:, 0] < 1 - 1e-9))),
}


def two_cubes_that_share_an_edge() -> TetMesh:
    box = TetMesh.box((2.0, 2.0, 1.0), cells=(2, 2, 1))
    centre = box.centroids()
    kept = box.tets[(centre[:, 0] < 1) == (centre[:, 1] < 1)]
    used, tets = np.unique(kept, return_inverse=True)
    return TetMesh(box.positions[used], tets.reshape(-1, 4))


TWINS = two_cubes_that_share_an_edge()
# Of the four faces at the edge x = y = 1: three, so that two of them meet and the third has a rim there.
OPEN["three faces at an edge of four"] = (
    TWINS,
    TWINS.faces_where(lambda x: (np.abs(x[:, 0] - 1) < 1e-9) | ((np.abs(x[:, 1] - 1) < 1e-9) & (x[:, 0] < 1))),
)
SURFACES = CLOSED | OPEN


@pytest.mark.parametrize(("mesh", "faces"), SURFACES.values(), ids=SURFACES)
def test_forces_at_the_guess_are_a_third_of_each_area_vector_times_the_pressure(
    mesh: TetMesh, faces: Faces, rng: np.random.Generator
) -> None:
    x = deformed(mesh, rng)
    expected = follower_forces(x, faces, PRESSURE)
    found = forces(potential_of(Pressure(faces, PRESSURE), mesh, x), x)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-13 * np.abs(expected).max())


@pytest.mark.parametrize(("mesh", "faces"), CLOSED.values(), ids=CLOSED)
def test_forces_on_a_closed_set_follow_it_whatever_the_guess(
    mesh: TetMesh, faces: Faces, rng: np.random.Generator
) -> None:
    guess, x = deformed(mesh, rng), deformed(mesh, rng)
    expected = follower_forces(x, faces, PRESSURE)
    found = forces(potential_of(Pressure(faces, PRESSURE), mesh, guess), x)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


@pytest.mark.parametrize(("mesh", "faces"), OPEN.values(), ids=OPEN)
def test_forces_on_an_open_set_follow_it_to_first_order_only_at_the_guess(
    mesh: TetMesh, faces: Faces, rng: np.random.Generator
) -> None:
    guess, away = deformed(mesh, rng), rng.normal(size=mesh.positions.shape)
    potential = potential_of(Pressure(faces, PRESSURE), mesh, guess)
    errors = []
    for step in (1e-2, 1e-3):
        x = guess + step * away
        errors.append(np.abs(forces(potential, x) - follower_forces(x, faces, PRESSURE)).max())
    assert errors[0] == pytest.approx(10 * errors[1], rel=0.2)
    assert errors[1] > 0


@pytest.mark.parametrize(("mesh", "faces"), SURFACES.values(), ids=SURFACES)
def test_forces_are_minus_the_differences_of_the_value(mesh: TetMesh, faces: Faces, rng: np.random.Generator) -> None:
    potential = potential_of(Pressure(faces, PRESSURE), mesh, deformed(mesh, rng))
    x, u = deformed(mesh, rng), rng.normal(size=mesh.positions.shape)
    # The value is cubic in x: differences of order 4 have rounding only.
    slope = difference(lambda y: np.array(value(potential, y)), x, u, 0.1)
    assert -np.sum(forces(potential, x) * u) == pytest.approx(float(slope), rel=1e-8)


@pytest.mark.parametrize(("mesh", "faces"), SURFACES.values(), ids=SURFACES)
def test_the_hessian_is_the_differences_of_the_gradient(mesh: TetMesh, faces: Faces, rng: np.random.Generator) -> None:
    potential = potential_of(Pressure(faces, PRESSURE), mesh, deformed(mesh, rng))
    x, u = deformed(mesh, rng), rng.normal(size=mesh.positions.shape)
    expected = difference(lambda y: -forces(potential, y), x, u, 0.1)
    found = (hessian(potential, mesh, x) @ u.ravel()).reshape(-1, 3)
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-8 * np.abs(expected).max())


@pytest.mark.parametrize("pressure", [PRESSURE, -PRESSURE])
def test_the_projected_hessian_is_positive_semidefinite(pressure: float, rng: np.random.Generator) -> None:
    x = deformed(BOX, rng)
    potential = potential_of(Pressure(BOX.boundary_triangles(), pressure), BOX, x)
    assert np.linalg.eigvalsh(hessian(potential, BOX, x)).min() < -1.0
    assert np.linalg.eigvalsh(hessian(potential, BOX, x, project=True)).min() >= 0.0


@pytest.mark.parametrize(("mesh", "faces"), CLOSED.values(), ids=CLOSED)
def test_a_closed_surface_feels_no_force_and_no_torque_as_a_whole(
    mesh: TetMesh, faces: Faces, rng: np.random.Generator
) -> None:
    x = deformed(mesh, rng) + 3.0
    found = forces(potential_of(Pressure(faces, PRESSURE), mesh, mesh.positions), x)
    scale = np.abs(found).sum()
    np.testing.assert_allclose(found.sum(axis=0), 0.0, atol=1e-13 * scale)
    np.testing.assert_allclose(np.cross(x, found).sum(axis=0), 0.0, atol=1e-12 * scale)


def test_the_value_of_a_closed_surface_is_pressure_times_volume(rng: np.random.Generator) -> None:
    x = deformed(BOX, rng)
    potential = potential_of(Pressure(BOX.boundary_triangles(), PRESSURE), BOX, BOX.positions)
    volume = np.linalg.det(np.moveaxis(x[BOX.tets[:, 1:]] - x[BOX.tets[:, :1]], 1, 2)).sum() / 6
    assert value(potential, x) == pytest.approx(PRESSURE * volume, rel=1e-12)
    cavity = HOLLOW.faces_where(near_cavity(0.5))  # the body lies outside of it
    inside = value(potential_of(Pressure(cavity, PRESSURE), HOLLOW, HOLLOW.positions), 1.1 * HOLLOW.positions)
    assert inside < -0.4 * PRESSURE * 4 / 3 * np.pi * 0.55**3


def test_pressure_pushes_against_the_surface_whatever_the_order_of_its_nodes(rng: np.random.Generator) -> None:
    faces = BOX.faces_where(lambda x: x[:, 0] > 1 - 1e-9)
    shuffled = np.array([rng.permutation(face) for face in faces])
    for given in (faces, shuffled, shuffled[::-1].tolist()):
        found = forces(potential_of(Pressure(given, PRESSURE), BOX, BOX.positions), BOX.positions)
        np.testing.assert_allclose(found.sum(axis=0), [-PRESSURE * 0.2, 0.0, 0.0], atol=1e-12)


def test_traction_sums_to_area_times_traction(rng: np.random.Generator) -> None:
    faces, traction = BOX.faces_where(lambda x: x[:, 0] > 1 - 1e-9), np.array([10.0, -20.0, 30.0])
    potential = potential_of(Traction(faces, traction), BOX, BOX.positions)
    for x in (BOX.positions, deformed(BOX, rng)):  # it is a dead load
        found = forces(potential, x)
        np.testing.assert_allclose(found.sum(axis=0), 0.5 * 0.4 * traction, rtol=1e-13)
        np.testing.assert_array_equal(found[BOX.positions[:, 0] < 1 - 1e-9], 0.0)
    moved = deformed(BOX, rng)
    work = np.sum(forces(potential, moved) * (moved - BOX.positions))
    assert value(potential, moved) == pytest.approx(-work, rel=1e-12)
    corner = np.argmax(BOX.positions.sum(axis=1))
    area = [0.5 * np.linalg.norm(np.cross(*(BOX.positions[f[1:]] - BOX.positions[f[0]]))) for f in faces if corner in f]
    np.testing.assert_allclose(forces(potential, moved)[corner], sum(area) / 3 * traction, rtol=1e-13)


TIMES = {
    "a function": lambda t: 100.0 * t,
    "an expression": TimeExpression("100 * t"),
    "a table": TimeTable([0, 2], [0, 200]),
}


@pytest.mark.parametrize("pressure", TIMES.values(), ids=TIMES)
def test_pressures_change_with_time(pressure: object) -> None:
    faces = BOX.boundary_triangles()
    for time in (0.5, 1.25):
        found = forces(potential_of(Pressure(faces, pressure), BOX, BOX.positions, time), BOX.positions)  # type: ignore[arg-type]
        expected = follower_forces(BOX.positions, faces, 100 * time)
        np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12)


def test_forces_on_nodes_change_with_time_and_may_differ() -> None:
    nodes = [7, 2]
    each = np.array([[1.0, 2.0, 3.0], [4.0, 5.0, 6.0]])
    for force, at_half in (
        ((1.0, 2.0, 3.0), each[[0, 0]]),
        (each, each),
        (TimeExpression(["2 * t", 2, "6 * t"]), each[[0, 0]]),
        (TimeTable([0, 1], [(0, 0, 0), (2, 4, 6)]), each[[0, 0]]),
        (lambda t: 2 * t * each, each),
    ):
        found = forces(potential_of(PointForce(nodes, force), BOX, BOX.positions, 0.5), BOX.positions)  # type: ignore[arg-type]
        np.testing.assert_allclose(found[nodes], at_half, rtol=1e-14)
        np.testing.assert_array_equal(np.delete(found, nodes, axis=0), 0.0)


FACES = BOX.boundary_triangles()
ABSENT = [[0, 1, len(BOX.positions) - 1]]
REFUSED = {
    "no faces": (Pressure(FACES[:0], 1.0), r"faces of Pressure have shape \(0, 3\), must be \(k, 3\) with k >= 1"),
    "edges": (Pressure(FACES[:, :2], 1.0), r"faces of Pressure have shape \(\d+, 2\)"),
    "inside": (Traction(ABSENT, (1.0, 0.0, 0.0)), r"face 0 of Traction, .* is not on the mesh's surface"),
    "twice": (Pressure([*FACES.tolist(), FACES[3, ::-1].tolist()], 1.0), "face 3 of Pressure, .* more than once"),
    "out of range": (Pressure([[0, 1, 99]], 1.0), r"face 0 of Pressure names node 99, must be in \[0, 35\]"),
    "a mask": (PointForce([True, False], (1.0, 0.0, 0.0)), "nodes of PointForce .* must be integers"),
    "no nodes": (PointForce(np.empty(0, dtype=int), (1.0, 0.0, 0.0)), "PointForce: the selection is empty"),
    "a node twice": (PointForce([3, 1, 3], (1.0, 0.0, 0.0)), "node 3 of PointForce is given more than once"),
    "pressure vector": (Pressure(FACES, (1.0, 2.0, 3.0)), r"pressure has shape \(3,\), must be one number"),
    "pressure nan": (Pressure(FACES, np.nan), "pressure is nan, must be finite"),
    "pressure text": (Pressure(FACES, "high"), "pressure = 'high' is not an array of numbers"),
    "traction number": (Traction(FACES, 3.0), r"traction has shape \(\), must be \(3,\)"),
    "force shape": (PointForce([1, 2], np.ones((3, 3))), r"point force has shape \(3, 3\), must be \(3,\) or \(2, 3\)"),
}


@pytest.mark.parametrize(("energy", "message"), REFUSED.values(), ids=REFUSED)
def test_a_load_that_does_not_fit_is_refused_when_it_is_added(energy: Energy, message: str) -> None:
    with pytest.raises(InputError, match=message):
        Simulation(BOX, material=StableNeoHookean()).add(energy)


@pytest.mark.parametrize(
    ("energy", "message"),
    [
        (Pressure(FACES, lambda t: None), "pressure at time 0.01 s"),
        (Pressure(FACES, TimeExpression("1 / (t - t)")), "pressure at time 0.01 s is inf, must be finite"),
        (Traction(FACES, lambda t: (t, t)), r"traction at time 0.01 s has shape \(2,\), must be \(3,\)"),
        (PointForce([1], TimeExpression("t")), r"point force at time 0.01 s has shape \(\)"),
    ],
)
def test_a_wrong_value_in_time_is_refused_at_its_time(energy: Energy, message: str) -> None:
    simulation = Simulation(BOX, material=StableNeoHookean(), integrator="BDF1", threads=1)
    simulation.add(energy)
    before = simulation.state
    with pytest.raises(InputError, match=message):
        simulation.advance()
    assert simulation.state is before


def test_loads_cannot_be_added_after_the_first_step() -> None:
    simulation = Simulation(BOX, material=StableNeoHookean(), threads=1)
    simulation.advance()
    with pytest.raises(InputError, match="cannot add energies after the first step"):
        simulation.add(PointForce(right_end(BOX), (1.0, 0.0, 0.0)))
