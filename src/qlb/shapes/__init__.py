"""Shapes that are there without a file: plain bodies and characters, and solids to mesh of one's own."""

from __future__ import annotations

from collections.abc import Callable

from qlb.mesh import TetMesh
from qlb.shapes.characters import armadillo, bunny, duck
from qlb.shapes.mesher import mesh_solid
from qlb.shapes.plain import ball, box, cylinder, shell, torus
from qlb.shapes.primitives import above, ellipsoid, ring, round_cone, rounded_box, rounded_cylinder, sphere
from qlb.shapes.solid import Solid, smooth_minimum

SHAPES: dict[str, Callable[..., TetMesh]] = {
    function.__name__: function for function in (armadillo, ball, box, bunny, cylinder, duck, shell, torus)
}
"""What scene files call them."""

__all__ = [
    "SHAPES",
    "Solid",
    "above",
    "armadillo",
    "ball",
    "box",
    "bunny",
    "cylinder",
    "duck",
    "ellipsoid",
    "mesh_solid",
    "ring",
    "round_cone",
    "rounded_box",
    "rounded_cylinder",
    "shell",
    "smooth_minimum",
    "sphere",
    "torus",
]
