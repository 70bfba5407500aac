"""What surface formats show: bodies as their rendered surfaces, obstacles, and planes as squares."""

from __future__ import annotations

from collections.abc import Iterator
from dataclasses import dataclass
from typing import Literal

import numpy as np

from qlb.analysis import Snapshot
from qlb.arrays import BoolArray, FloatArray, IntArray
from qlb.export.recording import Recording
from qlb.results import Frame, style
from qlb.results.scenery import OBSTACLE, PLANE, Scenery

SQUARE = np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)


@dataclass(frozen=True)
class Skin:
    """A surface with its own name and colour."""

    name: str
    kind: Literal["body", "obstacle", "plane"]
    colour: tuple[float, float, float]
    """linear red, green and blue, from 0 to 1"""
    rows: IntArray
    """its vertices among all points of the drawing, shape (k,)"""
    triangles: IntArray
    """in terms of its vertices, outward, shape (t, 3)"""
    moves: bool
    """whether a vertex is elsewhere in another frame"""


class Drawing:
    """All skins of a recording. Making one reads every frame once, to learn what moves and how far.

    Points are the vertices of the bodies' surfaces, those of the obstacles, and the corners of the planes' squares.
    """

    def __init__(self, recording: Recording) -> None:
        run = recording.run
        self._parts, self.surface = run.parts, run.mesh.rendered()
        self._nodes = len(run.mesh.positions)
        self._run = run
        self.low, self.high, moved, moved_planes = self._survey(recording)
        self.skins = [*self._bodies(moved), *self._obstacles(moved), *self._planes(moved_planes)]

    @property
    def groups(self) -> IntArray:
        """Index of the skin of each point, shape (k,)."""
        counts = [len(skin.rows) for skin in self.skins]
        groups = np.empty(sum(counts), dtype=np.int32)
        groups[np.concatenate([skin.rows for skin in self.skins])] = np.repeat(np.arange(len(counts)), counts)
        return groups

    def points(self, frame: Frame) -> FloatArray:
        """All points in a frame [m], shape (k, 3)."""
        squares = Scenery.of(self._run, [frame]).squares(0, np.stack([self.low, self.high]))
        return np.concatenate([self.surface.of_nodes(frame.positions), frame.positions[self._nodes :], *squares])

    def velocities(self, frame: Frame) -> FloatArray:
        """Of all points [m/s], shape (k, 3); zero for planes."""
        still = np.zeros((4 * len(self._parts.planes), 3))
        return np.concatenate([self.surface.of_nodes(frame.velocities), frame.velocities[self._nodes :], still])

    def von_mises(self, state: Snapshot) -> FloatArray:
        """Von Mises stress at all points [Pa], shape (k,); zero but on bodies."""
        rest = self._parts.nodes - self._nodes + 4 * len(self._parts.planes)
        return np.concatenate([state.at_surface(state.von_mises_stress), np.zeros(rest)])

    def triangles(self) -> IntArray:
        """Of all skins, in terms of the points, shape (t, 3)."""
        return np.concatenate([skin.rows[skin.triangles] for skin in self.skins])

    def _survey(self, recording: Recording) -> tuple[FloatArray, FloatArray, BoolArray, BoolArray]:
        """The box of all bodies in all frames, which nodes move, and which planes."""
        first = None
        for frame in recording.read():
            bodies = frame.positions[: self._nodes]
            if first is None:
                first, low, high = frame, bodies.min(axis=0), bodies.max(axis=0)
                moved = np.zeros(len(frame.positions), dtype=bool)
                moved_planes = np.zeros(len(frame.plane_points), dtype=bool)
            low, high = np.minimum(low, bodies.min(axis=0)), np.maximum(high, bodies.max(axis=0))
            moved |= (frame.positions != first.positions).any(axis=1)
            moved_planes |= (frame.plane_points != first.plane_points).any(axis=1)
        return low, high, moved, moved_planes

    def _bodies(self, moved: BoolArray) -> Iterator[Skin]:
        surface, names = self.surface, self._parts.body_names
        body = self._parts.groups[surface.nodes[:, 0]]
        for b, name in enumerate(names):
            rows = np.flatnonzero(body == b).astype(np.int32)
            triangles = surface.triangles[body[surface.triangles[:, 0]] == b]
            local = np.searchsorted(rows, triangles).astype(np.int32)
            colour = linear_colour(style.LINES[b % len(style.LINES)])
            moves = bool(moved[surface.nodes[rows]].any())
            yield Skin(name or f"body {b}", "body", colour, rows, local, moves)

    def _obstacles(self, moved: BoolArray) -> Iterator[Skin]:
        parts, names = self._parts, self._parts.obstacle_names
        begin = len(self.surface.tets) - self._nodes
        for o, name in enumerate(names):
            nodes = np.flatnonzero(parts.groups == parts.bodies + o).astype(np.int32)
            triangles = parts.obstacle_triangles[parts.groups[parts.obstacle_triangles[:, 0]] == parts.bodies + o]
            local = (triangles - nodes[0]).astype(np.int32)
            moves = bool(moved[nodes].any())
            yield Skin(name or f"obstacle {o}", "obstacle", linear_colour(OBSTACLE), nodes + begin, local, moves)

    def _planes(self, moved: BoolArray) -> Iterator[Skin]:
        begin = len(self.surface.tets) + self._parts.nodes - self._nodes
        for k, moves in enumerate(moved):
            rows = np.arange(begin + 4 * k, begin + 4 * k + 4, dtype=np.int32)
            yield Skin(f"plane {k}", "plane", linear_colour(PLANE), rows, SQUARE, bool(moves))


def linear_colour(text: str) -> tuple[float, float, float]:
    """A colour such as "#0072B2", which is meant for screens, in linear light (IEC 61966-2-1)."""
    srgb = np.array([int(text[k : k + 2], 16) for k in (1, 3, 5)]) / 255
    linear = np.where(srgb <= 0.04045, srgb / 12.92, ((srgb + 0.055) / 1.055) ** 2.4)
    red, green, blue = linear.tolist()
    return red, green, blue
