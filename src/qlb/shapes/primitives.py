"""Smooth primitives about the origin, from which solids are joined.

The distance functions are the known closed forms, see I. Quilez, "Distance functions",
iquilezles.org/articles/distfunctions. All lengths in metres.
"""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from qlb.arrays import FloatArray, vectors
from qlb.errors import InputError
from qlb.shapes.solid import Solid


def sphere(radius: float, centre: Sequence[float] = (0, 0, 0)) -> Solid:
    """A ball; the function is the distance."""
    c, r = vectors("centre", centre, (3,)), positive("radius", radius)
    return Solid(lambda x: _norm(x - c) - r, c - r, c + r)


def ellipsoid(radii: Sequence[float], centre: Sequence[float] = (0, 0, 0)) -> Solid:
    """An ellipsoid with half-axes `radii`.

    With k = |x / r| and its gradient's length |x / r^2| / k, the function k (k - 1) / |x / r^2| is the distance to
    first order near the surface.
    """
    c, r = vectors("centre", centre, (3,)), vectors("radii", radii, (3,))
    for value in r:
        positive("radius", float(value))

    def function(x: FloatArray) -> FloatArray:
        k, slope = _norm((x - c) / r), _norm((x - c) / r**2)
        # At the centre k / slope is 0 / 0, with every value between the radii a limit.
        return np.asarray((k - 1) * np.where(slope > 0, k / np.where(slope > 0, slope, 1.0), r.min()))

    return Solid(function, c - r, c + r)


def round_cone(start: Sequence[float], end: Sequence[float], start_radius: float, end_radius: float) -> Solid:
    """The hull of two balls; a capsule where the radii are equal. The function is the distance.

    In the plane through the axis with u along it and v away from it, points whose nearest point is on the cone's side
    are told by u + v tan(slope), where sin(slope) = (start_radius - end_radius) / length.
    """
    a, b = vectors("start", start, (3,)), vectors("end", end, (3,))
    ra, rb = positive("start_radius", start_radius), positive("end_radius", end_radius)
    length = float(np.linalg.norm(b - a))
    if length <= abs(ra - rb):
        raise InputError(f"round cone of length {length:g} m with radii {ra:g} and {rb:g} m: one ball holds the other")
    sine = (ra - rb) / length
    cosine, axis = np.sqrt(1 - sine**2), (b - a) / length

    def function(x: FloatArray) -> FloatArray:
        u = np.einsum("ij,j->i", x - a, axis)
        v = _norm(x - a - u[:, None] * axis)
        along = u * cosine - v * sine  # of the foot of the perpendicular on the side
        side = u * sine + v * cosine - ra
        ends = np.where(along < 0, np.hypot(u, v) - ra, np.hypot(u - length, v) - rb)
        return np.asarray(np.where((along < 0) | (along > length * cosine), ends, side))

    return Solid(function, np.minimum(a - ra, b - rb), np.maximum(a + ra, b + rb))


def ring(radius: float, tube: float) -> Solid:
    """A ring about the y axis: a tube of radius `tube` around a circle of `radius`; the function is the distance."""
    R, r = positive("radius", radius), positive("tube", tube)
    if r >= R:
        raise InputError(f"tube {r:g} m is out of range: below the radius of the ring, {R:g} m")
    reach = np.array([R + r, r, R + r])
    return Solid(lambda x: np.hypot(np.hypot(x[:, 0], x[:, 2]) - R, x[:, 1]) - r, -reach, reach)


def rounded_box(size: Sequence[float], rounding: float) -> Solid:
    """A box of full lengths `size` with edges rounded to radius `rounding`; the function is the distance."""
    half, r = 0.5 * vectors("size", size, (3,)), positive("rounding", rounding)
    if r > half.min():
        raise InputError(f"rounding {r:g} m is out of range: at most half of the shortest side, {half.min():g} m")

    def function(x: FloatArray) -> FloatArray:
        q = np.abs(x) - (half - r)
        return np.asarray(_norm(np.maximum(q, 0.0)) + np.minimum(q.max(axis=1), 0.0) - r)

    return Solid(function, -half, half)


def rounded_cylinder(radius: float, height: float, rounding: float) -> Solid:
    """A cylinder about the y axis, its two rims rounded; the function is the distance."""
    R, half, r = positive("radius", radius), 0.5 * positive("height", height), positive("rounding", rounding)
    if r > min(R, half):
        raise InputError(f"rounding {r:g} m is out of range: at most {min(R, half):g} m")

    def function(x: FloatArray) -> FloatArray:
        u, v = np.hypot(x[:, 0], x[:, 2]) - (R - r), np.abs(x[:, 1]) - (half - r)
        outside = np.hypot(np.maximum(u, 0.0), np.maximum(v, 0.0))
        return np.asarray(outside + np.minimum(np.maximum(u, v), 0.0) - r)

    reach = np.array([R, half, R])
    return Solid(function, -reach, reach)


def above(height: float = 0.0) -> Solid:
    """The half-space y > height, to be used with `&` and `smooth_intersection`."""
    infinite = np.full(3, np.inf)
    return Solid(lambda x: height - x[:, 1], np.array([-np.inf, height, -np.inf]), infinite)


def positive(name: str, value: float) -> float:
    """`value`, which must be finite and > 0."""
    if not (np.isfinite(value) and value > 0):
        raise InputError(f"{name} {value} is out of range: a length > 0 m")
    return float(value)


def _norm(x: FloatArray) -> FloatArray:
    return np.asarray(np.sqrt(np.einsum("ij,ij->i", x, x)))
