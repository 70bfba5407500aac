"""Sums over a mesh are those of its elements, with their derivatives and the symmetries of mechanics."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import StableNeoHookean, TetMesh, _native
from qlb.system import System
from tests.support import (
    Array,
    dense,
    difference,
    elastic_gradient,
    elastic_hessian,
    jittered,
    make_system,
    multiply,
    random_rotation,
)


@pytest.fixture(params=[0.02, 0.3], ids=["bent", "inverted"])
def body(request: pytest.FixtureRequest, rng: np.random.Generator) -> tuple[System, Array]:
    """A jittered block with its own material constants in every element, and positions of its nodes."""
    mesh = jittered(TetMesh.box((1.0, 0.8, 0.7), cells=(3, 3, 3)), rng, 0.2)
    count = len(mesh.tets)
    material = StableNeoHookean(young=rng.uniform(1e3, 1e5, count), poisson=rng.uniform(-0.2, 0.49, count))
    x = mesh.positions + request.param * rng.normal(size=mesh.positions.shape)
    return make_system(mesh, material), x


def strain_operator(mesh: TetMesh, tet: Array) -> Array:
    """B with vec(F) = B vec(x of the tet): (9, 12), F and x flattened row by row."""
    corners = mesh.positions[tet]
    inverse = np.linalg.inv((corners[1:] - corners[0]).T)
    shape = np.vstack([-inverse.sum(axis=0), inverse])  # grad N_a, (4, 3)
    B = np.zeros((9, 12))
    for a in range(4):
        for i in range(3):
            B[3 * i : 3 * i + 3, 3 * a + i] = shape[a]
    return B


def assembled_by_hand(
    system: System, material: StableNeoHookean, x: Array, project: bool
) -> tuple[float, Array, Array]:
    """Energy, gradient and dense Hessian from the density at each element's F, straight from the definitions."""
    mesh, size = system.mesh, x.size
    operators = [strain_operator(mesh, tet) for tet in mesh.tets]
    F = np.stack([(B @ x[tet].ravel()).reshape(3, 3) for B, tet in zip(operators, mesh.tets, strict=True)])
    psi, P, C = material.evaluate(F)
    if project:
        values, vectors = np.linalg.eigh(C)
        C = np.einsum("kip,kp,kjp->kij", vectors, np.maximum(values, 0), vectors)
    energy, gradient, hessian = 0.0, np.zeros(size), np.zeros((size, size))
    for e, (B, tet) in enumerate(zip(operators, mesh.tets, strict=True)):
        dofs = (3 * tet[:, None] + np.arange(3)).ravel()
        volume = mesh.volumes()[e]
        energy += volume * psi[e]
        gradient[dofs] += volume * B.T @ P[e].ravel()
        hessian[np.ix_(dofs, dofs)] += volume * B.T @ C[e] @ B
    return energy, gradient.reshape(-1, 3), hessian


@pytest.mark.parametrize("project", [False, True], ids=["exact", "projected"])
def test_sums_are_those_of_the_elements(project: bool, rng: np.random.Generator) -> None:
    mesh = jittered(TetMesh.box((1.0, 0.8, 0.7), cells=(3, 2, 3)), rng, 0.2)
    count = len(mesh.tets)
    material = StableNeoHookean(young=rng.uniform(1e3, 1e5, count), poisson=rng.uniform(-0.2, 0.49, count))
    system = make_system(mesh, material)
    x = mesh.positions + 0.1 * rng.normal(size=mesh.positions.shape)
    energy, gradient, hessian = assembled_by_hand(system, material, x, project)
    assert system.elastic.value(x) == pytest.approx(energy, rel=1e-12)
    np.testing.assert_allclose(elastic_gradient(system, x), gradient, rtol=0, atol=1e-12 * np.abs(gradient).max())
    result = dense(elastic_hessian(system, x, project=project), system.pattern)
    np.testing.assert_allclose(result, hessian, rtol=0, atol=1e-11 * np.abs(hessian).max())


def test_gradient_is_the_derivative_of_the_value(body: tuple[System, Array], rng: np.random.Generator) -> None:
    system, x = body
    gradient = elastic_gradient(system, x)
    for _ in range(5):
        d = rng.normal(size=x.shape)
        measured = difference(lambda y: np.array(system.elastic.value(y)), x, d, 1e-4)
        assert measured == pytest.approx(np.sum(gradient * d), rel=1e-8)


