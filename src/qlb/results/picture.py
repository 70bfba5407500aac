"""A rendered picture of chosen frames; needs pyvista (`pip install "qlb[view]"`) and OpenGL."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass
from math import ceil
from pathlib import Path
from types import ModuleType

import numpy as np
from matplotlib.figure import Figure

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.results import style
from qlb.results.rendering import Camera, Image, import_pyvista, open_plotter, photograph
from qlb.results.run import Frame, Run
from qlb.results.scenery import Scenery
from qlb.results.shown import ShownBodies

_TITLE, _BAR, _MARGIN = 34, 78, 14
_DPI = 100


def render_frames(
    run: Run, path: Path, *, steps: Sequence[int] | None = None, size: tuple[int, int] = (1600, 900)
) -> None:
    """Render chosen frames side by side into one PNG, all from the same camera.

    The surface is coloured by the distance of each node from its place at rest, or where there are several bodies by
    the body. Obstacles and planes are grey; without any the rest shape is drawn faintly.

    Args:
        run: the run.
        path: the PNG to write.
        steps: steps to show, which must have frames; by default six spread over the run.
        size: width and height of the image at most [pixels]; empty margins are cut off.

    Raises:
        InputError: a step without a frame.
        MissingExtra: pyvista is not installed.
        RenderingFailed: there is no OpenGL to render with.
        WriteError: the file could not be written.
    """
    pyvista = import_pyvista()
    frames = [run.frame(step) for step in (_spread(run.frame_steps) if steps is None else steps)]
    if not frames:
        raise InputError(f"run {run.directory} has no frames to render")
    bodies = ShownBodies.of(run)
    placed = [bodies.at(frame) for frame in frames]
    scenery = Scenery.of(run, frames)
    everywhere = np.concatenate([bodies.rest, *placed])
    camera = Camera.facing(np.concatenate([everywhere, scenery.around(everywhere)]))
    grid = _Grid.best(len(frames), camera.extent, size)
    images = _render(pyvista, bodies, placed, scenery, camera, grid)
    with style.look():
        style.save(_compose(images, frames, bodies, _largest(bodies, placed), grid), path)


def _spread(steps: Sequence[int], count: int = 6) -> list[int]:
    """Up to `count` of the steps, evenly spread; the first, which is at rest, only where there are no others."""
    later = steps[1:] or steps
    chosen = np.linspace(0, len(later), min(count, len(later)) + 1)[1:]
    return [later[round(i) - 1] for i in chosen]


@dataclass(frozen=True)
class _Grid:
    """Rows and columns of equal cells."""

    rows: int
    columns: int
    cell: tuple[int, int]
    """width and height of a cell's image [pixels]"""
    scale: float
    """pixels per metre"""

    @staticmethod
    def best(count: int, extent: tuple[float, float], size: tuple[int, int]) -> _Grid:
        """The grid in which `count` images of something of `extent` [m] come out largest within `size` [pixels]."""

        def grid(columns: int) -> _Grid:
            rows = ceil(count / columns)
            width = max(16, (size[0] - _MARGIN) // columns - _MARGIN)
            height = max(16, (size[1] - _BAR) // rows - _TITLE)
            scale = min((width - _MARGIN) / extent[0], (height - _MARGIN) / extent[1])
            cell = (min(width, ceil(scale * extent[0]) + _MARGIN), min(height, ceil(scale * extent[1]) + _MARGIN))
            return _Grid(rows, columns, cell, scale)

        return max(map(grid, range(1, count + 1)), key=lambda g: g.scale)

    @property
    def size(self) -> tuple[int, int]:
        """Width and height of the whole image [pixels]."""
        width, height = self.cell
        return _MARGIN + self.columns * (width + _MARGIN), self.rows * (height + _TITLE) + _BAR


def _render(
    pyvista: ModuleType, bodies: ShownBodies, placed: list[FloatArray], scenery: Scenery, camera: Camera, grid: _Grid
) -> list[Image]:
    """One image per frame, shape (height, width, 3)."""
    everywhere, largest = np.concatenate([bodies.rest, *placed]), _largest(bodies, placed)
    images = []
    with open_plotter(pyvista, grid.cell) as plotter:
        camera.aim(plotter, grid.cell[1] / grid.scale)
        if scenery.is_empty:
            bodies.add_rest(plotter, pyvista)
        for frame, x in enumerate(placed):
            scenery.show(plotter, pyvista, frame, everywhere, camera.direction)
            bodies.add(plotter, pyvista, x, largest)
            images.append(photograph(plotter))
    return images


def _largest(bodies: ShownBodies, placed: Sequence[FloatArray]) -> float:
    """The largest displacement in any frame [m]; 1 where nothing moved."""
    return max(float(bodies.displacement(x).max()) for x in placed) or 1.0


def _compose(
    images: Sequence[Image], frames: Sequence[Frame], bodies: ShownBodies, largest: float, grid: _Grid
) -> Figure:
    """The images in a grid, each with its time, over one colour bar or the names of the bodies."""
    width, height = grid.size
    figure = Figure(figsize=(width / _DPI, height / _DPI), dpi=_DPI, facecolor="white")
    titles = _time_texts([frame.time for frame in frames])
    for i, (image, title) in enumerate(zip(images, titles, strict=True)):
        row, column = divmod(i, grid.columns)
        left = _MARGIN + column * (grid.cell[0] + _MARGIN)
        bottom = height - (row + 1) * (grid.cell[1] + _TITLE)
        figure.figimage(image, left, bottom)
        x, y = left + grid.cell[0] / 2, bottom + grid.cell[1] + _TITLE / 2
        figure.text(x / width, y / height, title, ha="center", va="center", fontsize=12)
    bodies.add_key(figure, (0.25, 46 / height, 0.5, 14 / height), largest)
    return figure


def _time_texts(times: Sequence[float]) -> list[str]:
    """The times with as many decimals as tell them exactly, six at most."""
    decimals = next((d for d in range(6) if all(abs(round(t, d) - t) < 1e-9 for t in times)), 6)
    return [f"t = {time:.{decimals}f} s" for time in times]
