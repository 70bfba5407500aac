"""Rendering without a display: windows, cameras and images. Needs pyvista (`pip install "qlb[view]"`) and OpenGL."""

from __future__ import annotations

import os
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, replace
from functools import cache
from pathlib import Path
from types import ModuleType
from typing import Any

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray
from qlb.results.errors import MissingExtra, RenderingFailed

Image = npt.NDArray[np.uint8]

LOOK_FROM = (0.45, 0.35, 1.0)
"""Direction from the body to the camera; y is up."""
OVERSAMPLING = 2

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


@dataclass(frozen=True)
class Camera:
    """A parallel projection that holds a set of points; y is up."""

    focus: FloatArray
    direction: FloatArray
    """from the focus to the camera, of length 1"""
    extent: tuple[float, float]
    """width and height of the points as seen [m]"""
    depth: float

    @staticmethod
    def facing(points: FloatArray) -> Camera:
        """One that looks at points (k, 3) [m] from in front, a little from the right and from above."""
        axes = Camera.axes()
        seen = points @ axes.T
        low, high = seen.min(axis=0), seen.max(axis=0)
        width, height, depth = np.maximum(high - low, 1e-9 * max(1.0, float((high - low).max())))
        return Camera(0.5 * (low + high) @ axes, axes[2], (float(width), float(height)), float(depth))

    @staticmethod
    def axes() -> FloatArray:
        """Right, up and backward as `facing` looks, shape (3, 3)."""
        backward = np.asarray(LOOK_FROM) / np.linalg.norm(LOOK_FROM)
        right = np.cross((0.0, 1.0, 0.0), backward)
        right /= np.linalg.norm(right)
        return np.stack([right, np.cross(backward, right), backward])

    @staticmethod
    def around(points: FloatArray) -> Camera:
        """One that holds points (k, 3) [m] also where it is `turned`."""
        low, high = points.min(axis=0), points.max(axis=0)
        focus, direction = 0.5 * (low + high), Camera.axes()[2]
        across = 2 * float(np.hypot(*(points - focus)[:, [0, 2]].T).max())
        above = float(direction[1])
        height = float(high[1] - low[1]) * float(np.sqrt(1 - above**2)) + across * above
        return Camera(focus, direction, (across, height), max(across, height))

    def turned(self, angle: float) -> Camera:
        """The same, gone around the vertical axis by `angle` [rad]."""
        c, s = np.cos(angle), np.sin(angle)
        turn = np.array([[c, 0, s], [0, 1, 0], [-s, 0, c]])
        return replace(self, direction=turn @ self.direction)

    def aim(self, plotter: Any, height: float) -> None:
        """Let `plotter` look this way, at something `height` [m] high."""
        distance = 2 * (self.depth + self.extent[0] + self.extent[1])
        view = plotter.camera
        view.focal_point = tuple(self.focus)
        view.position = tuple(self.focus + distance * self.direction)
        view.up = (0.0, 1.0, 0.0)
        view.parallel_projection = True
        view.parallel_scale = 0.5 * height
        view.clipping_range = (0.1 * distance, 2 * distance)


@contextmanager
def open_plotter(pyvista: ModuleType, size: tuple[int, int]) -> Iterator[Any]:
    """A plotter for images of `size` (width, height) [pixels]. Raises `RenderingFailed` as `window_class`."""
    with _opengl_window(window_class()):
        width, height = size
        plotter = pyvista.Plotter(
            off_screen=True, window_size=(OVERSAMPLING * width, OVERSAMPLING * height), lighting="light kit"
        )
        try:
            plotter.set_background("white")
            yield plotter
        finally:
            plotter.close()


def photograph(plotter: Any) -> Image:
    """What the plotter shows, with smooth edges, shape (height, width, 3)."""
    plotter.render()
    image = np.asarray(plotter.screenshot(return_img=True))
    block = [image[i::OVERSAMPLING, j::OVERSAMPLING] for i in range(OVERSAMPLING) for j in range(OVERSAMPLING)]
    total = np.full(block[0].shape, len(block) // 2, np.uint16)
    for part in block:
        total += part
    return (total // len(block)).astype(np.uint8)


def import_pyvista() -> ModuleType:
    """pyvista. Raises `MissingExtra` where it is not installed."""
    try:
        import pyvista
    except ImportError as error:
        raise MissingExtra(f'a picture needs pyvista: pip install "qlb[view]" ({error})') from None
    module: ModuleType = pyvista
    return module


@cache
def window_class() -> str:
    """The kind of window that VTK renders with here, such as "vtkEGLRenderWindow"; tried in another process.

    Raises:
        RenderingFailed: there is no OpenGL to render with.
    """
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
