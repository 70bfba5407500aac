"""Mass matrices against closed forms; inertia's value and gradient against finite differences."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import StableNeoHookean, TetMesh, _native
from qlb.system import System
from tests.support import Array, dense, difference, jittered, make_system

SIZE = np.array([1.0, 0.6, 0.4])
DENSITY = 1200.0


@pytest.fixture(params=["lumped", "consistent"])
def system(request: pytest.FixtureRequest, rng: np.random.Generator) -> System:
    mesh = jittered(TetMesh.box(tuple(SIZE), cells=(3, 3, 2)), rng, 0.2)
    return make_system(mesh, StableNeoHookean(density=DENSITY), mass=request.param)


def mass_matrix(system: System) -> Array:
    """The dense node mass matrix (n, n), from the Hessian of the inertia."""
    matrix = _native.BlockMatrix(system.pattern)
    system.inertia.add_hessian(1.0, matrix)
    full = dense(matrix, system.pattern).reshape(system.nodes, 3, system.nodes, 3)
    for a in range(3):
        for b in range(3):
            expected = full[:, 0, :, 0] if a == b else 0.0
            np.testing.assert_array_equal(full[:, a, :, b], np.broadcast_to(expected, full[:, 0, :, 0].shape))
    return full[:, 0, :, 0]


def test_total_mass_is_density_times_volume(system: System) -> None:
    total = DENSITY * SIZE.prod()
    assert system.mass.sum() == pytest.approx(total, rel=1e-13)
    assert mass_matrix(system).sum() == pytest.approx(total, rel=1e-13)


def test_node_masses_are_the_row_sums(system: System) -> None:
    np.testing.assert_allclose(mass_matrix(system).sum(axis=1), system.mass, rtol=1e-13)


def test_mass_matrix_is_positive_definite(system: System) -> None:
    assert np.linalg.eigvalsh(mass_matrix(system))[0] > 0


def test_lumping_keeps_the_row_sums(rng: np.random.Generator) -> None:
    mesh = jittered(TetMesh.box(cells=(3, 3, 3)), rng, 0.2)
    masses = [make_system(mesh, mass=kind).mass for kind in ("lumped", "consistent")]
    np.testing.assert_allclose(masses[0], masses[1], rtol=1e-13)


def test_density_of_each_element_counts(rng: np.random.Generator) -> None:
    mesh = TetMesh.box(cells=(2, 2, 2))
    density = rng.uniform(500, 2000, len(mesh.tets))
    expected = np.zeros(len(mesh.positions))
    for e, tet in enumerate(mesh.tets):
        expected[tet] += density[e] * mesh.volumes()[e] / 4
    for kind in ("lumped", "consistent"):
        np.testing.assert_allclose(
            make_system(mesh, StableNeoHookean(density=density), mass=kind).mass, expected, rtol=1e-13
        )


def test_consistent_mass_is_exact_for_linear_fields(rng: np.random.Generator) -> None:
    # Integral of |a + B x|^2 over a box: V (|a + B centre|^2 + sum_j |B e_j|^2 L_j^2 / 12)
    mesh = jittered(TetMesh.box(tuple(SIZE), cells=(3, 3, 2)), rng, 0.2)
    system = make_system(mesh, StableNeoHookean(density=DENSITY), mass="consistent")
    a, B = rng.normal(size=3), rng.normal(size=(3, 3))
    exact = np.sum((a + B @ (SIZE / 2)) ** 2) + np.sum(B**2 @ (SIZE**2 / 12))
    field = a + mesh.positions @ B.T
    twice = 2 * system.inertia.add_value_gradient(field, np.zeros_like(field), 1.0, np.zeros_like(field))
    assert twice == pytest.approx(DENSITY * SIZE.prod() * exact, rel=1e-12)


def test_value_and_gradient_are_those_of_the_quadratic_form(system: System, rng: np.random.Generator) -> None:
    M = mass_matrix(system)
    x, target = rng.normal(size=(2, system.nodes, 3))
    before = rng.normal(size=x.shape)
    gradient = before.copy()
    value = system.inertia.add_value_gradient(x, target, 0.7, gradient)
    r = x - target
    assert value == pytest.approx(0.35 * np.sum(r * (M @ r)), rel=1e-13)
    np.testing.assert_allclose(gradient - before, 0.7 * M @ r, rtol=0, atol=1e-12 * np.abs(M @ r).max())


def test_gradient_is_the_derivative_of_the_value(system: System, rng: np.random.Generator) -> None:
    x, target, d = rng.normal(size=(3, system.nodes, 3))

    def value(y: Array) -> Array:
        return np.array(system.inertia.add_value_gradient(y, target, 1.0, np.zeros_like(y)))

    gradient = np.zeros_like(x)
    system.inertia.add_value_gradient(x, target, 1.0, gradient)
    # A quadratic: the difference is exact but for rounding.
    assert difference(value, x, d, 1.0) == pytest.approx(np.sum(gradient * d), rel=1e-11)


def test_weight_is_mass_times_gravity() -> None:
    system = make_system(TetMesh.box(cells=(2, 2, 2)), gravity=(1.0, -9.81, 0.5))
    np.testing.assert_array_equal(system.gravity.forces(3.0), system.mass[:, None] * np.array([1.0, -9.81, 0.5]))


def test_gravity_may_change_with_time() -> None:
    system = make_system(TetMesh.box(cells=(2, 2, 2)), gravity=lambda t: np.array([0.0, -2.0 * t, 0.0]))
    np.testing.assert_array_equal(system.gravity.forces(3.0), system.mass[:, None] * np.array([0.0, -6.0, 0.0]))
