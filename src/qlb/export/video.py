"""MP4 and GIF: the animation as a video. Needs pyvista, and for MP4 imageio-ffmpeg."""

from __future__ import annotations

import subprocess
from collections.abc import Iterator
from contextlib import suppress
from pathlib import Path
from typing import Any

import numpy as np

from qlb.arrays import FloatArray
from qlb.errors import InputError, MissingExtra
from qlb.export.foot import Foot
from qlb.export.format import Format
from qlb.export.recording import Recording
from qlb.results import Frame
from qlb.results.files import replacing
from qlb.results.rendering import Camera, Image, import_pyvista, open_plotter, photograph
from qlb.results.scenery import Scenery
from qlb.results.shown import ShownBodies

TURN_FRAMES = 120
"""Images of a turn around one frame of a run."""
_MARGIN = 1.08
_FOOT = 0.11
"""Part of the height that time and colours take."""


def write_mp4(
    recording: Recording, path: Path, *, turntable: bool = False, fps: float = 30.0, size: tuple[int, int] = (1280, 720)
) -> list[Path]:
    """Write an H.264 video to `path`, an image for each frame of the run.

    Args:
        recording: the frames.
        path: the file.
        turntable: let the camera go once around; a single frame is shown from all sides.
        fps: images a second.
        size: width and height [pixels], made even.

    Raises:
        InputError: an argument is out of range; a frame is damaged.
        MissingExtra: pyvista or imageio-ffmpeg are not installed.
        RenderingFailed: there is no OpenGL to render with.
        WriteError: a file could not be written.
    """
    program, film = _ffmpeg(), _Film(recording, turntable, fps, size)
    with replacing(path) as temporary:
        _encode([program, *_arguments(film.size, fps), str(temporary)], film.images())
    return [path]


def _arguments(size: tuple[int, int], fps: float) -> list[str]:
    """Of ffmpeg but for the output: yuv420p is what every player reads, and with "+faststart" a page need not load all
    of the file to play it.
    """
    given = ["-f", "rawvideo", "-pix_fmt", "rgb24", "-s", f"{size[0]}x{size[1]}", "-r", f"{fps:.9g}", "-i", "-"]
    made = ["-an", "-c:v", "libx264", "-crf", "18", "-pix_fmt", "yuv420p", "-movflags", "+faststart"]
    return ["-y", "-loglevel", "error", *given, *made]


def _encode(command: list[str], images: Iterator[Image]) -> None:
    """Run ffmpeg over the images. Raises `OSError` with its words where it fails."""
    with subprocess.Popen(command, stdin=subprocess.PIPE, stdout=subprocess.DEVNULL, stderr=subprocess.PIPE) as process:
        assert process.stdin is not None
        assert process.stderr is not None
        try:
            with suppress(BrokenPipeError):  # it has ended, and says why
                for image in images:
                    process.stdin.write(image.tobytes())
                process.stdin.close()
        except BaseException:
            process.kill()
            raise
        words = process.stderr.read().decode(errors="replace").split()
    if process.returncode != 0:
        raise OSError(f"ffmpeg failed: {' '.join(words)[-300:]}")


def write_gif(
    recording: Recording, path: Path, *, turntable: bool = False, fps: float = 25.0, size: tuple[int, int] = (640, 360)
) -> list[Path]:
    """Write a GIF to `path` that plays again and again; arguments and errors as `write_mp4`.

    Images last a whole number of hundredths of a second, 0.02 s at least: 25 or 50 images a second are exact.
    """
    from PIL import Image as Pillow

    film = _Film(recording, turntable, fps, size)
    duration = max(20, 10 * round(100 / fps))
    palette = Pillow.Palette.ADAPTIVE
    images = (Pillow.fromarray(image).convert("P", palette=palette, colors=128) for image in film.images())
    with replacing(path) as temporary:
        next(images).save(temporary, save_all=True, append_images=images, duration=duration, loop=0)
    return [path]


class _Film:
    """The images of a video."""

    def __init__(self, recording: Recording, turntable: bool, fps: float, size: tuple[int, int]) -> None:
        if not 0 < fps <= 240:
            raise InputError(f"fps = {fps!r} is out of range: must be > 0 and <= 240")
        if not all(32 <= pixels <= 8192 for pixels in size):
            raise InputError(f"size = {size!r} is out of range: must be 32 to 8192 pixels wide and high")
        self._pyvista = import_pyvista()
        self._recording, self._turntable = recording, turntable
        self.size = (size[0] // 2 * 2, size[1] // 2 * 2)
        self._bodies = ShownBodies.of(recording.run)
        self._survey()

    def _survey(self) -> None:
        """Camera, box of the bodies and colours that fit all frames."""
        extremes, largest = list[FloatArray](), 0.0
        axes = np.concatenate([np.eye(3), Camera.axes()])
        for frame in self._recording.read():
            x = self._bodies.at(frame)
            seen = x @ axes.T
            extremes += [x[seen.argmin(axis=0)], x[seen.argmax(axis=0)]]
            largest = max(largest, float(self._bodies.displacement(x).max()))
        points = np.concatenate(extremes)
        self._box, self._largest = np.stack([points.min(axis=0), points.max(axis=0)]), largest or 1.0
        ends = [self._recording.run.frame(self._recording.steps[k]) for k in (0, -1)]
        shown = np.concatenate([points, Scenery.of(self._recording.run, ends).around(points)])
        self._camera = Camera.around(shown) if self._turntable else Camera.facing(shown)

    def images(self) -> Iterator[Image]:
        """Each image, shape (height, width, 3)."""
        foot = Foot(self._bodies, self._largest, (self.size[0], int(_FOOT * self.size[1])))
        width, height = self.size[0], self.size[1] - foot.height
        high = max(self._camera.extent[1], self._camera.extent[0] * height / width) * _MARGIN
        shots = TURN_FRAMES if self._turntable and len(self._recording.steps) == 1 else 1
        total, shot = shots * len(self._recording.steps), 0
        with open_plotter(self._pyvista, (width, height)) as plotter:
            for frame in self._recording.frames():
                for _ in range(shots):
                    camera = self._camera.turned(2 * np.pi * shot / total) if self._turntable else self._camera
                    camera.aim(plotter, high)
                    self._show(plotter, frame, camera)
                    shot += 1
                    yield np.concatenate([photograph(plotter), foot.at(frame.time)])

    def _show(self, plotter: Any, frame: Frame, camera: Camera) -> None:
        scenery = Scenery.of(self._recording.run, [frame])
        scenery.show(plotter, self._pyvista, 0, self._box, camera.direction)
        self._bodies.add(plotter, self._pyvista, self._bodies.at(frame), self._largest)


def _ffmpeg() -> str:
    """The program that imageio-ffmpeg brings along, or the one that IMAGEIO_FFMPEG_EXE names."""
    try:
        import imageio_ffmpeg
    except ImportError as error:
        raise MissingExtra(f'the format mp4 needs imageio-ffmpeg: pip install "qlb[video]" ({error})') from None
    return str(imageio_ffmpeg.get_ffmpeg_exe())


_OPTIONS = ("turntable", "fps", "size")
MP4 = Format("mp4", "a video of the rendered bodies", (".mp4",), write_mp4, options=_OPTIONS)
GIF = Format("gif", "a small video that plays anywhere", (".gif",), write_gif, options=_OPTIONS)
