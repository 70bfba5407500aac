"""A sitting bunny."""

from __future__ import annotations

from qlb.shapes.primitives import above, ellipsoid, round_cone, sphere
from qlb.shapes.solid import Solid


def bunny_solid() -> Solid:
    """The bunny, about 0.3 m tall; the ears are thick enough for 8000 tets [m]."""
    return _body().smooth_union(_head(), 0.03).mirrored(0.006).smooth_intersection(above(0.0), 0.012)


def _body() -> Solid:
    haunch = ellipsoid((0.058, 0.052, 0.038)).rotated((0, 0, 1), 25).moved((-0.024, 0.052, 0.055))
    # What lies between the paws and under the belly, so that no crevices are left there.
    base = ellipsoid((0.074, 0.032, 0.066), (-0.010, 0.006, 0.0)).smooth_union(
        round_cone((0.040, 0.070, 0.0), (0.058, 0.004, 0.0), 0.026, 0.028), 0.02
    )
    return (
        ellipsoid((0.080, 0.080, 0.074), (-0.030, 0.066, 0.0))
        .smooth_union(ellipsoid((0.052, 0.066, 0.056), (0.030, 0.084, 0.0)), 0.07)
        .smooth_union(round_cone((0.026, 0.100, 0.0), (0.040, 0.140, 0.0), 0.052, 0.046), 0.05)
        .smooth_union(base, 0.02)
        .smooth_union(haunch, 0.020)
        .smooth_union(round_cone((-0.014, 0.014, 0.064), (0.052, 0.013, 0.070), 0.030, 0.027), 0.024)
        .smooth_union(round_cone((0.052, 0.078, 0.030), (0.074, 0.010, 0.030), 0.027, 0.026), 0.026)
        .smooth_union(sphere(0.036, (-0.110, 0.056, 0.0)), 0.014)
    )


def _head() -> Solid:
    ear = (
        ellipsoid((0.026, 0.066, 0.031), (0, 0.048, 0))
        .smooth_union(sphere(0.026), 0.02)
        .rotated((0, 0, 1), 24)
        .rotated((1, 0, 0), 16)
        .moved((0.036, 0.204, 0.038))
    )
    return (
        ellipsoid((0.062, 0.056, 0.058), (0.058, 0.170, 0.0))
        .smooth_union(ellipsoid((0.032, 0.028, 0.036), (0.098, 0.154, 0.0)), 0.03)
        .smooth_union(sphere(0.014, (0.121, 0.164, 0.0)), 0.010)
        .smooth_union(ear, 0.022)
        .smooth_union(sphere(0.018, (0.0935, 0.187, 0.035)), 0.006)
    )
