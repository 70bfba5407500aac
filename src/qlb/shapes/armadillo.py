"""A standing armadillo, its arms held up and forward."""

from __future__ import annotations

from qlb.shapes.primitives import above, ellipsoid, ring, round_cone, sphere
from qlb.shapes.solid import Solid


def armadillo_solid() -> Solid:
    """The armadillo, about 0.3 m tall [m]; hands at the ends of its arms, feet on the ground."""
    return (
        _trunk()
        .smooth_union(_arm(), 0.025)
        .smooth_union(_leg(), 0.03)
        .smooth_union(_head(), 0.025)
        .mirrored(0.010)
        .smooth_intersection(above(0.0), 0.010)
    )


def _trunk() -> Solid:
    belly = ellipsoid((0.058, 0.072, 0.060), (0.0, 0.125, 0.0))
    back = ellipsoid((0.058, 0.078, 0.066), (-0.018, 0.135, 0.0))
    tail = round_cone((-0.045, 0.075, 0.0), (-0.115, 0.036, 0.0), 0.036, 0.026).smooth_union(
        round_cone((-0.115, 0.036, 0.0), (-0.172, 0.034, 0.0), 0.026, 0.021), 0.03
    )
    return belly.smooth_union(_plates(back), 0.03).smooth_union(tail, 0.04)


def _plates(back: Solid) -> Solid:
    """Three hoops around the back."""
    for x, y, radius, turn in [(-0.014, 0.170, 0.048, -32), (-0.020, 0.138, 0.058, -14), (-0.018, 0.106, 0.054, 6)]:
        hoop = ring(radius, 0.013).rotated((0, 0, 1), turn).moved((x, y, 0.0))
        back = back.smooth_union(hoop, 0.020)
    return back


def _arm() -> Solid:
    upper = round_cone((0.0, 0.172, 0.050), (0.042, 0.172, 0.094), 0.027, 0.023)
    lower = round_cone((0.042, 0.172, 0.094), (0.078, 0.215, 0.098), 0.023, 0.0215)
    hand = ellipsoid((0.025, 0.028, 0.025), (0.084, 0.226, 0.098))
    return upper.smooth_union(lower, 0.015).smooth_union(hand, 0.02)


def _leg() -> Solid:
    thigh = ellipsoid((0.044, 0.048, 0.034), (0.002, 0.080, 0.046))
    shin = round_cone((0.004, 0.070, 0.054), (-0.002, 0.020, 0.058), 0.030, 0.025)
    foot = round_cone((-0.004, 0.012, 0.058), (0.048, 0.010, 0.066), 0.027, 0.025)
    return thigh.smooth_union(shin, 0.02).smooth_union(foot, 0.02)


def _head() -> Solid:
    neck = round_cone((-0.002, 0.185, 0.0), (0.016, 0.225, 0.0), 0.042, 0.036)
    skull = ellipsoid((0.046, 0.040, 0.042), (0.024, 0.243, 0.0))
    snout = round_cone((0.045, 0.236, 0.0), (0.092, 0.222, 0.0), 0.030, 0.020)
    ear = ellipsoid((0.019, 0.034, 0.023), (0, 0.022, 0)).rotated((0, 0, 1), 12).rotated((1, 0, 0), 28)
    eye = sphere(0.0145, (0.054, 0.257, 0.029))
    head = skull.smooth_union(snout, 0.025).smooth_union(ear.moved((0.004, 0.262, 0.026)), 0.014)
    return neck.smooth_union(head, 0.02).smooth_union(eye, 0.008)
