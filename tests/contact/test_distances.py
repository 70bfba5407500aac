"""Distances and closest points are those of IPC Toolkit, for each kind of pair and in degenerate positions."""

from __future__ import annotations

import ipctk
import numpy as np
import pytest

from qlb import _native
from tests.contact.pairs import EDGE_EDGE, VERTEX_FACE, Array, Scene, six_nodes, squared_distances

COUNT = 10_000
KINDS = [VERTEX_FACE, EDGE_EDGE]


def all_contacts(kind: int, four: Array) -> _native.ContactSet:
    scene = Scene.of(kind, len(four))
    barrier = _native.Barrier(scene.surface, dhat=1e3, stiffness=1.0, threads=1)
    found, _ = scene.evaluate(barrier, six_nodes(four))
    assert found.size == len(four)
    return found


def assert_distances(found: _native.ContactSet, expected: Array) -> None:
    np.testing.assert_allclose(found.distance, expected, rtol=0, atol=2e-13)


@pytest.mark.parametrize("kind", KINDS)
def test_distances_of_random_pairs_are_those_of_ipc_toolkit(kind: int, rng: np.random.Generator) -> None:
    four = rng.normal(size=(COUNT, 4, 3))
    assert_distances(all_contacts(kind, four), np.sqrt(squared_distances(kind, six_nodes(four))))


@pytest.mark.parametrize("kind", KINDS)
def test_distances_on_a_lattice_are_those_of_ipc_toolkit(kind: int, rng: np.random.Generator) -> None:
    """Parallel and crossing edges, flat triangles, nodes in one place: most of a 3 x 3 x 3 lattice is degenerate."""
    four = rng.integers(0, 3, size=(COUNT, 4, 3)).astype(np.float64)
    expected = np.sqrt(squared_distances(kind, six_nodes(four)))
    if kind == VERTEX_FACE:  # ipctk has no answer where a triangle is one point
        point = (four[:, 1] == four[:, 2]).all(axis=1) & (four[:, 1] == four[:, 3]).all(axis=1)
        assert np.isnan(expected[point]).all()
        expected[point] = np.linalg.norm(four[point, 0] - four[point, 1], axis=1)
    else:  # and measures to the line where an edge is one point
        for first, second in ((0, 2), (2, 0)):
            for k in np.flatnonzero((four[:, first] == four[:, first + 1]).all(axis=1)):
                p, a, b = four[k, first], four[k, second], four[k, second + 1]
                expected[k] = np.sqrt(ipctk.point_edge_distance(p, a, b))
    assert_distances(all_contacts(kind, four), expected)


@pytest.mark.parametrize("kind", KINDS)
def test_weights_and_normal_make_the_vector_between_the_closest_points(kind: int, rng: np.random.Generator) -> None:
    four = rng.normal(size=(COUNT, 4, 3))
    found = all_contacts(kind, four)
    apart = np.einsum("ki,kic->kc", found.gamma, four)
    np.testing.assert_allclose(apart, found.distance[:, None] * found.normal, atol=2e-13)
    np.testing.assert_allclose(np.linalg.norm(found.normal, axis=1), 1.0, atol=1e-14)
    split = 1 if kind == VERTEX_FACE else 2
    np.testing.assert_allclose(found.gamma[:, :split].sum(axis=1), 1.0, atol=1e-14)
    np.testing.assert_allclose(found.gamma[:, split:].sum(axis=1), -1.0, atol=1e-14)
    assert (found.gamma[:, :split] >= 0.0).all()
    assert (found.gamma[:, split:] <= 0.0).all()