def test_hessian_is_the_derivative_of_the_gradient(body: tuple[System, Array], rng: np.random.Generator) -> None:
    system, x = body
    hessian = elastic_hessian(system, x, project=False)
    full = dense(hessian, system.pattern)
    for _ in range(5):
        d = rng.normal(size=x.shape)
        measured = difference(lambda y: elastic_gradient(system, y), x, d, 1e-4)
        scale = np.abs(measured).max()
        np.testing.assert_allclose(multiply(hessian, d), measured, rtol=0, atol=1e-8 * scale)
        np.testing.assert_allclose((full @ d.ravel()).reshape(-1, 3), measured, rtol=0, atol=1e-8 * scale)


def test_projected_hessian_is_positive_semidefinite(body: tuple[System, Array]) -> None:
    system, x = body
    values = np.linalg.eigvalsh(dense(elastic_hessian(system, x, project=True), system.pattern))
    assert values[0] >= -1e-12 * values[-1]


def test_exact_hessian_of_an_inverted_body_is_indefinite(rng: np.random.Generator) -> None:
    # Or the test above would prove nothing.
    mesh = TetMesh.box(cells=(2, 2, 2))
    system = make_system(mesh)
    x = mesh.positions + 0.3 * rng.normal(size=mesh.positions.shape)
    values = np.linalg.eigvalsh(dense(elastic_hessian(system, x, project=False), system.pattern))
    assert values[0] < -1e-3 * values[-1]


def test_rigid_motion_keeps_the_energy_and_turns_the_gradient(
    body: tuple[System, Array], rng: np.random.Generator
) -> None:
    system, x = body
    R, shift = random_rotation(rng), rng.normal(size=3)
    moved = x @ R.T + shift
    gradient = elastic_gradient(system, x)
    assert system.elastic.value(moved) == pytest.approx(system.elastic.value(x), rel=1e-12)
    np.testing.assert_allclose(
        elastic_gradient(system, moved), gradient @ R.T, rtol=0, atol=1e-11 * np.abs(gradient).max()
    )


@pytest.mark.parametrize("project", [False, True], ids=["exact", "projected"])
def test_rigid_motion_turns_the_hessian(body: tuple[System, Array], project: bool, rng: np.random.Generator) -> None:
    system, x = body
    R = random_rotation(rng)
    hessian, d = elastic_hessian(system, x, project=project), rng.normal(size=x.shape)
    turned = multiply(elastic_hessian(system, x @ R.T, project=project), d @ R.T)
    expected = multiply(hessian, d) @ R.T
    np.testing.assert_allclose(turned, expected, rtol=0, atol=1e-11 * np.abs(expected).max())


def test_internal_forces_have_no_resultant_and_no_moment(body: tuple[System, Array]) -> None:
    system, x = body
    forces = elastic_gradient(system, x)
    scale = np.abs(forces).sum()
    np.testing.assert_allclose(forces.sum(axis=0), 0.0, atol=1e-13 * scale)
    np.testing.assert_allclose(np.cross(x, forces).sum(axis=0), 0.0, atol=1e-13 * scale)


@pytest.mark.parametrize("project", [False, True], ids=["exact", "projected"])
def test_translations_cost_nothing(body: tuple[System, Array], project: bool) -> None:
    system, x = body
    hessian = elastic_hessian(system, x, project=project)
    ones = np.ones_like(x)
    np.testing.assert_allclose(multiply(hessian, ones), 0.0, atol=1e-12 * np.abs(hessian.values).max())


def test_small_rotations_of_the_rest_cost_nothing(rng: np.random.Generator) -> None:
    mesh = jittered(TetMesh.box(cells=(3, 3, 3)), rng, 0.2)
    system = make_system(mesh)
    hessian = elastic_hessian(system, mesh.positions, project=False)
    spin = np.cross(rng.normal(size=3), mesh.positions)
    np.testing.assert_allclose(multiply(hessian, spin), 0.0, atol=1e-11 * np.abs(hessian.values).max())


