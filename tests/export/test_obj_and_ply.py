"""OBJ and PLY, read back by trimesh and, for what it leaves out, by meshio and by hand."""

from __future__ import annotations

import numpy as np
import pytest

from qlb.export import Recording, write_obj, write_ply
from tests.export.expected import SINGLE, body_points, body_triangles, obstacle_points, surface_points

trimesh = pytest.importorskip("trimesh")


def test_obj(run, tmp_path):
    files = write_obj(Recording.of(run, "::2"), tmp_path / "two.obj")
    assert [file.name for file in files] == ["two_000000.obj", "two_000002.obj", "two_000004.obj"]
    for file, step in zip(files, (0, 2, 4), strict=True):
        frame = run.frame(step)
        scene = trimesh.load_scene(file, split_objects=True, process=False)
        bodies = {name: np.asarray(mesh.vertices[mesh.faces]) for name, mesh in scene.geometry.items()}
        assert set(bodies) == {"löw_body", "body_1", "obstacle_0", "slope", "plane_0", "plane_1"}
        lines = file.read_text().splitlines()
        x = np.array([line.split()[1:] for line in lines if line.startswith("v ")], dtype=float)
        expected = [
            *(body_points(run, frame, b) for b in (0, 1)),
            *(obstacle_points(run, frame, o) for o in (0, 1)),
        ]
        np.testing.assert_allclose(x[:-8], np.concatenate(expected), rtol=5e-9, atol=1e-30)
        if step == 0:
            for body, name in ((0, "löw_body"), (1, "body_1")):
                np.testing.assert_allclose(bodies[name], body_triangles(run, body), rtol=0, atol=1e-8)
        np.testing.assert_allclose(bodies["obstacle_0"][0], expected[2][[0, 2, 1]], rtol=0, atol=1e-8)


def test_ply(run, tmp_path):
    files = write_ply(Recording.of(run), tmp_path / "two.ply")
    assert [file.name for file in files] == [f"two_{step:06d}.ply" for step in range(5)]
    for file, frame in zip(files, run.frames(), strict=True):
        mesh = trimesh.load_mesh(file, process=False)
        v = len(run.mesh.rendered().tets)
        expected = np.concatenate([surface_points(run, frame.positions), frame.positions[-7:]])
        np.testing.assert_allclose(mesh.vertices[:-8], expected, rtol=SINGLE, atol=1e-30)
        np.testing.assert_array_equal(mesh.faces[: len(run.mesh.rendered().triangles)], run.mesh.rendered().triangles)
        data = mesh.metadata["_ply_raw"]["vertex"]["data"]
        velocities = np.stack([data[name] for name in ("vx", "vy", "vz")], axis=-1).reshape(-1, 3)
        moving = np.concatenate([surface_points(run, frame.velocities), frame.velocities[-7:]])
        np.testing.assert_allclose(velocities[:-8], moving, rtol=SINGLE, atol=1e-30)
        state = run.snapshot(frame)
        stress = surface_points(run, state.at_nodes(state.von_mises_stress))
        np.testing.assert_allclose(data["von_mises"].ravel()[:v], stress, rtol=1e-6)
        groups = data["group"].ravel()
        np.testing.assert_array_equal(groups[:v], run.parts.groups[run.mesh.tets[run.mesh.rendered().tets, 0]])
        np.testing.assert_array_equal(groups[v:], [2] * 3 + [3] * 4 + [4] * 4 + [5] * 4)


def test_meshio_reads_the_ply(bar, tmp_path):
    import meshio

    (file,) = write_ply(Recording.of(bar, "3"), tmp_path / "bar.ply")
    mesh = meshio.read(file)
    np.testing.assert_allclose(mesh.points, body_points(bar, bar.frame(3), 0), rtol=SINGLE)
    assert mesh.point_data["vy"].max() < 0
