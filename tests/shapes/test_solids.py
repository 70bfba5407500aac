"""Primitives and joints of solids against brute force, and the roots and quality that the mesher builds on."""

from __future__ import annotations

import numpy as np
import pytest

import qlb
from qlb import shapes
from qlb.shapes.smoothing import smooth, tet_quality

BALL = shapes.sphere(0.5)


@pytest.fixture
def points() -> np.ndarray:
    return np.random.default_rng(3).uniform(-1.5, 1.5, (2000, 3))


def test_round_cone_is_the_hull_of_balls(points):
    a, b = np.array([-0.4, 0.1, 0.2]), np.array([0.6, -0.2, 0.1])
    s = np.linspace(0, 1, 4001)[:, None]
    axis, radii = (1 - s) * a + s * b, 0.4 + s[:, 0] * (0.15 - 0.4)
    brute = np.array([(np.linalg.norm(p - axis, axis=1) - radii).min() for p in points[:300]])
    assert np.allclose(shapes.round_cone(a, b, 0.4, 0.15)(points[:300]), brute, atol=1e-6)


def test_ring_is_the_distance_from_a_circle(points):
    angle = np.linspace(0, 2 * np.pi, 4000)
    circle = 0.8 * np.stack([np.cos(angle), 0 * angle, np.sin(angle)], axis=-1)
    brute = np.array([np.linalg.norm(p - circle, axis=1).min() for p in points[:300]]) - 0.3
    assert np.allclose(shapes.ring(0.8, 0.3)(points[:300]), brute, atol=1e-5)


@pytest.mark.parametrize(
    "solid",
    [
        shapes.sphere(0.7, (0.1, 0, 0)),
        shapes.round_cone((-0.3, 0, 0), (0.4, 0.2, 0), 0.3, 0.2),
        shapes.ring(0.8, 0.3),
        shapes.rounded_box((1.2, 0.9, 0.7), 0.2),
        shapes.rounded_cylinder(0.6, 1.0, 0.2),
        shapes.rounded_box((1.2, 0.9, 0.7), 0.2).rotated((1, 2, 3), 40).moved((0.1, 0.2, -0.1)).scaled(0.9),
    ],
)
def test_distances_have_unit_slope_outside_and_bounds_hold(solid, points):
    outside = points[solid(points) > 1e-3]
    step = 1e-6
    gradient = np.stack([(solid(outside + d) - solid(outside - d)) / (2 * step) for d in step * np.eye(3)], axis=-1)
    assert np.allclose(np.linalg.norm(gradient, axis=1), 1, atol=1e-5)
    inside = points[solid(points) < 0]
    assert len(inside) >= 10
    assert (inside >= solid.low).all()
    assert (inside <= solid.high).all()


def test_ellipsoid_is_right_on_its_surface_and_at_its_centre():
    radii = np.array([1.0, 0.7, 0.5])
    solid = shapes.ellipsoid(radii)
    unit = np.random.default_rng(1).normal(size=(500, 3))
    unit /= np.linalg.norm(unit, axis=1)[:, None]
    normal = unit / radii
    normal /= np.linalg.norm(normal, axis=1)[:, None]
    assert np.abs(solid(unit * radii)).max() < 1e-15
    assert np.allclose(solid(unit * radii + 1e-5 * normal), 1e-5, rtol=1e-3)
    assert solid(np.zeros((1, 3)))[0] < 0


def test_joints(points):
    other = shapes.sphere(0.4, (0.5, 0.2, 0))
    in_first, in_second = BALL(points) < 0, other(points) < 0
    assert np.array_equal((BALL | other)(points) < 0, in_first | in_second)
    assert np.array_equal((BALL & other)(points) < 0, in_first & in_second)
    assert np.array_equal((BALL - other)(points) < 0, in_first & ~in_second)
    # Smooth joints differ only where the functions are close, and to one side.
    for sharp, rounded, sign in [
        (BALL | other, BALL.smooth_union(other, 0.2), -1),
        (BALL & other, BALL.smooth_intersection(other, 0.2), 1),
        (BALL - other, BALL.smooth_difference(other, 0.2), 1),
    ]:
        change = sign * (rounded(points) - sharp(points))
        assert change.min() >= 0
        assert 0 < change.max() <= 0.2 / 6


def test_smooth_minimum_is_twice_differentiable():
    a, r = np.array([0.3, -0.3, 0.0]), 0.3
    h = 1e-4
    second = (shapes.smooth_minimum(a + h, 0 * a, r) - 2 * shapes.smooth_minimum(a, 0 * a, r)) + (
        shapes.smooth_minimum(a - h, 0 * a, r)
    )
    # d2/da2 is -max(r - |a|, 0) / r^2: none at both ends of the seam, and the same from both sides in its middle.
    assert np.allclose(second / h**2, [0, 0, -1 / r], atol=2e-3)


def test_mirrored(points):
    solid = shapes.sphere(0.3, (0, 0, 0.5)).mirrored()
    both = shapes.sphere(0.3, (0, 0, 0.5)) | shapes.sphere(0.3, (0, 0, -0.5))
    assert np.allclose(solid(points), both(points))
    assert np.array_equal(solid.low, [-0.3, -0.3, -0.8])
    # With a radius the two halves meet without a crease: no slope across the plane, where there was one.
    step = np.array([[0.2, 0.1, 0.0], [0.2, 0.1, 1e-6]])
    assert np.diff(solid(step))[0] < -1e-7
    smooth_halves = shapes.sphere(0.3, (0, 0, 0.5)).mirrored(0.02)
    assert abs(np.diff(smooth_halves(step))[0]) < 1e-9
    assert np.allclose(smooth_halves(points * (1, 1, -1)), smooth_halves(points))


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: shapes.sphere(0), "radius 0 is out of range"),
        (lambda: shapes.round_cone((0, 0, 0), (0.1, 0, 0), 0.5, 0.2), "one ball holds the other"),
        (lambda: BALL.smooth_union(BALL, -1), "radius -1 is out of range"),
        (lambda: BALL.rotated((0, 0, 0), 10), "must have a direction"),
        (lambda: BALL.scaled(0), "factor 0 is out of range"),
        (lambda: BALL.moved((1, 2)), "shift has shape"),
    ],
)
def test_refusals(call, message):
    with pytest.raises(qlb.InputError, match=message):
        call()


def test_quality_of_a_regular_tet():
    corners = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1]], dtype=float)
    tets = np.array([[0, 1, 2, 3], [0, 2, 1, 3]], dtype=np.int32)
    assert np.allclose(np.abs(tet_quality(corners, tets)), 1)
    assert tet_quality(corners, tets).sum() == pytest.approx(0)


def test_smoothing_helps_and_never_harms_the_worst():
    solid = shapes.ellipsoid((0.3, 0.2, 0.15)).rotated((1, 2, 3), 30)
    before = shapes.mesh_solid(solid, tets=4000, smoothing=False)
    after = smooth(before, solid)
    assert np.array_equal(after.tets, before.tets)
    worst, best = (tet_quality(mesh.positions, mesh.tets) for mesh in (before, after))
    assert best.min() >= worst.min()
    assert np.percentile(best, 1) > 1.1 * np.percentile(worst, 1)
    assert after.edge_lengths().min() > 1.1 * before.edge_lengths().min()
    assert np.abs(solid(after.positions[np.unique(after.boundary_triangles())])).max() < 1e-7
    assert after.volumes().sum() == pytest.approx(before.volumes().sum(), rel=2e-3)