def test_rest_has_no_energy_and_no_force(rng: np.random.Generator) -> None:
    mesh = jittered(TetMesh.box(cells=(3, 3, 3)), rng, 0.2)
    system = make_system(mesh)
    stiff = np.abs(elastic_hessian(system, mesh.positions, project=False).values).max()
    assert abs(system.elastic.value(mesh.positions)) <= 1e-13 * stiff
    np.testing.assert_allclose(elastic_gradient(system, mesh.positions), 0.0, atol=1e-13 * stiff)


def test_a_body_crushed_to_a_point_is_finite() -> None:
    mesh = TetMesh.box(cells=(2, 2, 2))
    system = make_system(mesh)
    x = np.zeros_like(mesh.positions)
    assert np.isfinite(system.elastic.value(x))
    assert np.isfinite(elastic_gradient(system, x)).all()
    for project in (False, True):
        assert np.isfinite(elastic_hessian(system, x, project=project).values).all()


def test_results_are_added_with_their_scale(body: tuple[System, Array], rng: np.random.Generator) -> None:
    system, x = body
    before = rng.normal(size=x.shape)
    gradient = before.copy()
    value = system.elastic.add_value_gradient(x, 0.25, gradient)
    assert value == pytest.approx(0.25 * system.elastic.value(x), rel=1e-14)
    expected = 0.25 * elastic_gradient(system, x)
    np.testing.assert_allclose(gradient - before, expected, rtol=0, atol=1e-12 * np.abs(expected).max())

    matrix = _native.BlockMatrix(system.pattern)
    system.elastic.add_hessian(x, 0.25, False, matrix)
    system.elastic.add_hessian(x, 0.5, False, matrix)
    whole = elastic_hessian(system, x, project=False).values
    np.testing.assert_allclose(matrix.values, 0.75 * whole, rtol=0, atol=1e-14 * np.abs(whole).max())


@pytest.mark.parametrize("cells", [(1, 1, 1), (2, 1, 1), (3, 3, 3), (5, 5, 5)], ids=str)
def test_padding_of_the_last_pack_adds_nothing(cells: tuple[int, int, int]) -> None:
    # A uniform stretch has the energy volume psi(F), whatever the number of elements is modulo the SIMD width.
    mesh = TetMesh.box((1.0, 0.5, 0.25), cells=cells)
    material = StableNeoHookean()
    F = np.array([[1.2, 0.1, 0.0], [0.0, 0.9, 0.3], [0.2, 0.0, 1.1]])
    density = material.evaluate(F[None])[0][0]
    value = make_system(mesh, material).elastic.value(mesh.positions @ F.T)
    assert value == pytest.approx(0.125 * density, rel=1e-13)


def test_one_tetrahedron_alone(rng: np.random.Generator) -> None:
    mesh = TetMesh([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [[0, 1, 2, 3]])
    material = StableNeoHookean()
    F = np.eye(3) + 0.3 * rng.normal(size=(3, 3))
    system = make_system(mesh, material)
    assert system.elastic.value(mesh.positions @ F.T) == pytest.approx(material.evaluate(F[None])[0][0] / 6, rel=1e-13)


def test_the_order_of_nodes_and_tets_does_not_matter(rng: np.random.Generator) -> None:
    mesh = TetMesh.box(cells=(3, 2, 2))
    young = rng.uniform(1e3, 1e5, len(mesh.tets))
    x = mesh.positions + 0.03 * rng.normal(size=mesh.positions.shape)
    nodes, tets = rng.permutation(len(x)), rng.permutation(len(mesh.tets))
    rank = np.argsort(nodes)
    even = np.array([1, 2, 0, 3])
    shuffled = TetMesh(mesh.positions[nodes], rank[mesh.tets[tets]][:, even])
    gradient = elastic_gradient(make_system(mesh, StableNeoHookean(young=young)), x)
    other = elastic_gradient(make_system(shuffled, StableNeoHookean(young=young[tets])), x[nodes])
    np.testing.assert_allclose(other, gradient[nodes], rtol=0, atol=1e-13 * np.abs(gradient).max())


def test_arrays_of_the_wrong_size_are_refused() -> None:
    system = make_system(TetMesh.box(cells=(1, 1, 1)))
    with pytest.raises(ValueError, match="x has 9 entries, expected 24"):
        system.elastic.value(np.zeros((3, 3)))
    with pytest.raises(ValueError, match="gradient has 9 entries, expected 24"):
        system.elastic.add_value_gradient(system.mesh.positions, 1.0, np.zeros((3, 3)))
