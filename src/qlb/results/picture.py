"""A rendered picture of chosen frames; needs pyvista (`pip install "qlb[view]"`) and OpenGL."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from dataclasses import dataclass
from functools import cache, cached_property
from math import ceil
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt
from matplotlib import colormaps
from matplotlib.cm import ScalarMappable
from matplotlib.colors import ListedColormap, Normalize
from matplotlib.figure import Figure
from matplotlib.patches import Patch

from qlb.arrays import FloatArray, IntArray
from qlb.errors import InputError
from qlb.results import style
from qlb.results.errors import MissingExtra, RenderingFailed
from qlb.results.run import Frame, Run
from qlb.results.scenery import Scenery

Image = npt.NDArray[np.uint8]

COLOURS = ListedColormap(colormaps["viridis"](np.linspace(0.22, 1.0, 256)), name="displacement")
"""viridis without its darkest end, in which edges and shading would not show."""
LOOK_FROM = (0.45, 0.35, 1.0)
"""Direction from the body to the camera; y is up."""
OVERSAMPLING = 2
_TITLE, _BAR, _MARGIN = 34, 78, 14
_DPI = 100
_REST = "#9aa5b1"

# VTK picks X, then EGL, then OSMesa at run time. Where none works it does not raise: it crashes in the first Render.
# So another process tries first, and says which kind of window it got.
_PROBE = """
import vtkmodules.vtkRenderingOpenGL2
from vtkmodules.vtkRenderingCore import vtkRenderWindow
window = vtkRenderWindow()
window.SetOffScreenRendering(1)
window.SetSize(8, 8)
window.Render()
print(window.GetClassName())
"""


def render_frames(
    run: Run, path: Path, *, steps: Sequence[int] | None = None, size: tuple[int, int] = (1600, 900)
) -> None:
    """Render chosen frames side by side into one PNG, all from the same camera.

    The surface is coloured by the distance of each vertex from its place at rest, or where there are several bodies by
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
    pyvista = _import_pyvista()
    window = _window_class()
    frames = [run.frame(step) for step in (_spread(run.frame_steps) if steps is None else steps)]
    if not frames:
        raise InputError(f"run {run.directory} has no frames to render")
    surface = _Surface.of(run, frames)
    scenery = Scenery.of(run, frames)
    camera = _Camera.facing(np.concatenate([surface.everywhere, scenery.around(surface.everywhere)]))
    grid = _Grid.best(len(frames), camera.extent, size)
    with _opengl_window(window):
        images = _render(pyvista, surface, scenery, camera, grid)
    with style.look():
        style.save(_compose(images, frames, surface, grid), path)


def _spread(steps: Sequence[int], count: int = 6) -> list[int]:
    """Up to `count` of the steps, evenly spread; the first, which is at rest, only where there are no others."""
    later = steps[1:] or steps
    chosen = np.linspace(0, len(later), min(count, len(later)) + 1)[1:]
    return [later[round(i) - 1] for i in chosen]


@dataclass(frozen=True)
class _Surface:
    """What is shown of all bodies, at rest and in each frame."""

    triangles: IntArray
    rest: FloatArray
    deformed: list[FloatArray]
    body: IntArray
    """of each vertex, shape (k,)"""
    names: tuple[str, ...]
    """of the bodies"""

    @staticmethod
    def of(run: Run, frames: Sequence[Frame]) -> _Surface:
        parts = run.parts
        shown = parts.mesh.rendered()
        deformed = [shown.of_nodes(frame.positions) for frame in frames]
        rest = shown.of_nodes(parts.mesh.positions)
        return _Surface(shown.triangles, rest, deformed, parts.groups[shown.nodes[:, 0]], parts.body_names)

    @cached_property
    def everywhere(self) -> FloatArray:
        """All positions that are shown [m], shape (k, 3)."""
        return np.concatenate([self.rest, *self.deformed])

    @property
    def colours(self) -> list[str]:
        """The colour of each body, where there are several."""
        return [style.LINES[b % len(style.LINES)] for b in range(len(self.names))]

    def scalars(self, x: FloatArray) -> dict[str, Any]:
        """What `add_mesh` is to colour the surface by when it is at `x`: displacement, or the body."""
        if len(self.names) == 1:
            return {"scalars": self.displacement(x), "clim": (0.0, self.largest), "cmap": COLOURS}
        of_face = self.body[self.triangles[:, 0]]
        return {"scalars": of_face, "clim": (-0.5, len(self.names) - 0.5), "cmap": ListedColormap(self.colours)}

    def displacement(self, x: FloatArray) -> FloatArray:
        """Distance of each vertex from its place at rest [m], shape (k,)."""
        return np.asarray(np.linalg.norm(x - self.rest, axis=1))

    @property
    def largest(self) -> float:
        """The largest displacement in any frame [m]; 1 where nothing moved."""
        return max(float(self.displacement(x).max()) for x in self.deformed) or 1.0


@dataclass(frozen=True)
class _Camera:
    """A parallel projection that holds a set of points."""

    focus: FloatArray
    direction: FloatArray
    extent: tuple[float, float]
    """width and height of the points as seen [m]"""
    depth: float

    @staticmethod
    def facing(points: FloatArray) -> _Camera:
        backward = np.asarray(LOOK_FROM) / np.linalg.norm(LOOK_FROM)
        right = np.cross((0.0, 1.0, 0.0), backward)
        right /= np.linalg.norm(right)
        axes = np.stack([right, np.cross(backward, right), backward])
        seen = points @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        width, height, depth = np.maximum(high - low, 1e-9 * max(1.0, float((high - low).max())))
        return _Camera(0.5 * (low + high) @ axes, backward, (float(width), float(height)), float(depth))


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


