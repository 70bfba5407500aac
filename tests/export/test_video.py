"""MP4 and GIF: as many images as frames, of the size asked for, that show the body where the run has it."""

from __future__ import annotations

import re
import subprocess
from itertools import pairwise
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import qlb
from qlb.export import Recording, video, write_gif, write_mp4
from qlb.export.foot import Foot
from qlb.results.rendering import Camera
from qlb.results.shown import ShownBodies

pytestmark = pytest.mark.usefixtures("can_render")


def probe(path: Path) -> tuple[int, tuple[int, int], float]:
    """Images, size and images a second, in the words of ffmpeg."""
    program = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    said = subprocess.run([program, "-i", path, "-f", "null", "-"], capture_output=True, text=True, check=True).stderr
    stream = re.search(r"Video: h264.*yuv420p.*?, (\d+)x(\d+).*?, ([\d.]+) fps", said)
    assert stream is not None, said
    return int(re.findall(r"frame=\s*(\d+)", said)[-1]), (int(stream[1]), int(stream[2])), float(stream[3])


def images(path: Path, size: tuple[int, int]) -> np.ndarray:
    program = pytest.importorskip("imageio_ffmpeg").get_ffmpeg_exe()
    raw = subprocess.run(
        [program, "-loglevel", "error", "-i", path, "-f", "rawvideo", "-pix_fmt", "rgb24", "-"],
        capture_output=True,
        check=True,
    ).stdout
    return np.frombuffer(raw, np.uint8).reshape(-1, size[1], size[0], 3).astype(int)


def centre_of_colour(image: np.ndarray) -> float:
    """How far down the coloured part of the scene lies, from 0 to 1."""
    scene = image[: int((1 - video._FOOT) * len(image))]
    coloured = np.ptp(scene, axis=2) > 60
    assert coloured.mean() > 0.01
    return float(np.mean(np.nonzero(coloured)[0]) / len(scene))


def test_mp4_has_an_image_for_each_frame(bar, tmp_path):
    (path,) = write_mp4(Recording.of(bar), tmp_path / "bar.mp4", fps=12.5, size=(161, 121))
    assert probe(path) == (4, (160, 120), 12.5)


def test_the_body_falls(make_still, tmp_path):
    (path,) = write_mp4(Recording.of(make_still()), tmp_path / "fall.mp4", size=(200, 160))
    seen = images(path, (200, 160))
    assert len(seen) == 3
    heights = [centre_of_colour(image) for image in seen]
    assert heights[0] < heights[1] < heights[2]


def test_a_turntable_of_one_frame(bar, tmp_path, monkeypatch):
    monkeypatch.setattr(video, "TURN_FRAMES", 4)
    (path,) = write_mp4(Recording.of(bar, "3"), tmp_path / "turn.mp4", turntable=True, size=(160, 120))
    assert probe(path)[0] == 4
    seen = images(path, (160, 120))
    assert all(np.abs(a - b).mean() > 1 for a, b in pairwise(seen))


def test_gif(bar, tmp_path):
    (path,) = write_gif(Recording.of(bar), tmp_path / "bar.gif", size=(120, 90))
    with Image.open(path) as image:
        assert (image.n_frames, image.size, image.info["duration"], image.info["loop"]) == (4, (120, 90), 40, 0)


def test_a_camera_that_turns_holds_everything(rng):
    points = rng.uniform(-1, 1, size=(50, 3)) * [3.0, 1.0, 0.5] + [1, 2, 3]
    camera = Camera.around(points)
    for angle in np.linspace(0, 2 * np.pi, 13):
        back = camera.turned(angle).direction
        right = np.cross([0.0, 1, 0], back)
        right /= np.linalg.norm(right)
        seen = (points - camera.focus) @ np.stack([right, np.cross(back, right)]).T
        assert (2 * np.abs(seen) <= np.array(camera.extent) * (1 + 1e-12)).all()


def test_the_foot_tells_the_time(bar):
    foot = Foot(ShownBodies.of(bar), 1.0, (300, 40))
    assert foot.at(0.1).shape == (40, 300, 3)
    assert (foot.at(0.1) != foot.at(0.2)).any()
    np.testing.assert_array_equal(foot.at(0.1)[:, 120:], foot.at(0.2)[:, 120:])


@pytest.mark.parametrize(
    ("options", "message"),
    [({"fps": 0.0}, "fps = 0.0"), ({"fps": 1e4}, "fps"), ({"size": (8, 8)}, r"size = \(8, 8\)")],
)
def test_wrong_arguments(bar, tmp_path, options, message):
    for write, name in ((write_mp4, "x.mp4"), (write_gif, "x.gif")):
        with pytest.raises(qlb.InputError, match=message):
            write(Recording.of(bar), tmp_path / name, **options)
    assert not list(tmp_path.glob("*x.*"))


def test_what_ffmpeg_says_is_passed_on(bar, tmp_path, monkeypatch):
    monkeypatch.setattr(video, "_arguments", lambda size, fps: ["-loglevel", "error", "-f", "nothing", "-i", "-"])
    with pytest.raises(qlb.QlbError, match=r"cannot write .*x\.mp4: ffmpeg failed: .*nothing"):
        write_mp4(Recording.of(bar), tmp_path / "x.mp4", size=(64, 64))
    assert not list(tmp_path.glob("*x*.mp4"))
