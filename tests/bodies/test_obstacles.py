"""Obstacles and planes by themselves: checks, files, motions."""

from __future__ import annotations

import meshio
import numpy as np
import pytest

from qlb import InputError, Obstacle, Plane, Translation, VertexAnimation

SQUARE = [[0, 0, 0], [1, 0, 0], [1, 1, 0], [0, 1, 0]]
HALVES = [[0, 1, 2], [0, 2, 3]]


def test_arrays_are_copied_and_kept_from_changes():
    vertices = np.array(SQUARE, dtype=float)
    obstacle = Obstacle(vertices, HALVES)
    vertices[0] = 9
    np.testing.assert_array_equal(obstacle.vertices, SQUARE)
    assert obstacle.triangles.dtype == np.int32
    with pytest.raises(ValueError, match="read-only"):
        obstacle.vertices[0] = 9


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        ([[0, 0], [1, 0]], HALVES, "vertices of an obstacle have shape (2, 2), must be (q, 3)"),
        ("here", HALVES, "vertices of an obstacle are not an array of numbers"),
        ([*SQUARE[:2], [np.nan, 0, 0]], [[0, 1, 2]], "vertex 2 of an obstacle has position [nan, 0.0, 0.0]"),
        (SQUARE, [], "triangles of an obstacle have shape (0,), must be (t, 3) with t >= 1"),
        (SQUARE, [[0, 1, 2, 3]], "triangles of an obstacle have shape (1, 4), must be (t, 3) with t >= 1"),
        (SQUARE, [[0, 1, 2.5]], "triangles of an obstacle have type float64, must be integers"),
        (SQUARE, [[0, 1, 2], [0, 2, 4]], "triangle 1 of an obstacle names vertex 4, must be in [0, 3]"),
        (SQUARE, [[0, 1, 2], [-1, 2, 3]], "triangle 1 of an obstacle names vertex -1, must be in [0, 3]"),
        (SQUARE, [[0, 1, 2], [3, 0, 3]], "triangle 1 of an obstacle names a vertex twice: [3, 0, 3]"),
        ([*SQUARE, [2, 0, 0]], [[0, 2, 3], [0, 1, 4]], "triangle 1 of an obstacle is degenerate: area 0 m^2"),
    ],
)
def test_a_wrong_surface_is_refused_and_the_first_bad_thing_named(vertices, triangles, message):
    with pytest.raises(InputError) as caught:
        Obstacle(vertices, triangles)
    assert str(caught.value).startswith(message)


def test_errors_name_the_obstacle():
    with pytest.raises(InputError, match="triangle 0 of obstacle 'floor' names vertex 8"):
        Obstacle(SQUARE, [[0, 1, 8]], name="floor")
    with pytest.raises(InputError, match="normal of plane 'floor'"):
        Plane((0, 0, 0), (0, 0, 0), name="floor")


@pytest.mark.parametrize("scale", [1e-9, 1.0, 1e9])
def test_small_and_large_surfaces_are_accepted(scale):
    assert len(Obstacle(scale * np.array(SQUARE), HALVES).triangles) == 2


@pytest.mark.parametrize("suffix", ["obj", "stl", "ply", "vtk"])
def test_files(tmp_path, suffix):
    # The file holds one vertex more than its triangles use.
    points = np.array([*SQUARE, [9, 9, 9]], dtype=float)
    path = tmp_path / f"square.{suffix}"
    meshio.Mesh(points, [("triangle", np.array(HALVES))]).write(path)
    obstacle = Obstacle.read(path, name="square")
    corners = obstacle.vertices[obstacle.triangles]
    np.testing.assert_allclose(np.sort(corners, axis=1), np.sort(np.array(SQUARE)[np.array(HALVES)], axis=1))
    assert len(obstacle.vertices) == 4
    assert obstacle.name == "square"


def test_quads_are_cut_in_two(tmp_path):
    path = tmp_path / "square.obj"
    path.write_text("v 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv 0 0 1\nf 1 2 3 4\nf 1 2 5\n", encoding="utf-8")
    triangles = {tuple(sorted(t)) for t in Obstacle.read(path).triangles.tolist()}
    assert triangles == {(0, 1, 2), (0, 2, 3), (0, 1, 4)}


