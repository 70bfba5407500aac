"""What a surface is said to be (holes, components, orientation) is what was built into it."""

from __future__ import annotations

import numpy as np
import pytest

from qlb.mesh.surface import merge_coincident, repair, winding_number
from tests.mesh.surfaces import ball, cube, volume


def test_a_closed_surface_has_nothing_to_say() -> None:
    outward, report = repair(*ball(2))
    assert report.notes() == []
    assert (report.components, report.holes, report.triangles) == (1, 0, 320)
    np.testing.assert_array_equal(np.sort(outward), np.sort(ball(2)[1]))


def test_holes_are_counted_with_their_edges() -> None:
    vertices, triangles = ball(2)
    away = [[0], [100], [200, 201]]  # two triangles, and two beside each other
    left = np.delete(triangles, np.concatenate(away), axis=0)
    shared = len({*triangles[200]} & {*triangles[201]})
    report = repair(vertices, left)[1]
    assert report.boundary_edges == 12 - 2 * (shared == 2)
    assert report.holes == 3
    assert "open" in report.notes()[0]


def test_degenerate_and_double_triangles_are_dropped() -> None:
    vertices, triangles = cube()
    worse = np.vstack([triangles, triangles[3:5, [1, 2, 0]], [[0, 1, 1], [2, 2, 2]]])
    outward, report = repair(vertices, worse)
    assert (report.duplicate, report.degenerate) == (2, 2)
    assert len(outward) == 12


def test_any_triangles_turned_over_are_turned_back(rng: np.random.Generator) -> None:
    vertices, triangles = ball(2)
    for share in (0.1, 0.5, 0.9, 1.0):
        some = rng.random(len(triangles)) < share
        outward, report = repair(vertices, np.where(some[:, None], triangles[:, ::-1], triangles))
        assert report.turned == some.sum()
        assert volume(vertices, outward) == pytest.approx(volume(vertices, triangles))


def test_a_cavity_stays_one_and_a_body_inside_out_beside_is_turned() -> None:
    vertices, triangles = ball(2)
    n = len(vertices)
    cavity = (0.5 * vertices, triangles[:, ::-1] + n)
    beside = (0.5 * vertices + [5, 0, 0], triangles[:, ::-1] + 2 * n)
    x = np.vstack([vertices, cavity[0], beside[0]])
    one = volume(vertices, triangles)
    outward, report = repair(x, np.vstack([triangles, cavity[1], beside[1]]))
    assert (report.components, report.turned) == (3, 320)
    assert volume(x, outward) == pytest.approx(one)  # less the cavity, with the body
    # The same, all of it inside out.
    outward, report = repair(x, np.vstack([triangles[:, ::-1], cavity[1][:, ::-1], beside[1]]))
    assert volume(x, outward) == pytest.approx(one)


def test_edges_of_three_triangles_and_a_moebius_strip_are_named() -> None:
    vertices, triangles = cube()
    x = np.vstack([vertices, [[2, 2, 2]]])
    fin = repair(x, np.vstack([triangles, [[*triangles[0, :2], 8]]]))[1]
    assert (fin.branching_edges, fin.boundary_edges) == (1, 2)
    k = np.arange(12)
    angle = 2 * np.pi * k / 12
    across = np.stack([np.cos(angle / 2) * np.cos(angle), np.cos(angle / 2) * np.sin(angle), np.sin(angle / 2)], axis=1)
    middle = np.stack([np.cos(angle), np.sin(angle), 0 * angle], axis=1)
    strip = np.vstack([middle - 0.3 * across, middle + 0.3 * across])
    a, b = k, k + 12
    c, d = np.where(k < 11, k + 1, 12), np.where(k < 11, k + 13, 0)
    report = repair(strip, np.vstack([np.stack([a, c, b], axis=1), np.stack([b, c, d], axis=1)]).astype(np.int32))[1]
    assert (report.one_sided, report.holes) == (1, 1)


def test_winding_numbers_of_a_ball() -> None:
    vertices, triangles = ball(2)
    for point, expected in (((0.1, 0.2, 0.3), 1), ((2.0, 0.0, 0.0), 0)):
        assert winding_number(np.array(point), vertices[triangles]) == pytest.approx(expected, abs=1e-12)
        assert winding_number(np.array(point), vertices[triangles[:, ::-1]]) == pytest.approx(-expected, abs=1e-12)


def test_merged_vertices_are_the_first_of_each_place_in_their_order(rng: np.random.Generator) -> None:
    places = rng.random((50, 3))
    which = np.concatenate([np.arange(50), rng.integers(50, size=100)])
    merged, triangles = merge_coincident(
        places[which] + rng.uniform(-1, 1, (150, 3)) * 1e-8, np.arange(150).reshape(-1, 3)
    )
    np.testing.assert_allclose(merged, places, atol=1e-7)
    np.testing.assert_array_equal(triangles.ravel(), which)
