"""Solids as the sets where a smooth function is negative, and how they are joined."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np

from qlb.arrays import FloatArray, vectors
from qlb.errors import InputError

Function = Callable[[FloatArray], FloatArray]


@dataclass(frozen=True)
class Solid:
    """The points where `function` is negative.

    Solids are joined by `|` (both), `&` (what is common), `-` (what is left), and with rounded seams by
    `smooth_union` and `smooth_difference`; they are placed by `moved`, `rotated` and `scaled`.

    Attributes:
        function: points [m] (k, 3) -> values (k,), < 0 inside, continuous, and near the surface about the distance
            from it [m].
        low: corner of a box that holds the solid [m], shape (3,).
        high: the opposite corner [m], shape (3,).
    """

    function: Function
    low: FloatArray
    high: FloatArray

    def __call__(self, points: FloatArray) -> FloatArray:
        """Values at points [m] (k, 3), shape (k,)."""
        return np.asarray(self.function(points), dtype=np.float64)

    def __or__(self, other: Solid) -> Solid:
        return self.smooth_union(other, 0.0)

    def __and__(self, other: Solid) -> Solid:
        return self.smooth_intersection(other, 0.0)

    def __sub__(self, other: Solid) -> Solid:
        return self.smooth_difference(other, 0.0)

    def smooth_union(self, other: Solid, radius: float) -> Solid:
        """Both solids, the seam between them filled where the two functions differ by less than `radius` [m]."""
        a, b, rise = self.function, other.function, _at_least("radius", radius, 0.0) / 6
        low, high = np.minimum(self.low, other.low) - rise, np.maximum(self.high, other.high) + rise
        return Solid(lambda x: smooth_minimum(a(x), b(x), radius), low, high)

    def smooth_intersection(self, other: Solid, radius: float) -> Solid:
        """What both solids hold, the edge rounded where the two functions differ by less than `radius` [m]."""
        a, b = self.function, other.function
        _at_least("radius", radius, 0.0)
        low, high = np.maximum(self.low, other.low), np.minimum(self.high, other.high)
        return Solid(lambda x: -smooth_minimum(-a(x), -b(x), radius), low, high)

    def smooth_difference(self, other: Solid, radius: float) -> Solid:
        """This solid without the other, the edge rounded where the functions add to less than `radius` [m]."""
        a, b = self.function, other.function
        _at_least("radius", radius, 0.0)
        return Solid(lambda x: -smooth_minimum(-a(x), b(x), radius), self.low, self.high)

    def moved(self, by: Sequence[float]) -> Solid:
        """The solid shifted by a vector [m]."""
        shift, function = vectors("shift", by, (3,)), self.function
        return Solid(lambda x: function(x - shift), self.low + shift, self.high + shift)

    def rotated(self, axis: Sequence[float], degrees: float) -> Solid:
        """The solid turned about an axis through the origin, by the right-hand rule."""
        R, function = _rotation(vectors("axis", axis, (3,)), np.radians(degrees)), self.function
        centre, half = 0.5 * (self.low + self.high), 0.5 * (self.high - self.low)
        middle, reach = R @ centre, np.abs(R) @ half
        # Not by BLAS, whose bits may depend on its threads.
        return Solid(lambda x: function(np.einsum("ij,jk->ik", x, R)), middle - reach, middle + reach)

    def scaled(self, factor: float) -> Solid:
        """The solid `factor` times as large, about the origin."""
        s, function = _at_least("factor", factor, 1e-12), self.function
        return Solid(lambda x: s * function(x / s), s * self.low, s * self.high)

    def mirrored(self, radius: float = 0.0) -> Solid:
        """The half z >= 0 of the solid, and its mirror image in the plane z = 0.

        With a `radius` r [m], |z| is taken as sqrt(z^2 + r^2), so that both halves meet smoothly.
        """
        function, reach = self.function, self.high[2]
        r = _at_least("radius", radius, 0.0)
        low, high = np.append(self.low[:2], -reach), np.append(self.high[:2], reach)
        return Solid(lambda x: function(np.column_stack([x[:, :2], np.hypot(x[:, 2], r)])), low, high)


def smooth_minimum(a: FloatArray, b: FloatArray, radius: float) -> FloatArray:
    """min(a, b) - max(r - |a - b|, 0)^3 / (6 r^2), twice continuously differentiable for r > 0.

    The cubic polynomial smooth minimum of I. Quilez (2013), "Smooth minimum", iquilezles.org/articles/smin.
    """
    if radius == 0:
        return np.minimum(a, b)
    near = np.maximum(radius - np.abs(a - b), 0.0)
    return np.asarray(np.minimum(a, b) - near**3 / (6 * radius**2))


def _rotation(axis: FloatArray, angle: float) -> FloatArray:
    """Rodrigues' formula, shape (3, 3)."""
    length = float(np.linalg.norm(axis))
    if length == 0:
        raise InputError("axis of rotation is (0, 0, 0), must have a direction")
    x, y, z = axis / length
    K = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.asarray(np.eye(3) + np.sin(angle) * K + (1 - np.cos(angle)) * K @ K)


def _at_least(name: str, value: float, low: float) -> float:
    if not (np.isfinite(value) and value >= low):
        raise InputError(f"{name} {value} is out of range: a number >= {low:g}")
    return float(value)
