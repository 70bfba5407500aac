"""The rendered picture, and what happens where none can be rendered."""

from __future__ import annotations

import sys

import numpy as np
import pytest
from PIL import Image

import qlb
from qlb.mesh.closest import embed
from qlb.results import MissingExtra, RenderingFailed, Run, RunWriter, picture, render_frames, rendering
from qlb.results.shown import ShownBodies


@pytest.mark.usefixtures("can_render")
def test_a_picture_shows_the_body_in_colour(make_run, tmp_path):
    run = make_run(step=0.1)
    render_frames(run, tmp_path / "picture.png", size=(600, 400))
    with Image.open(tmp_path / "picture.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    height, width, _ = pixels.shape
    assert width <= 600
    assert height <= 400
    coloured = np.ptp(pixels, axis=2) > 60
    assert coloured.mean() > 0.02
    assert (pixels[:2] == 255).all()


@pytest.mark.usefixtures("can_render")
def test_chosen_steps(make_run, tmp_path):
    run = make_run()
    render_frames(run, tmp_path / "one.png", steps=[0], size=(300, 200))
    assert (tmp_path / "one.png").stat().st_size > 1000
    with pytest.raises(qlb.InputError, match="no frame of step 9"):
        render_frames(run, tmp_path / "none.png", steps=[9])
    assert not (tmp_path / "none.png").exists()


def test_without_pyvista(make_run, tmp_path, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    with pytest.raises(MissingExtra, match=r'pip install "qlb\[view\]"'):
        render_frames(make_run(), tmp_path / "picture.png")


def test_without_opengl_an_error_is_raised_not_a_crash(make_run, tmp_path, monkeypatch):
    pytest.importorskip("pyvista")
    monkeypatch.setenv("VTK_DEFAULT_OPENGL_WINDOW", "vtkOSOpenGLRenderWindow")
    rendering.window_class.cache_clear()
    try:
        rendering.window_class()
    except RenderingFailed:
        with pytest.raises(RenderingFailed, match="VTK found no OpenGL") as caught:
            render_frames(make_run(), tmp_path / "picture.png")
        assert "\n" not in str(caught.value)
    else:
        pytest.skip("OSMesa is installed here")
    finally:
        rendering.window_class.cache_clear()


@pytest.mark.parametrize(
    ("steps", "chosen"),
    [
        ([0], [0]),
        ([0, 1], [1]),
        ([0, 1, 2, 3], [1, 2, 3]),
        (list(range(121)), [20, 40, 60, 80, 100, 120]),
        ([0, 50, 100], [50, 100]),
    ],
)
def test_frames_are_spread_over_the_run(steps, chosen):
    assert picture._spread(steps) == chosen


def test_times_have_the_decimals_they_need():
    assert picture._time_texts([0.2, 1.0]) == ["t = 0.2 s", "t = 1.0 s"]
    assert picture._time_texts([1.0, 3.0000000000000004]) == ["t = 1 s", "t = 3 s"]
    assert picture._time_texts([1 / 3]) == ["t = 0.333333 s"]


def test_what_is_drawn_is_the_embedded_surface(tmp_path):
    mesh = qlb.TetMesh.box((1, 1, 1), cells=(1, 1, 1))
    # One triangle in the middle of the box, which no boundary has.
    corners = np.array([[0.4, 0.5, 0.5], [0.6, 0.5, 0.5], [0.5, 0.6, 0.5]])
    fine = mesh.with_surface(embed(mesh, corners, [[0, 1, 2]]).surface)
    simulation = qlb.Simulation(fine, material=qlb.StableNeoHookean(), gravity=(0, -10, 0), step=0.1, threads=1)
    with RunWriter(tmp_path / "run", {"scene": "mine"}, simulation) as writer:
        writer.record(simulation.advance())
    run = Run(tmp_path / "run")
    drawn = ShownBodies.of(run)
    np.testing.assert_array_equal(drawn.surface.triangles, [[0, 1, 2]])
    np.testing.assert_allclose(drawn.rest, corners, atol=1e-12)
    np.testing.assert_allclose(drawn.at(run.frame(0)), corners, atol=1e-12)
    fallen = run.frame(1).positions - run.frame(0).positions
    np.testing.assert_allclose(drawn.displacement(drawn.at(run.frame(1))), -fallen[:, 1].mean(), rtol=1e-6)
