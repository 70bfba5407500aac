"""The barrier's values are those of IPC Toolkit, its derivatives those of finite differences."""

from __future__ import annotations

import ipctk
import numpy as np
import pytest

from qlb import _native
from tests.contact.pairs import (
    EDGE_EDGE,
    NO_PAIRS,
    NO_PLANES,
    VERTEX_FACE,
    Array,
    Scene,
    closest_type,
    dense_hessian,
    draw,
    six_nodes,
)
from tests.support import difference

DHAT, STIFFNESS, SCALE = 0.8, 3e4, 0.37
TYPES = {
    VERTEX_FACE: ["P_T0", "P_T1", "P_T2", "P_E0", "P_E1", "P_E2", "P_T"],
    EDGE_EDGE: ["EA0_EB0", "EA0_EB1", "EA1_EB0", "EA1_EB1", "EA_EB0", "EA_EB1", "EA0_EB", "EA1_EB", "EA_EB"],
}
CASES = [(kind, name, 1.0) for kind, names in TYPES.items() for name in names]
CASES += [(EDGE_EDGE, name, 0.01) for name in TYPES[EDGE_EDGE]]
MOLLIFIED = 0.01  # spread: nearly parallel edges


def make_barrier(scene: Scene, threads: int = 1) -> _native.Barrier:
    return _native.Barrier(scene.surface, DHAT, STIFFNESS, threads)


def active(kind: int, name: str, spread: float, rng: np.random.Generator) -> Array:
    """Nodes of a pair with these closest points, neither very near nor out of reach, and mollified if spread < 1."""
    scene = Scene.of(kind)
    barrier = make_barrier(scene)

    def accept(x: Array) -> bool:
        if closest_type(kind, x) != name:
            return False
        found, _ = scene.evaluate(barrier, x)
        mollified = kind == EDGE_EDGE and mollifier(x) < 0.99
        return found.size == 1 and 0.1 < found.distance[0] / DHAT < 0.9 and mollified == (spread < 1.0)

    return draw(kind, accept, rng, spread)


def rest_threshold() -> float:
    """1e-3 |E1|^2 |E2|^2 at rest: the edges of the scene are 1 and sqrt(1 + 1.5^2) long."""
    return 1e-3 * (1.0 + 1.5**2 - 1.0)


def mollifier(x: Array) -> float:
    return float(ipctk.edge_edge_mollifier(*x[:4], rest_threshold()))


@pytest.mark.parametrize(("kind", "name", "spread"), CASES)
def test_gradient_and_hessian_are_derivatives(kind: int, name: str, spread: float, rng: np.random.Generator) -> None:
    scene = Scene.of(kind)
    barrier = make_barrier(scene)
    for _ in range(3):
        x = active(kind, name, spread, rng)
        direction = rng.normal(size=x.shape)
        found, gradient = scene.evaluate(barrier, x, SCALE)
        step = 1e-5 if spread == 1.0 else 1e-6
        slope = difference(lambda y: np.array(scene.evaluate(barrier, y, SCALE)[0].energy), x, direction, step)
        assert np.sum(gradient * direction) == pytest.approx(float(slope), rel=1e-6, abs=1e-7 * np.abs(gradient).max())

        change = difference(lambda y: scene.evaluate(barrier, y, SCALE)[1], x, direction, step)
        product = dense_hessian(barrier, x, found, project=False) @ direction.ravel()
        np.testing.assert_allclose(product, change.ravel(), rtol=0, atol=1e-6 * np.abs(change).max())


@pytest.mark.parametrize(("kind", "name", "spread"), CASES)
def test_projected_hessian_has_no_negative_part(kind: int, name: str, spread: float, rng: np.random.Generator) -> None:
    scene = Scene.of(kind)
    barrier = make_barrier(scene)
    x = active(kind, name, spread, rng)
    found, _ = scene.evaluate(barrier, x, SCALE)
    (block,) = barrier.hessian_blocks(x, found, False)
    (projected,) = barrier.hessian_blocks(x, found, True)
    values, vectors = np.linalg.eigh(block)
    assert values[0] < -1e-6 * values[-1]
    expected = (vectors * np.maximum(values, 0.0)) @ vectors.T
    np.testing.assert_allclose(projected, expected, rtol=0, atol=1e-12 * values[-1])


