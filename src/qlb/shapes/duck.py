"""A rubber duck."""

from __future__ import annotations

from qlb.shapes.primitives import above, ellipsoid, round_cone, sphere
from qlb.shapes.solid import Solid


def duck_solid() -> Solid:
    """The duck, about 0.25 m tall; its thin parts are thick enough for 8000 tets [m]."""
    trunk = (
        ellipsoid((0.112, 0.070, 0.086), (0.0, 0.056, 0.0))
        .smooth_union(sphere(0.064, (0.050, 0.076, 0.0)), 0.06)
        .smooth_union(round_cone((-0.068, 0.080, 0.0), (-0.120, 0.124, 0.0), 0.044, 0.024), 0.06)
        .smooth_union(round_cone((0.050, 0.090, 0.0), (0.056, 0.145, 0.0), 0.050, 0.048), 0.05)
    )
    wing = round_cone((0.016, 0.070, 0.064), (-0.046, 0.086, 0.068), 0.038, 0.029).smooth_union(
        round_cone((-0.046, 0.086, 0.068), (-0.076, 0.104, 0.066), 0.029, 0.022), 0.02
    )
    bill = (
        ellipsoid((0.040, 0.019, 0.040))
        .rotated((0, 0, 1), 10)
        .moved((0.124, 0.179, 0.0))
        .smooth_union(ellipsoid((0.034, 0.018, 0.032), (0.115, 0.157, 0.0)), 0.005)
    )
    return (
        trunk.smooth_union(sphere(0.065, (0.060, 0.185, 0.0)), 0.02)
        .smooth_union(wing, 0.02)
        .smooth_union(bill, 0.014)
        .smooth_union(sphere(0.0175, (0.1025, 0.2105, 0.0325)), 0.010)
        .mirrored(0.010)
        .smooth_intersection(above(0.0), 0.012)
    )