def test_wrong_files_are_refused(tmp_path):
    with pytest.raises(InputError, match="does not exist"):
        Obstacle.read(tmp_path / "none.obj")
    path = tmp_path / "lines.vtk"
    meshio.Mesh(np.array(SQUARE, dtype=float), [("line", np.array([[0, 1]]))]).write(path)
    with pytest.raises(InputError, match="has no triangles, only line"):
        Obstacle.read(path)


def test_the_normal_of_a_plane_has_length_one():
    assert Plane((1, 2, 3), (0, 3, 4)).normal == pytest.approx((0, 0.6, 0.8), abs=1e-15)
    for length in (1e-300, 1e300):
        assert Plane((0, 0, 0), (0, 0, -length)).normal == (0, 0, -1)


@pytest.mark.parametrize(
    ("point", "normal", "message"),
    [
        ((0, 0, 0), (0, 0, 0), r"normal of a plane = \(0, 0, 0\) has no length: must be a direction"),
        ((0, 0, 0), (0, np.nan, 0), "normal of a plane is .* must be finite"),
        ((0, 0), (0, 1, 0), r"point of a plane has shape \(2,\), must be \(3,\)"),
    ],
)
def test_a_wrong_plane_is_refused(point, normal, message):
    with pytest.raises(InputError, match=message):
        Plane(point, normal)


def test_a_plane_is_shifted_by_its_motion():
    plane = Plane((0, 1, 0), (0, 1, 0), motion=Translation((0, 2, 0)))
    np.testing.assert_array_equal(plane.point_at(0.5), [0, 2, 0])
    np.testing.assert_array_equal(Plane((0, 1, 0), (0, 1, 0)).point_at(0.5), [0, 1, 0])
    with pytest.raises(InputError, match=r"the motion of a plane at time 0\.5 s"):
        Plane((0, 1, 0), (0, 1, 0), motion=lambda x, t: np.full((2, 3), t)).point_at(0.5)


def test_what_is_no_motion_is_refused():
    with pytest.raises(InputError, match=r"motion of an obstacle = 3 must be a function"):
        Obstacle(SQUARE, HALVES, motion=3)
    with pytest.raises(InputError, match=r"motion of a plane = \(0, 1, 0\) must be a function"):
        Plane((0, 0, 0), (0, 1, 0), motion=(0, 1, 0))


def test_an_animation_is_linear_between_its_keys_and_still_beyond():
    keys = np.random.default_rng(0).normal(size=(3, 4, 3))
    animation = VertexAnimation([0.0, 1.0, 3.0], keys)
    anchors = np.zeros((4, 3))
    for time, expected in [
        (-1.0, keys[0]),
        (0.0, keys[0]),
        (0.25, 0.75 * keys[0] + 0.25 * keys[1]),
        (1.0, keys[1]),
        (2.0, 0.5 * (keys[1] + keys[2])),
        (3.0, keys[2]),
        (9.0, keys[2]),
    ]:
        np.testing.assert_allclose(animation(anchors, time), expected, rtol=1e-15)
    np.testing.assert_array_equal(VertexAnimation(2.0, keys[:1])(anchors, 5.0), keys[0])


@pytest.mark.parametrize(
    ("times", "positions", "message"),
    [
        ([0, 0], np.zeros((2, 4, 3)), "times of an animation"),
        ([0, np.inf], np.zeros((2, 4, 3)), "times of an animation .* must be finite"),
        ([0, 1], np.zeros((3, 4, 3)), r"positions of an animation have shape \(3, 4, 3\), must be \(2, q, 3\)"),
        ([0, 1], np.zeros((2, 4, 2)), r"positions of an animation have shape \(2, 4, 2\)"),
        ([0], [[[0, 0, 0], [0, np.nan, 0]]], "vertex 1 of an animation has position .* at key 0"),
    ],
)
def test_a_wrong_animation_is_refused(times, positions, message):
    with pytest.raises(InputError, match=message):
        VertexAnimation(times, positions)


def test_an_animation_of_other_vertices_is_refused():
    with pytest.raises(InputError, match="the animation of an obstacle moves 3 vertices, must be 4"):
        Obstacle(SQUARE, HALVES, motion=VertexAnimation([0], np.zeros((1, 3, 3))))