@pytest.mark.parametrize("kind", [VERTEX_FACE, EDGE_EDGE])
def test_energy_is_area_times_the_barrier_of_ipc_toolkit(kind: int, rng: np.random.Generator) -> None:
    """ipctk's barrier is -(d - dhat)^2 ln(d/dhat) = dhat^2 beta(d/dhat)."""
    scene = Scene.of(kind)
    barrier = make_barrier(scene)
    if kind == VERTEX_FACE:
        area = scene.surface.node_area(0) / 2  # a third of a triangle of area 0.6
        assert area == pytest.approx(0.1, rel=1e-14)
    else:
        area = sum(scene.surface.edge_area(e) for e in scene.edge_edges[0].tolist()) / 4
        assert area == pytest.approx((1 / 2 + 1.5 / 2) / 3 / 4, rel=1e-14)
    for spread in [1.0, MOLLIFIED] if kind == EDGE_EDGE else [1.0]:
        x = active(kind, "P_T" if kind == VERTEX_FACE else "EA_EB", spread, rng)
        found, _ = scene.evaluate(barrier, x, SCALE)
        d = float(found.distance[0])
        weight = SCALE * area * STIFFNESS / DHAT * (mollifier(x) if kind == EDGE_EDGE else 1.0)
        assert found.energy == pytest.approx(weight * ipctk.barrier(d, DHAT), rel=1e-12)
        assert found.force[0] == pytest.approx(-weight * ipctk.barrier_first_derivative(d, DHAT), rel=1e-12)
        assert found.stiffness[0] == pytest.approx(weight * ipctk.barrier_second_derivative(d, DHAT), rel=1e-12)


def test_mollifier_vanishes_for_parallel_edges_with_a_finite_hessian() -> None:
    scene = Scene.of(EDGE_EDGE)
    barrier = make_barrier(scene)
    x = six_nodes(np.array([[0.0, 0, 0], [1, 0, 0], [0.2, 0.3, 0], [1.2, 0.3, 0]]))
    found, gradient = scene.evaluate(barrier, x)
    assert (found.size, found.energy, float(found.force[0])) == (1, 0.0, 0.0)
    np.testing.assert_array_equal(gradient, 0.0)
    for project in (False, True):
        assert np.isfinite(barrier.hessian_blocks(x, found, project)).all()


@pytest.mark.parametrize("kind", [VERTEX_FACE, EDGE_EDGE])
def test_energy_is_infinite_where_something_touches(kind: int) -> None:
    scene = Scene.of(kind)
    four = {
        VERTEX_FACE: [[0.25, 0.25, 0], [0.0, 0, 0], [1, 0, 0], [0, 1, 0]],
        EDGE_EDGE: [[-1.0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]],
    }[kind]
    x = six_nodes(np.array(four))
    found, gradient = scene.evaluate(make_barrier(scene), x)
    assert found.energy == np.inf
    assert found.minimum_distance == 0.0
    assert np.isfinite(gradient).all()


def test_touching_parallel_edges_have_infinite_energy() -> None:
    scene = Scene.of(EDGE_EDGE)
    x = six_nodes(np.array([[0.0, 0, 0], [1, 0, 0], [0.5, 0, 0], [1.5, 0, 0]]))
    assert scene.evaluate(make_barrier(scene), x)[0].energy == np.inf


def test_without_candidates_there_is_nothing() -> None:
    scene = Scene(Scene.of(VERTEX_FACE).surface, NO_PAIRS, NO_PAIRS)
    barrier = make_barrier(scene)
    found, gradient = scene.evaluate(barrier, np.zeros((6, 3)))
    assert (found.size, found.energy, found.minimum_distance) == (0, 0.0, np.inf)
    assert found.nodes.shape == found.gamma.shape == (0, 4)
    assert barrier.hessian_blocks(np.zeros((6, 3)), found, True).shape == (0, 12, 12)
    np.testing.assert_array_equal(gradient, 0.0)


def test_a_plane_pushes_the_nodes_near_it_along_its_normal(rng: np.random.Generator) -> None:
    scene = Scene.of(VERTEX_FACE)
    barrier = make_barrier(scene)
    normal = np.array([0.6, 0.0, 0.8])
    planes = np.array([[*normal, -1.0], [0.0, 1.0, 0.0, -0.5]])
    allowed = np.array([[1, 1], [0, 0]], dtype=np.uint8)
    x = rng.uniform(-0.5, 0.5, size=(6, 3))
    x[3] = 5.0 * normal

    def evaluate(y: Array) -> tuple[_native.ContactSet, Array]:
        gradient = np.zeros_like(y)
        return barrier.evaluate(y, NO_PAIRS, NO_PAIRS, planes, allowed, SCALE, gradient), gradient

    found, gradient = evaluate(x)
    distance = x @ normal + 1.0
    near = np.flatnonzero(distance < DHAT)
    assert 0 < len(near) < 6
    np.testing.assert_array_equal(found.nodes, np.tile(near[:, None], 4))
    np.testing.assert_array_equal(found.gamma, np.tile([1.0, 0, 0, 0], (len(near), 1)))
    np.testing.assert_array_equal(found.groups, np.stack([np.array([0, 1, 1, 1, 0, 0])[near], 2 + 0 * near], axis=1))
    np.testing.assert_allclose(found.distance, distance[near], rtol=1e-14)
    area = np.array([scene.surface.node_area(int(node)) for node in near])
    expected = SCALE * area * STIFFNESS / DHAT * np.array([ipctk.barrier(d, DHAT) for d in distance[near]])
    assert found.energy == pytest.approx(expected.sum(), rel=1e-12)
    direction = rng.normal(size=x.shape)
    slope = difference(lambda y: np.array(evaluate(y)[0].energy), x, direction, 1e-5)
    assert np.sum(gradient * direction) == pytest.approx(float(slope), rel=1e-8)
    change = difference(lambda y: evaluate(y)[1], x, direction, 1e-5).ravel()
    product = dense_hessian(barrier, x, found, project=True) @ direction.ravel()
    np.testing.assert_allclose(product, change, rtol=0, atol=1e-8 * np.abs(change).max())

    x[near[0]] -= 1.5 * normal
    assert evaluate(x)[0].energy == np.inf


