"""`qlb mesh`: tables, files, refusals with status 2; surfaces in scenes, with notes on the terminal."""

from __future__ import annotations

import sys
from pathlib import Path

import numpy as np
import pytest
import trimesh

from qlb.cli.main import main
from qlb.mesh import TetMesh
from qlb.results import Run
from tests.mesh.surfaces import ball, cube


@pytest.fixture
def call(monkeypatch, tmp_path, capsys):
    """Call `qlb ARGUMENTS` in an empty folder: (exit status, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def qlb(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["qlb", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        streams = capsys.readouterr()
        return int(end.value.code or 0), streams.out, streams.err

    return qlb


@pytest.fixture
def holed(tmp_path) -> Path:
    """A ball of radius 1 m without one of its triangles."""
    vertices, triangles = ball(3)
    trimesh.Trimesh(vertices, triangles[1:], process=False).export(tmp_path / "holed.obj")
    return tmp_path / "holed.obj"


def test_a_look_at_a_surface_names_its_holes(call, holed):
    status, out, err = call("mesh", holed)
    assert status == 0
    assert "642, 1279" in out
    assert "3, 1" in out
    assert err == "note: holed.obj: the surface is open: 3 boundary edges around 1 hole; filling closes them\n"


@pytest.mark.slow
def test_a_surface_becomes_a_file_of_tets(call, holed, tmp_path):
    pytest.importorskip("pytetwild")
    status, out, err = call("mesh", holed, "ball.msh", "--edge", 0.3, "--height", 1)
    assert status == 0
    assert "filling 1279 triangles" in err
    assert "3 boundary edges around 1 hole" in err
    mesh = TetMesh.read(tmp_path / "ball.msh")
    assert f"{len(mesh.positions)}, {len(mesh.tets)}" in out
    assert np.ptp(mesh.positions[:, 1]) == pytest.approx(1, rel=0.05)
    assert mesh.volumes().sum() == pytest.approx(np.pi / 6, rel=0.1)


def test_tets_in_another_format_scaled(call, tmp_path):
    mesh = TetMesh.box((1, 2, 1), cells=(2, 2, 2))
    mesh.write(tmp_path / "box.vtu")
    assert call("mesh", "box.vtu", "box.mesh", "--scale", 3)[0] == 0
    np.testing.assert_allclose(TetMesh.read(tmp_path / "box.mesh").positions, 3 * mesh.positions)
    status, out, _ = call("mesh", "box.mesh")
    assert status == 0
    assert "27, 48" in out
    assert "3 x 6 x 3 m" in out


@pytest.mark.parametrize(
    ("arguments", "says"),
    [
        (["nowhere.obj"], "does not exist"),
        (["box.vtu", "box.vtu"], "--overwrite"),
        (["box.vtu", "new.obj"], ".msh"),
        (["box.vtu", "no/new.msh"], "folder"),
        (["box.vtu", "new.msh", "--tets", "500"], "--tets"),
        (["box.vtu", "--scale", "0"], "--scale 0.0 is out of range"),
        (["box.vtu", "--scale", "1", "--height", "2"], "not both"),
        (["box.vtu", "--height", "nan"], "--height nan"),
        (["flat.obj", "--height", "2"], "height 0"),
        (["flat.obj", "flat.msh"], "encloses no volume"),
        (["cube.obj", "cube.msh", "--edge", "50"], "edge 50.0 is out of range"),
        (["cube.obj", "cube.msh", "--tets", "50"], "tets 50 is out of range"),
        (["cube.obj", "cube.msh", "--tets", "500", "--edge", "1"], "not both"),
    ],
)
def test_wrong_input_ends_with_status_2_and_writes_nothing(call, tmp_path, arguments, says):
    TetMesh.box((1, 2, 1), cells=(2, 2, 2)).write(tmp_path / "box.vtu")
    before = (tmp_path / "box.vtu").read_bytes()
    trimesh.Trimesh(*cube(), process=False).export(tmp_path / "cube.obj")
    (tmp_path / "flat.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 0 1\nv 1 0 1\nf 1 2 3\nf 2 3 4\n")
    status, _, err = call("mesh", *arguments)
    assert status == 2
    assert says in err
    assert err.splitlines()[-1].startswith("error: ")
    assert sorted(path.name for path in tmp_path.iterdir()) == ["box.vtu", "cube.obj", "flat.obj"]
    assert (tmp_path / "box.vtu").read_bytes() == before


@pytest.mark.slow
def test_a_scene_takes_a_surface_and_its_run_keeps_it(call, holed, tmp_path):
    pytest.importorskip("pytetwild")
    choices = [f"mesh.path={holed}", "mesh.edge=0.6", "drop.height=0.01"]
    options = [word for choice in choices for word in ("--set", choice)]
    status, _, err = call("run", "bunny", *options, "--steps", 4, "--threads", 1, "--out", "out", "--no-picture")
    assert status == 0
    assert "note: holed.obj: the surface is open: 3 boundary edges around 1 hole" in err
    run = Run(tmp_path / "out")
    shown = run.parts.mesh.rendered()
    assert len(shown.triangles) == 1279
    rest, moved = (shown.of_nodes(run.frame(step).positions) for step in (0, 4))
    np.testing.assert_allclose(np.linalg.norm(rest - rest.mean(axis=0), axis=1), 0.15, rtol=0.03)  # 0.3 m high
    assert (moved[:, 1] < rest[:, 1]).all()
