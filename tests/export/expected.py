"""What every format must give back, from the frames by formulas of its own."""

from __future__ import annotations

import numpy as np

from qlb.results import Frame, Run
from tests.support import Array

SINGLE = 1.2e-7
"""Relative rounding of float32."""


def surface_points(run: Run, values: Array) -> Array:
    """Values over nodes at the vertices of the rendered surface, tet by tet and corner by corner."""
    surface = run.mesh.rendered()
    return np.array([w @ values[run.mesh.tets[t]] for t, w in zip(surface.tets, surface.weights, strict=True)])


def body_points(run: Run, frame: Frame, body: int) -> Array:
    """Rendered vertices of one body."""
    of_body = run.parts.groups[run.mesh.tets[run.mesh.rendered().tets, 0]] == body
    return surface_points(run, frame.positions)[of_body]


def body_velocities(run: Run, frame: Frame, body: int) -> Array:
    """Velocities of the same."""
    of_body = run.parts.groups[run.mesh.tets[run.mesh.rendered().tets, 0]] == body
    return surface_points(run, frame.velocities)[of_body]


def obstacle_points(run: Run, frame: Frame, obstacle: int) -> Array:
    """Vertices of one obstacle."""
    return frame.positions[run.parts.groups == run.parts.bodies + obstacle]


def body_triangles(run: Run, body: int) -> Array:
    """Corners of its triangles at rest, shape (t, 3, 3)."""
    surface = run.mesh.rendered()
    rest = surface_points(run, run.mesh.positions)
    of_body = run.parts.groups[run.mesh.tets[surface.tets, 0]] == body
    return rest[surface.triangles[of_body[surface.triangles[:, 0]]]]
