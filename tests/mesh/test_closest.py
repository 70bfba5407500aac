"""Points are found in their tets, and at their distance from triangles, as when all of them are tried."""

from __future__ import annotations

import ipctk
import numpy as np
import pytest

from qlb import shapes
from qlb.mesh import TetMesh
from qlb.mesh import closest as closest_module
from qlb.mesh.closest import barycentric, closest_triangles, containing_tets, embed, point_triangle_distance
from tests.mesh.surfaces import ball


def by_ipctk(points: np.ndarray, corners: np.ndarray) -> np.ndarray:
    """Of each point from each triangle, shape (p, k)."""
    return np.sqrt([[ipctk.point_triangle_distance(p, *c) for c in corners] for p in points])


def test_distances_from_triangles_of_all_shapes(rng: np.random.Generator) -> None:
    corners = rng.normal(size=(40, 3, 3))
    corners[:10, 2] = corners[:10, 0] + 1.5 * (corners[:10, 1] - corners[:10, 0]) + 1e-9  # needles
    points = rng.normal(size=(25, 3))
    i, j = np.indices((25, 40)).reshape(2, -1)
    found = point_triangle_distance(points[i], corners[j]).reshape(25, 40)
    np.testing.assert_allclose(found[:, 10:], by_ipctk(points, corners[10:]), atol=1e-12)
    np.testing.assert_allclose(found[:, :10], by_ipctk(points, corners[:10]), atol=1e-6)


@pytest.mark.parametrize("pairs", [closest_module.PAIRS, 50])
def test_the_nearest_triangle_among_small_and_large_ones(
    rng: np.random.Generator, monkeypatch: pytest.MonkeyPatch, pairs: int
) -> None:
    monkeypatch.setattr(closest_module, "PAIRS", pairs)
    corners = rng.normal(size=(60, 1, 3)) + rng.normal(size=(60, 3, 3)) * 10.0 ** rng.uniform(-3, 1, (60, 1, 1))
    points = 3 * rng.normal(size=(80, 3))
    expected = by_ipctk(points, corners)
    found, distances = closest_triangles(corners, points)
    np.testing.assert_allclose(distances, expected.min(axis=1), atol=1e-12)
    np.testing.assert_allclose(expected[np.arange(80), found], expected.min(axis=1), atol=1e-12)


def test_the_tet_of_each_point(rng: np.random.Generator) -> None:
    mesh = shapes.ball(radius=1.0, tets=800)
    corners = mesh.positions[mesh.tets]
    points = rng.uniform(-1.1, 1.1, size=(300, 3))
    i, j = np.indices((300, len(mesh.tets))).reshape(2, -1)
    lowest = barycentric(corners[j], points[i]).min(axis=1).reshape(300, -1)
    inside = lowest.max(axis=1) >= 0
    found = containing_tets(corners, points)
    assert 0.3 < inside.mean() < 0.7
    np.testing.assert_array_equal(found >= 0, inside)
    np.testing.assert_array_equal(found[inside], lowest[inside].argmax(axis=1))


def test_an_embedded_ball_is_where_it_was_and_follows_the_tets() -> None:
    mesh = shapes.ball(radius=1.0, tets=800)
    vertices, triangles = ball(3, 1.01)  # just outside
    made = embed(mesh, vertices, triangles)
    np.testing.assert_allclose(made.surface.of_nodes(mesh.positions), vertices, atol=1e-12)
    boundary = mesh.positions[mesh.boundary_triangles()]
    np.testing.assert_allclose(made.distances[:40], by_ipctk(vertices[:40], boundary).min(axis=1), atol=1e-12)

    def bent(x: np.ndarray) -> np.ndarray:
        return x + 0.1 * x**2

    off = np.abs(made.surface.of_nodes(bent(mesh.positions)) - bent(vertices)).max()
    assert off < 0.1 * mesh.edge_lengths().max() ** 2  # of a linear interpolation of 0.1 x^2, and a bit beyond


def test_vertices_far_outside_belong_to_the_nearest_boundary() -> None:
    mesh = TetMesh.box((1, 1, 1), cells=(2, 2, 2))
    made = embed(mesh, np.array([[5.0, 0.3, 0.4], [0.2, 0.6, -3.0], [0.5, 0.5, 0.5]]), [[0, 1, 2]])
    np.testing.assert_allclose(made.distances, [4, 3, 0.5])
    centroids = mesh.centroids()[made.surface.tets]
    assert centroids[0, 0] > 0.5
    assert centroids[1, 2] < 0.5
