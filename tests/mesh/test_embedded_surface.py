"""A surface that follows the tets it lies in."""

from __future__ import annotations

import numpy as np
import pytest

import qlb
from qlb.bodies import Placement
from qlb.mesh import EmbeddedSurface, TetMesh


def box() -> TetMesh:
    return TetMesh.box((1, 0.5, 0.5), cells=(3, 2, 2))


def triangle(mesh: TetMesh) -> EmbeddedSurface:
    weights = [[0.25, 0.25, 0.25, 0.25], [0.5, 0.5, 0.0, 0.0], [1.5, -0.5, 0.0, 0.0]]
    return EmbeddedSurface.on(mesh, [[0, 1, 2]], [0, 4, 9], weights)


def test_the_boundary_as_a_surface_has_the_boundary_s_triangles_and_positions() -> None:
    mesh = box()
    surface = mesh.rendered()
    corners = surface.of_nodes(mesh.positions)[surface.triangles]
    np.testing.assert_array_equal(corners, mesh.positions[mesh.boundary_triangles()])


def test_vertices_follow_an_affine_map_exactly() -> None:
    mesh = box()
    surface = triangle(mesh)
    a, b = np.array([[1.0, 0.3, 0.0], [0.2, 2.0, 0.1], [0.0, 0.4, 0.7]]), np.array([3.0, -1.0, 2.0])
    moved = surface.of_nodes(mesh.positions @ a.T + b)
    np.testing.assert_allclose(moved, surface.of_nodes(mesh.positions) @ a.T + b, atol=1e-14)


def test_a_placed_mesh_and_a_union_keep_their_surfaces() -> None:
    plain, fine = box(), box()
    fine = fine.with_surface(triangle(fine))
    placed = Placement(scale=2.0, rotation=(0.1, 0.2, 0.3), translation=(5.0, 0.0, 0.0)).of(fine)
    assert placed.surface is not None
    union = TetMesh.union([plain, placed])
    assert union.surface is not None
    vertices = union.surface.of_nodes(union.positions)
    boundary = plain.rendered()
    np.testing.assert_array_equal(vertices[:-3], boundary.of_nodes(plain.positions))
    np.testing.assert_array_equal(vertices[-3:], placed.surface.of_nodes(placed.positions))
    np.testing.assert_array_equal(union.surface.triangles[-1], len(vertices) + np.array([-3, -2, -1]))


@pytest.mark.parametrize(
    ("triangles", "tets", "weights", "says"),
    [
        ([[0, 1, 2, 3]], [0], [[1, 0, 0, 0]], "triangles"),
        ([[0, 0, 1]], [0], [[1, 0, 0, 0]], r"triangles .* \[0, 0\]"),
        ([[0, 0, 0]], [-1], [[1, 0, 0, 0]], "tets"),
        ([[0, 0, 0]], [0], [[1, 0.5, 0, 0]], "sum to 1"),
        ([[0, 0, 0]], [0], [[np.nan, 0.5, 0, 0]], "sum to 1"),
    ],
)
def test_a_surface_that_does_not_fit_is_refused(triangles: object, tets: object, weights: object, says: str) -> None:
    with pytest.raises(qlb.InputError, match=says):
        EmbeddedSurface.on(box(), triangles, tets, weights)  # type: ignore[arg-type]
