"""What a picture shows beside the bodies: obstacles and planes."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType
from typing import Any

import numpy as np

from qlb.arrays import FloatArray, IntArray
from qlb.results.run import Frame, Run

OBSTACLE, PLANE = "#c3c9d1", "#dde1e6"
REACH = 1.5
"""Half the side of the square that is drawn for a plane, in diagonals of the box that holds the bodies."""
MARGIN = 0.5
"""How far around that box obstacles count for the view, in its diagonals."""


@dataclass(frozen=True)
class Scenery:
    """Obstacles and planes in each frame."""

    triangles: IntArray
    """shape (t, 3)"""
    vertices: list[FloatArray]
    """of each frame [m], shape (q, 3)"""
    normals: FloatArray
    """of the planes, shape (p, 3)"""
    points: list[FloatArray]
    """on the planes in each frame [m], shape (p, 3)"""

    @staticmethod
    def of(run: Run, frames: Sequence[Frame]) -> Scenery:
        """That of a run."""
        n = len(run.mesh.positions)
        return Scenery(
            run.parts.obstacle_triangles - np.int32(n),
            [frame.positions[n:] for frame in frames],
            run.parts.planes[:, 3:],
            [frame.plane_points for frame in frames],
        )

    @property
    def is_empty(self) -> bool:
        """Whether there is nothing but the bodies."""
        return len(self.triangles) == 0 and len(self.normals) == 0

    def around(self, bodies: FloatArray) -> FloatArray:
        """The vertices that lie near points of the bodies (k, 3): others would make the bodies too small to see."""
        low, high = bodies.min(axis=0), bodies.max(axis=0)
        margin = MARGIN * float(np.linalg.norm(high - low))
        points = np.concatenate(self.vertices)
        near = ((points >= low - margin) & (points <= high + margin)).all(axis=1)
        return np.asarray(points[near])

    def squares(self, frame: int, bodies: FloatArray) -> list[FloatArray]:
        """A square of each plane (4, 3) [m], below or behind points of the bodies (k, 3)."""
        low, high = bodies.min(axis=0), bodies.max(axis=0)
        centre, half = 0.5 * (low + high), REACH * float(np.linalg.norm(high - low))
        squares = []
        for point, normal in zip(self.points[frame], self.normals, strict=True):
            first = np.cross(normal, np.eye(3)[np.argmin(np.abs(normal))])
            first /= np.linalg.norm(first)
            second = np.cross(normal, first)
            middle = centre - ((centre - point) @ normal) * normal
            corners = [middle + half * (a * first + b * second) for a, b in ((-1, -1), (1, -1), (1, 1), (-1, 1))]
            squares.append(np.array(corners))
        return squares

    def show(self, plotter: Any, pyvista: ModuleType, frame: int, bodies: FloatArray, backward: FloatArray) -> None:
        """Show a frame in place of the one before; planes seen from behind (`backward` leads to the camera) faintly."""
        look = {"reset_camera": False, "render": False, "ambient": 0.5, "diffuse": 0.6, "specular": 0.0}
        if len(self.triangles):
            surface = pyvista.PolyData.from_regular_faces(self.vertices[frame], self.triangles)
            plotter.add_mesh(surface, name="obstacles", color=OBSTACLE, **look)
        for k, corners in enumerate(self.squares(frame, bodies)):
            square = pyvista.PolyData.from_regular_faces(corners, np.array([[0, 1, 2], [0, 2, 3]]))
            opacity = 1.0 if self.normals[k] @ backward > 0 else 0.2
            plotter.add_mesh(square, name=f"plane {k}", color=PLANE, opacity=opacity, **look)
