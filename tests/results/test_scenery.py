"""Run directories and pictures of several bodies, obstacles and planes."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
from PIL import Image

import qlb
from qlb.results import Run, RunWriter, finish_run, render_frames
from qlb.results.parts import Parts
from qlb.results.scenery import Scenery

MESH = qlb.TetMesh.box(cells=(4, 1, 1))
HILL = np.array([[-1, -0.5, -1], [2, -0.5, -1], [0.5, -0.2, 2.0]])
RISE = qlb.Translation((0, 1, 0))


def make_simulation() -> qlb.Simulation:
    bodies = [
        qlb.Body(MESH, qlb.StableNeoHookean(), name="low"),
        qlb.Body(MESH, qlb.MooneyRivlin(), placement=qlb.Placement(translation=(0, 0.6, 0)), name="hög"),
    ]
    obstacles = [
        qlb.Obstacle(HILL, [[0, 2, 1]], motion=RISE, name="hill"),
        qlb.Plane((0, -1, 0), (0, 2, 0), motion=RISE),
        qlb.Plane((0, 0, 2), (0, 0, -1)),
    ]
    return qlb.Simulation(bodies, obstacles=obstacles, threads=1)


@pytest.fixture
def run(tmp_path: Path) -> Run:
    simulation = make_simulation()
    with RunWriter(tmp_path / "run", {"scene": "two"}, simulation) as writer:
        for result in simulation.run(3):
            writer.record(result)
    return Run(tmp_path / "run")


def test_everything_is_read_as_it_was_written(run):
    n = len(MESH.positions)
    parts, whole = run.parts, make_simulation().assembly
    np.testing.assert_array_equal(run.mesh.positions, whole.mesh.positions)
    np.testing.assert_array_equal(run.mesh.tets, whole.mesh.tets)
    np.testing.assert_array_equal(parts.groups, np.repeat([0, 1, 2], [n, n, 3]))
    assert parts.body_names == ("low", "hög")
    assert parts.obstacle_names == ("hill",)
    np.testing.assert_array_equal(parts.obstacle_vertices, HILL)
    np.testing.assert_array_equal(parts.obstacle_triangles, [[2 * n, 2 * n + 2, 2 * n + 1]])
    np.testing.assert_array_equal(parts.planes, [[0, -1, 0, 0, 1, 0], [0, 0, 2, 0, 0, -1]])


def test_frames_hold_obstacles_and_planes_where_they_were(run):
    for frame in run.frames():
        np.testing.assert_array_equal(frame.positions[-3:], RISE(HILL, frame.time))
        np.testing.assert_array_equal(frame.plane_points, [[0, -1 + frame.time, 0], [0, 0, 2]])
    assert frame.velocities.shape == frame.positions.shape


def test_a_run_of_one_body_alone_has_the_arrays_that_it_needs(make_run):
    run = make_run(steps=1)
    with np.load(run.directory / "mesh.npz") as arrays:
        assert sorted(arrays) == ["positions", "tets"]
    with np.load(run.directory / "frames" / "000001.npz") as arrays:
        assert sorted(arrays) == ["gravity", "positions", "step", "time", "velocities"]
    assert run.parts.nodes == len(run.mesh.positions)
    assert run.parts.body_names == ("",)
    assert run.frame(1).plane_points.shape == (0, 3)


def test_a_run_goes_on_from_its_checkpoint_to_the_same_bits(run):
    resumed, straight = make_simulation(), make_simulation()
    resumed.restore(*run.load_checkpoint())
    last = [*resumed.run(2)][-1]
    expected = [*straight.run(5)][-1]
    np.testing.assert_array_equal(last.positions, expected.positions)
    np.testing.assert_array_equal(last.velocities, expected.velocities)


@pytest.mark.parametrize(
    ("changes", "message"),
    [
        ({"groups": np.zeros(4, int)}, "'groups' has shape"),
        ({"obstacle_triangles": np.array([[0, 1, 2]])}, "'obstacle_triangles' name nodes that are no obstacle's"),
        ({"obstacle_vertices": np.zeros((3, 2))}, "'obstacle_vertices' has shape"),
        ({"planes": np.zeros((2, 3))}, "'planes' has shape"),
    ],
)
def test_a_damaged_mesh_file_is_refused(run, changes, message):
    path = run.directory / "mesh.npz"
    with np.load(path) as arrays:
        kept = dict(arrays)
    np.savez(path, **(kept | changes))
    with pytest.raises(qlb.InputError, match=message):
        Parts.read(path)


def test_squares_lie_in_their_planes_next_to_the_bodies(run):
    scenery = Scenery.of(run, [run.frame(0), run.frame(3)])
    bodies = run.mesh.positions
    for k, frame in enumerate([run.frame(0), run.frame(3)]):
        for square, point, normal in zip(
            scenery.squares(k, bodies), frame.plane_points, run.parts.planes[:, 3:], strict=True
        ):
            np.testing.assert_allclose((square - point) @ normal, 0, atol=1e-12)
            sides = np.linalg.norm(square - np.roll(square, 1, axis=0), axis=1)
            np.testing.assert_allclose(sides, 3 * np.linalg.norm(np.ptp(bodies, axis=0)), rtol=1e-12)
            centre = bodies.min(axis=0) + 0.5 * np.ptp(bodies, axis=0)
            np.testing.assert_allclose(np.cross(square.mean(axis=0) - centre, normal), 0, atol=1e-12)


def test_far_vertices_do_not_count_for_the_view():
    bodies = np.array([[0.0, 0, 0], [2, 2, 1]])  # a box with a diagonal of 3
    vertices = np.array([[-1.4, 3.4, 2.4], [-1.6, 0, 0], [0, 99, 0], [3.4, -1.4, -1.4]])
    scenery = Scenery(np.empty((0, 3), np.int32), [vertices], np.empty((0, 3)), [np.empty((0, 3))])
    np.testing.assert_array_equal(scenery.around(bodies), vertices[[0, 3]])


@pytest.mark.usefixtures("can_render")
def test_a_picture_shows_each_body_in_its_colour_and_obstacles_in_grey(run, tmp_path):
    render_frames(run, tmp_path / "picture.png", steps=[3], size=(600, 500))
    with Image.open(tmp_path / "picture.png") as image:
        pixels = np.asarray(image.convert("RGB")).astype(int)
    spread, (red, _, blue) = np.ptp(pixels, axis=2), pixels.transpose(2, 0, 1)
    assert (blue - red > 60).mean() > 0.01  # the first body
    assert (red - blue > 60).mean() > 0.01  # the second
    assert ((spread < 20) & (red > 120) & (red < 245)).mean() > 0.1  # plane and hill


@pytest.mark.usefixtures("can_render")
def test_a_report_is_made(run):
    files = finish_run(run.directory)
    assert files["picture"].stat().st_size > 1000
    assert "<img" in files["report"].read_text(encoding="utf-8")
