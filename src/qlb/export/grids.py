"""What VTK's formats show: the tets or the surface of the bodies, and beside them obstacles and planes."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass
from typing import Any, Literal

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray
from qlb.export.drawing import Drawing
from qlb.export.recording import Recording
from qlb.results import Frame

Data = dict[str, npt.NDArray[Any]]

COMPONENTS = ((0, 0), (1, 1), (2, 2), (0, 1), (1, 2), (0, 2))
"""Order in which VTK has the six numbers of a symmetric tensor."""


@dataclass(frozen=True)
class Sample:
    """A grid in one frame. Fields are float32: they are there to be looked at."""

    points: FloatArray
    """[m]"""
    point_data: Data
    cell_data: Data


class Grid(ABC):
    """Cells that stay, of points that move.

    Attributes:
        name: of the grid.
        cells: node indices, shape (c, 4) for tetrahedra, (c, 3) for triangles.
        fixed: data of the cells that stay.
    """

    name: str
    cells: IntArray
    fixed: Data

    @property
    def cell_type(self) -> Literal["tetra", "triangle"]:
        """Kind of all its cells."""
        return "tetra" if self.cells.shape[1] == 4 else "triangle"

    @property
    def moves(self) -> bool:
        """Whether anything differs from frame to frame."""
        return True

    @abstractmethod
    def at(self, frame: Frame) -> Sample:
        """The grid in a frame."""


class Volume(Grid):
    """The tets of all bodies."""

    def __init__(self, recording: Recording) -> None:
        run = recording.run
        self._recording, self._rest = recording, run.mesh.positions
        body = run.parts.groups[run.mesh.tets[:, 0]]
        self.name, self.cells, self.fixed = "bodies", run.mesh.tets, {"body": body}

    def at(self, frame: Frame) -> Sample:
        """Nodes: displacement, velocity, force of contact. Tets: stress, energy density."""
        n = len(self._rest)
        x = frame.positions[:n]
        nodes = {"displacement": x - self._rest, "velocity": frame.velocities[:n]}
        if self._recording.has_contact:
            nodes["contact_force"] = contact_forces(frame)[:n]
        tets: Data = {}
        if self._recording.without_stress is None:
            state = self._recording.run.snapshot(frame)
            tets = {
                "cauchy_stress": np.stack([state.cauchy_stress[:, i, j] for i, j in COMPONENTS], axis=1),
                "von_mises_stress": state.von_mises_stress,
                "energy_density": state.energy_density,
            }
        return Sample(x, _single(nodes), _single(tets))


class Surface(Grid):
    """The rendered surface of all bodies."""

    def __init__(self, recording: Recording) -> None:
        mesh = recording.run.mesh
        self._recording, self._surface = recording, mesh.rendered()
        self._rest = self._surface.of_nodes(mesh.positions)
        body = recording.run.parts.groups[self._surface.nodes[:, 0]]
        self.name, self.cells = "surface", self._surface.triangles
        self.fixed = {"body": body[self._surface.triangles[:, 0]]}

    def at(self, frame: Frame) -> Sample:
        """Vertices: displacement, velocity, von Mises stress; force of contact where they are nodes."""
        of_nodes = self._surface.of_nodes
        x = of_nodes(frame.positions)
        vertices = {"displacement": x - self._rest, "velocity": of_nodes(frame.velocities)}
        mesh = self._recording.run.mesh
        if self._recording.has_contact and mesh.surface is None:
            vertices["contact_force"] = of_nodes(contact_forces(frame))
        if self._recording.without_stress is None:
            state = self._recording.run.snapshot(frame)
            vertices["von_mises_stress"] = state.at_surface(state.von_mises_stress)
        return Sample(x, _single(vertices), {})


class Surroundings(Grid):
    """Obstacles, and planes as squares; `obstacle` numbers them."""

    def __init__(self, drawing: Drawing) -> None:
        self._drawing = drawing
        self._skins = [skin for skin in drawing.skins if skin.kind != "body"]
        rows = [skin.rows for skin in self._skins]
        begin = np.cumsum([0, *(len(r) for r in rows)])[:-1]
        self._rows = np.concatenate(rows)
        self.name = "surroundings"
        self.cells = np.concatenate([s.triangles + b for s, b in zip(self._skins, begin, strict=True)]).astype(np.int32)
        self.fixed = {"obstacle": np.repeat(np.arange(len(rows)), [len(s.triangles) for s in self._skins])}

    @property
    def moves(self) -> bool:
        """Whether one of them is elsewhere in another frame."""
        return any(skin.moves for skin in self._skins)

    def at(self, frame: Frame) -> Sample:
        """Where they are."""
        velocities = self._drawing.velocities(frame)[self._rows]
        return Sample(self._drawing.points(frame)[self._rows], _single({"velocity": velocities}), {})


def grids(recording: Recording, *, volume: bool) -> list[Grid]:
    """The bodies, then obstacles and planes where there are any."""
    bodies: Grid = Volume(recording) if volume else Surface(recording)
    parts = recording.run.parts
    beside = len(parts.obstacle_triangles) + len(parts.planes)
    return [bodies, Surroundings(Drawing(recording))] if beside else [bodies]


def contact_forces(frame: Frame) -> FloatArray:
    """Forces of contact on all nodes [N], shape (n + q, 3); zero before the first step."""
    return np.zeros_like(frame.positions) if frame.contact_forces is None else frame.contact_forces


def _single(data: Data) -> Data:
    return {name: array.astype(np.float32) for name, array in data.items()}
