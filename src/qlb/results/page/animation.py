"""The moving surfaces of a run as data for the page, thinned out where they would make it too large."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any

import numpy as np

from qlb.arrays import FloatArray, IntArray
from qlb.results.page.fields import field_data, history_data, nodal_fields
from qlb.results.page.packing import pack, positions_data
from qlb.results.page.thinning import merge_vertices, spread
from qlb.results.run import Frame, Run
from qlb.results.scenery import Scenery

PAGE_BYTES = 15_000_000
"""About the size of a page at most."""
_VERTEX_BYTES = 400
"""Bytes of the page for each vertex of a surface: with more vertices than that they are merged."""
_FRAME_BYTES = 4.0
"""What a vertex takes in a frame, as a first guess."""
_FEWEST = 2


@dataclass(frozen=True)
class _Surface:
    """What is drawn of the bodies."""

    nodes: IntArray
    """that a vertex follows, shape (v, 4)"""
    weights: FloatArray
    """shape (v, 4)"""
    triangles: IntArray
    """shape (t, 3)"""
    all_vertices: int
    """before any were merged"""

    def of_nodes(self, values: FloatArray) -> FloatArray:
        return np.asarray(np.einsum("va,va...->v...", self.weights, values[self.nodes]))


class Animation:
    """The surfaces of a run, to be asked for frames as data of a page (web/src/data.ts says what it holds).

    Args:
        run: the run.
        most_bytes: of all frames together.

    Raises:
        InputError: a file of the run is missing or damaged.
    """

    def __init__(self, run: Run, *, most_bytes: int = PAGE_BYTES) -> None:
        self._run = run
        self._most_bytes = most_bytes
        self._fields, self._no_stress = nodal_fields(run)
        self._surface = _surface(run, most_bytes // _VERTEX_BYTES)

    def head(self) -> dict[str, Any]:
        """What does not change from frame to frame."""
        run, surface = self._run, self._surface
        parts = run.parts
        fields = [{"name": f.name, "label": f.label, "unit": f.unit} for f in self._fields]
        return {
            "vertices": len(surface.nodes),
            "triangles": _triangles_data(surface.triangles),
            "rest": positions_data(surface.of_nodes(parts.mesh.positions)[None]),
            "fields": [{"name": "displacement", "label": "Displacement", "unit": "m"}, *fields],
            "bodies": list(parts.body_names),
            "bodyOfVertex": pack(parts.groups[surface.nodes[:, :1]].astype(np.uint16)),
            "obstacles": {
                "vertices": len(parts.obstacle_vertices),
                "triangles": _triangles_data(parts.obstacle_triangles - np.int32(len(parts.mesh.positions))),
            },
            "normals": parts.planes[:, 3:].tolist(),
            "failedSteps": list(run.summary["failed_steps"]),
        }

    def chunk(self, steps: Sequence[int]) -> dict[str, Any]:
        """The frames of `steps`, at least one."""
        frames = [self._run.frame(step) for step in steps]
        snapshots = [self._run.snapshot(frame) for frame in frames]
        surface = self._surface
        scenery = Scenery.of(self._run, frames)
        bodies = np.stack([surface.of_nodes(frame.positions) for frame in frames])
        return {
            "steps": list(steps),
            "times": [frame.time for frame in frames],
            "positions": positions_data(bodies),
            "fields": [
                field_data(field, [surface.of_nodes(field.values(now)) for now in snapshots]) for field in self._fields
            ],
            "obstacles": _obstacles_data(scenery, frames),
            "history": None if self._no_stress else history_data(snapshots),
            "planePoints": [points.tolist() for points in scenery.points],
        }

    def chosen(self) -> tuple[dict[str, Any], str]:
        """All frames, or as many as fit, in one chunk; and what to say where not all is there."""
        every = self._run.frame_steps
        count = min(len(every), max(_FEWEST, int(self._most_bytes / (_FRAME_BYTES * len(self._surface.nodes)))))
        while True:
            steps = spread(every, count)
            chunk = self.chunk(steps)
            size = _size(chunk)
            if size <= self._most_bytes or count <= _FEWEST:
                return chunk, self._note(chunk, len(every))
            count = max(_FEWEST, min(count - 1, int(0.95 * count * self._most_bytes / size)))

    def _note(self, chunk: dict[str, Any], every: int) -> str:
        """What a reader should know of the frames that are shown."""
        box = chunk["positions"]
        off = 0.5 * max(high - low for low, high in zip(box["low"], box["high"], strict=True)) / 65535
        notes = [f"Drawn positions are rounded, by at most {off:.1g} m."]
        if (shown := len(chunk["steps"])) < every:
            notes.append(f"To keep the page small it has {shown} of {every} frames, spread evenly.")
        if (now := len(self._surface.nodes)) < self._surface.all_vertices:
            merged = f"{self._surface.all_vertices} vertices of the surface are merged into {now}"
            notes.append(f"To keep the page small {merged}.")
        if self._no_stress:
            notes.append(f"Stress, energies and momentum are left out: {self._no_stress}.")
        return " ".join(notes)


def _surface(run: Run, most_vertices: int) -> _Surface:
    whole = run.mesh.rendered()
    kept, triangles = merge_vertices(whole.of_nodes(run.mesh.positions), whole.triangles, most_vertices)
    return _Surface(whole.nodes[kept], whole.weights[kept], triangles, len(whole.nodes))


def _triangles_data(triangles: IntArray) -> dict[str, Any]:
    return {"count": len(triangles), "data": pack(triangles.astype(np.uint32)) if len(triangles) else ""}


def _obstacles_data(scenery: Scenery, frames: Sequence[Frame]) -> dict[str, Any] | None:
    """Their positions, once where none of them moves."""
    if len(scenery.triangles) == 0:
        return None
    moving = any((vertices != scenery.vertices[0]).any() for vertices in scenery.vertices)
    shown = scenery.vertices if moving else scenery.vertices[:1]
    return positions_data(np.stack(shown)) | {"frames": len(frames) if moving else 1}


def _size(data: object) -> int:
    """Characters of the texts in it, which are nearly all there is."""
    if isinstance(data, dict):
        return sum(map(_size, data.values()))
    if isinstance(data, list):
        return sum(map(_size, data))
    return len(data) if isinstance(data, str) else 8