def crowd(count: int, rng: np.random.Generator) -> tuple[Scene, Array]:
    """A surface of many triangles in a small box, and many candidates of both kinds."""
    triangles = rng.uniform(0.0, 4.0, size=(400, 1, 3)) + rng.normal(size=(400, 3, 3)) * 0.4
    x = triangles.reshape(-1, 3)
    faces = np.arange(len(x), dtype=np.int32).reshape(-1, 3)
    surface = _native.ContactSurface(x, faces, np.zeros(len(x), dtype=np.int32), np.ones((1, 1), dtype=np.uint8))
    pairs = np.stack([rng.integers(0, len(x), count), rng.integers(0, len(faces), count)], axis=1)
    pairs = pairs[pairs[:, 0] // 3 != pairs[:, 1]]
    edges = rng.integers(0, len(surface.edges), size=(count, 2))
    edges = edges[edges[:, 0] // 3 != edges[:, 1] // 3]
    return Scene(surface, pairs.astype(np.int32), edges.astype(np.int32)), x


def test_any_number_of_threads_gives_the_same_bits(rng: np.random.Generator) -> None:
    scene, x = crowd(20_000, rng)
    results = []
    for threads in (1, 2):
        barrier = _native.Barrier(scene.surface, 0.3, STIFFNESS, threads)
        found, gradient = scene.evaluate(barrier, x)
        arrays = [found.nodes, found.gamma, found.normal, found.distance, found.force, found.stiffness, found.key]
        results.append([found.energy, gradient, *arrays, barrier.hessian_blocks(x, found, True)])
    assert len(results[0][2]) > 200
    for one, two in zip(*results, strict=True):
        np.testing.assert_array_equal(one, two)


def test_no_contact_is_culled(rng: np.random.Generator) -> None:
    scene, x = crowd(2_000, rng)
    dhat = 0.3
    found, _ = scene.evaluate(_native.Barrier(scene.surface, dhat, STIFFNESS, 1), x)
    everything, _ = scene.evaluate(_native.Barrier(scene.surface, 1e3, STIFFNESS, 1), x)
    assert everything.size == len(scene.vertex_faces) + len(scene.edge_edges)
    near = np.asarray(everything.distance) < dhat
    np.testing.assert_array_equal(found.key, np.asarray(everything.key)[near])
    assert found.minimum_distance == everything.distance.min()


def test_a_key_names_its_pair_whichever_way_round(rng: np.random.Generator) -> None:
    scene, x = crowd(2_000, rng)
    barrier = _native.Barrier(scene.surface, 1e3, STIFFNESS, 1)
    found, gradient = scene.evaluate(barrier, x)
    turned = Scene(scene.surface, scene.vertex_faces, np.ascontiguousarray(scene.edge_edges[:, ::-1]))
    again, same = scene.evaluate(barrier, x)[0], turned.evaluate(barrier, x)
    np.testing.assert_array_equal(found.key, again.key)
    np.testing.assert_array_equal(found.key, same[0].key)
    np.testing.assert_array_equal(gradient, same[1])
    distinct = len(np.unique(scene.vertex_faces, axis=0)) + len(np.unique(np.sort(scene.edge_edges, axis=1), axis=0))
    assert len(np.unique(found.key)) == distinct


def test_bad_input_is_refused_by_name() -> None:
    scene = Scene.of(VERTEX_FACE)
    with pytest.raises(ValueError, match=r"dhat is -1\.0+, must be positive"):
        _native.Barrier(scene.surface, -1.0, 1.0, 1)
    with pytest.raises(ValueError, match="kind is 'spring', must be 'barrier' or 'penalty'"):
        _native.Barrier(scene.surface, 1.0, 1.0, 1, "spring")
    barrier, x, none = make_barrier(scene), np.zeros((6, 3)), np.zeros((0, 2), dtype=np.uint8)
    wrong = np.array([[0, 2]], dtype=np.int32)
    with pytest.raises(ValueError, match=r"vertex_faces: index 2 is outside \[0, 2\)"):
        barrier.evaluate(x, wrong, NO_PAIRS, NO_PLANES, none, 1.0, x)
    with pytest.raises(ValueError, match=r"plane_allowed must have shape \(planes, groups\)"):
        barrier.evaluate(x, NO_PAIRS, NO_PAIRS, np.zeros((1, 4)), none, 1.0, x)
