"""Motions of a scene file are those of the class that their kind names; what does not fit together is refused."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import qlb
from qlb.scenes import load_scene

CORNERS = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]])
TIMES = [0.0, 0.05, 0.1, 0.13, 0.2, 0.3]


def motion_of(folder: Path, motion: str) -> qlb.Motion:
    """Of the one obstacle of a scene file."""
    text = f"bodies: [{{mesh: {{shape: box, tets: 100}}}}]\nobstacles: [{{point: [0, -9, 0], motion: {motion}}}]\n"
    (folder / "scene.yaml").write_text(text)
    motion = load_scene(str(folder / "scene.yaml")).build().assembly.planes[0].motion
    assert motion is not None
    return motion


@pytest.mark.parametrize(
    ("text", "expected"),
    [
        ("{kind: displacement, value: [2 * t, 0, t ** 2]}", lambda x, t: x + np.array([2 * t, 0.0, t**2])),
        (
            "{kind: keyframes, times: [0, 0.2], rotate: {axis: [0, 0, 3], degrees: [0, 90]}, origin: [1, 0, 0]}",
            qlb.Keyframes([0, 0.2], None, [[0, 0, 0], [0, 0, np.pi / 2]], (1, 0, 0)),
        ),
        (
            "{kind: animation, times: [0, 0.1], positions: [[[0, -9, 0]], [[0, -8, 1]]]}",
            qlb.VertexAnimation([0, 0.1], [[[0, -9, 0]], [[0, -8, 1]]]),
        ),
    ],
)
def test_it_is_the_motion_that_its_kind_names(tmp_path: Path, text: str, expected: qlb.Motion) -> None:
    motion = motion_of(tmp_path, text)
    points = np.array([[0.0, -9, 0]]) if "animation" in text else CORNERS
    for time in TIMES:
        np.testing.assert_allclose(motion(points, time), expected(points, time), rtol=0, atol=1e-12)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("{kind: displacement, value: [0, 1, 0]}", "is constant, must be a function of time or a table"),
        (
            "{kind: keyframes, times: [0], rotations: [[0, 0, 0]], rotate: {axis: [0, 0, 1], degrees: [0]}}",
            "rotations and rotate are both given, must be one of them",
        ),
        (
            "{kind: animation, times: [0, 1], positions: [[[0, 0, 0]], [[0, 0, 0], [1, 0, 0]]]}",
            r"positions have \[1, 2\] vertices, must have as many at each key",
        ),
    ],
)
def test_what_does_not_fit_together_is_refused(tmp_path: Path, text: str, words: str) -> None:
    with pytest.raises(qlb.InputError, match=words):
        motion_of(tmp_path, text)