def _render(pyvista: ModuleType, surface: _Surface, scenery: Scenery, camera: _Camera, grid: _Grid) -> list[Image]:
    """One image per frame, shape (height, width, 3)."""
    width, height = grid.cell
    plotter = pyvista.Plotter(
        off_screen=True, window_size=(OVERSAMPLING * width, OVERSAMPLING * height), lighting="light kit"
    )
    try:
        plotter.set_background("white")
        _aim(plotter, camera, height / grid.scale)
        if scenery.is_empty:
            _add_rest(plotter, pyvista, surface)
        images = []
        for frame, x in enumerate(surface.deformed):
            scenery.show(plotter, pyvista, frame, surface.everywhere, camera.direction)
            _add_bodies(plotter, pyvista.PolyData.from_regular_faces(x, surface.triangles), surface, x)
            plotter.render()
            images.append(_average(np.asarray(plotter.screenshot(return_img=True))))
        return images
    finally:
        plotter.close()


def _aim(plotter: Any, camera: _Camera, height: float) -> None:
    distance = 2 * (camera.depth + camera.extent[0] + camera.extent[1])
    view = plotter.camera
    view.focal_point = tuple(camera.focus)
    view.position = tuple(camera.focus + distance * camera.direction)
    view.up = (0.0, 1.0, 0.0)
    view.parallel_projection = True
    view.parallel_scale = 0.5 * height
    view.clipping_range = (0.1 * distance, 2 * distance)


def _add_rest(plotter: Any, pyvista: ModuleType, surface: _Surface) -> None:
    rest = pyvista.PolyData.from_regular_faces(surface.rest, surface.triangles)
    outline = rest.extract_feature_edges(40, boundary_edges=False, manifold_edges=False)
    if outline.n_points:
        plotter.add_mesh(outline, color=_REST, line_width=OVERSAMPLING, lighting=False)
    else:
        plotter.add_mesh(rest, color=_REST, opacity=0.15, lighting=False)


def _add_bodies(plotter: Any, bodies: Any, surface: _Surface, x: FloatArray) -> None:
    """Show `bodies` in place of those before."""
    plotter.add_mesh(
        bodies,
        name="bodies",
        reset_camera=False,
        **surface.scalars(x),
        show_scalar_bar=False,
        show_edges=len(surface.triangles) < 20_000,
        edge_color="#1f2933",
        edge_opacity=0.35,
        line_width=0.5 * OVERSAMPLING,
        ambient=0.5,
        diffuse=0.7,
        specular=0.05,
    )


def _average(image: Image) -> Image:
    """Blocks of pixels as one, which smooths edges."""
    height, width, _ = image.shape
    blocks = image.reshape(height // OVERSAMPLING, OVERSAMPLING, width // OVERSAMPLING, OVERSAMPLING, 3)
    return np.asarray(blocks.mean(axis=(1, 3)).round(), dtype=np.uint8)


def _compose(images: Sequence[Image], frames: Sequence[Frame], surface: _Surface, grid: _Grid) -> Figure:
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
    if len(surface.names) > 1:
        _add_names(figure, surface)
        return figure
    bar = figure.add_axes((0.25, 46 / height, 0.5, 14 / height))
    colours = ScalarMappable(Normalize(0, surface.largest), COLOURS)
    figure.colorbar(colours, cax=bar, orientation="horizontal")
    bar.set_xlabel("displacement [m]", labelpad=2)
    return figure


def _add_names(figure: Figure, surface: _Surface, most: int = 8) -> None:
    """The colour of each of the first bodies that has a name."""
    named = [(name, colour) for name, colour in zip(surface.names, surface.colours, strict=True) if name][:most]
    if named:
        patches = [Patch(color=colour, label=name) for name, colour in named]
        figure.legend(handles=patches, loc="lower center", ncols=len(patches))


def _time_texts(times: Sequence[float]) -> list[str]:
    """The times with as many decimals as tell them exactly, six at most."""
    decimals = next((d for d in range(6) if all(abs(round(t, d) - t) < 1e-9 for t in times)), 6)
    return [f"t = {time:.{decimals}f} s" for time in times]


def _import_pyvista() -> ModuleType:
    try:
        import pyvista
    except ImportError as error:
        raise MissingExtra(f'a picture needs pyvista: pip install "qlb[view]" ({error})') from None
    module: ModuleType = pyvista
    return module


@cache
def _window_class() -> str:
    """The kind of window that VTK renders with here, such as "vtkEGLRenderWindow"; tried in another process."""
    if not Path(sys.executable).stem.lower().startswith("py"):
        return ""  # embedded in another program, which cannot be asked to run a script
    try:
        tried = subprocess.run([sys.executable, "-c", _PROBE], capture_output=True, text=True, timeout=120, check=False)
    except (OSError, subprocess.TimeoutExpired) as error:
        raise RenderingFailed(f"cannot find out whether a picture can be rendered: {error}") from None
    if tried.returncode != 0:
        raise RenderingFailed(
            "no picture can be rendered: VTK found no OpenGL (neither a display, nor EGL, nor OSMesa); on Debian:"
            " apt install libegl1 libegl-mesa0 libgl1-mesa-dri"
        )
    return tried.stdout.split()[-1]


@contextmanager
def _opengl_window(name: str) -> Iterator[None]:
    """Within it, VTK makes windows of this class and does not try, and complain about, others first."""
    key = "VTK_DEFAULT_OPENGL_WINDOW"
    if not name or key in os.environ:
        yield
        return
    os.environ[key] = name
    try:
        yield
    finally:
        del os.environ[key]
