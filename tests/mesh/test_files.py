"""Files of tets: what is written is read back, and what is damaged is refused in one line."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import meshio
import numpy as np
import pytest

from qlb import InputError, TetMesh

# meshio's writers warn about optional data that a plain mesh lacks.
FORMATS = {"gmsh": ".msh", "gmsh22": ".msh", "vtu": ".vtu", "vtk": ".vtk", "medit": ".mesh", "abaqus": ".inp"}


@pytest.fixture
def mesh() -> TetMesh:
    return TetMesh.box((1.0, 0.5, 0.25), cells=(3, 2, 1))


def write(path: Path, points: np.ndarray, cells: list[tuple[str, np.ndarray]], form: str | None = None) -> Path:
    meshio.Mesh(points, cells).write(path, file_format=form)
    return path


@pytest.mark.parametrize(("form", "suffix"), FORMATS.items(), ids=FORMATS)
def test_a_written_mesh_is_read_back(tmp_path: Path, mesh: TetMesh, form: str, suffix: str) -> None:
    path = write(tmp_path / f"bar{suffix}", mesh.positions, [("tetra", mesh.tets)], form)
    read = TetMesh.read(path)
    np.testing.assert_allclose(read.positions, mesh.positions, rtol=1e-15)
    np.testing.assert_array_equal(read.tets, mesh.tets)


def test_a_path_may_be_text(tmp_path: Path, mesh: TetMesh) -> None:
    path = write(tmp_path / "bar.vtu", mesh.positions, [("tetra", mesh.tets)])
    assert len(TetMesh.read(str(path)).tets) == 36


def test_other_cells_and_unused_nodes_are_dropped(tmp_path: Path, mesh: TetMesh) -> None:
    points = np.vstack([[[9.0, 9.0, 9.0]], mesh.positions, [[8.0, 8.0, 8.0]]])
    cells = [("triangle", mesh.boundary_triangles() + 1), ("tetra", mesh.tets + 1)]
    read = TetMesh.read(write(tmp_path / "bar.vtu", points, cells))
    np.testing.assert_array_equal(read.positions, mesh.positions)
    np.testing.assert_array_equal(read.tets, mesh.tets)


def test_blocks_of_tets_are_joined(tmp_path: Path, mesh: TetMesh) -> None:
    cells = [("tetra", mesh.tets[:7]), ("triangle", mesh.boundary_triangles()), ("tetra", mesh.tets[7:])]
    read = TetMesh.read(write(tmp_path / "bar.vtk", mesh.positions, cells))
    assert {tuple(t) for t in read.tets.tolist()} == {tuple(t) for t in mesh.tets.tolist()}


def test_a_missing_file_is_named(tmp_path: Path) -> None:
    path = tmp_path / "nowhere.msh"
    with pytest.raises(InputError) as caught:
        TetMesh.read(path)
    assert str(caught.value) == f"mesh file {path} does not exist"


def test_a_folder_is_no_mesh(tmp_path: Path) -> None:
    with pytest.raises(InputError, match="does not exist"):
        TetMesh.read(tmp_path)


@pytest.mark.parametrize("kind", ["triangle", "tetra10"])
def test_a_file_without_linear_tets_says_what_it_holds(tmp_path: Path, kind: str) -> None:
    corners = np.vstack([np.eye(3), np.zeros((7, 3)) + np.arange(7)[:, None]])
    path = write(tmp_path / "mesh.vtu", corners, [(kind, np.arange(3 if kind == "triangle" else 10)[None])])
    with pytest.raises(InputError) as caught:
        TetMesh.read(path)
    assert str(caught.value) == f"mesh file {path} has no tetrahedra, only {kind}"


def test_an_inverted_tet_in_a_file_is_refused(tmp_path: Path, mesh: TetMesh) -> None:
    tets = mesh.tets.copy()
    tets[4] = tets[4, [1, 0, 2, 3]]
    with pytest.raises(InputError, match="tet 4 is inverted"):
        TetMesh.read(write(tmp_path / "bar.vtu", mesh.positions, [("tetra", tets)]))


def test_an_index_out_of_range_in_a_file_is_refused(tmp_path: Path) -> None:
    path = tmp_path / "bar.vtk"
    path.write_text(
        "# vtk DataFile Version 3.0\nx\nASCII\nDATASET UNSTRUCTURED_GRID\nPOINTS 4 double\n"
        "0 0 0 1 0 0 0 1 0 0 0 1\nCELLS 1 5\n4 0 1 2 7\nCELL_TYPES 1\n10\n"
    )
    with pytest.raises(InputError, match="node index 7 is outside its 4 nodes"):
        TetMesh.read(path)


GARBAGE = {
    "bytes": np.random.default_rng(0).bytes(500),
    "nothing": b"",
    "text": b"no mesh at all\n1 2 3\n",
}
SUFFIXES = [".msh", ".vtu", ".vtk", ".mesh", ".inp", ".xdmf", ".ply", ".stl", ".bdf", ".su2", ".vol", ".xml", ".obj"]


@pytest.mark.filterwarnings("ignore::RuntimeWarning")
@pytest.mark.parametrize("suffix", SUFFIXES)
@pytest.mark.parametrize("content", GARBAGE.values(), ids=GARBAGE)
def test_a_file_that_is_no_mesh_is_refused_in_one_line(tmp_path: Path, suffix: str, content: bytes) -> None:
    path = tmp_path / f"garbage{suffix}"
    path.write_bytes(content)
    with pytest.raises(InputError) as caught:
        TetMesh.read(path)
    message = str(caught.value)
    assert message.startswith(f"mesh file {path} ")
    assert "\n" not in message


def test_an_empty_tetgen_file_does_not_hang(tmp_path: Path) -> None:
    # In a process of its own, which can be ended: meshio's reader waits for a line that never comes.
    path = tmp_path / "empty.node"
    path.touch()
    code = "import sys, qlb; qlb.TetMesh.read(sys.argv[1])"
    done = subprocess.run([sys.executable, "-c", code, path], capture_output=True, timeout=10, check=False)
    assert b"InputError" in done.stderr


@pytest.mark.parametrize("share", [0.1, 0.5, 0.9])
@pytest.mark.parametrize(("form", "suffix"), FORMATS.items(), ids=FORMATS)
def test_a_file_cut_short_is_refused(tmp_path: Path, mesh: TetMesh, form: str, suffix: str, share: float) -> None:
    path = write(tmp_path / f"bar{suffix}", mesh.positions, [("tetra", mesh.tets)], form)
    content = path.read_bytes()
    path.write_bytes(content[: int(share * len(content))])
    with pytest.raises(InputError):
        TetMesh.read(path)


SHARED = Path(__file__).parents[3] / "shared" / "meshes"


@pytest.mark.skipif(not SHARED.is_dir(), reason="needs the meshes of shared/, which are not part of the project")
@pytest.mark.parametrize(("name", "tets"), [("bunny5K.msh", 19379), ("armadillo13K.msh", 54985)])
def test_meshes_of_the_ipc_authors_are_read_without_a_word(
    name: str, tets: int, capfd: pytest.CaptureFixture[str]
) -> None:
    assert len(TetMesh.read(SHARED / name).tets) == tets
    assert capfd.readouterr() == ("", "")
