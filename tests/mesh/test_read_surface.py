"""Surfaces from files of every format are the surface that was written, in metres, y up, with vertices merged."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest
import trimesh

from qlb import InputError, Obstacle, TetMesh
from qlb.mesh import read_surface
from qlb.mesh.surface import repair
from tests.mesh.surfaces import FILES, cube, volume

SURFACES = [name for name in FILES if name.split(".")[-1] in ("obj", "stl", "ply", "off", "glb")]


@pytest.mark.parametrize("name", SURFACES)
def test_a_cube_is_read_closed_from_every_format(tmp_path: Path, name: str) -> None:
    FILES[name](tmp_path / name)
    vertices, triangles = read_surface(tmp_path / name)
    assert (len(vertices), len(triangles)) == (8, 12)  # an STL file has 36 vertices
    assert volume(vertices, triangles) == pytest.approx(1)
    assert repair(vertices, triangles)[1].notes() == []


def test_seams_of_textures_are_closed_and_polygons_cut(tmp_path: Path) -> None:
    text = "".join(f"v {x} {y} {z}\n" for x in (0, 1) for y in (0, 1) for z in (0, 1))
    text += "vt 0 0\nvt 1 0\nvt 1 1\nvt 0 1\n"
    sides = ["1 2 4 3", "5 7 8 6", "1 5 6 2", "3 4 8 7", "1 3 7 5", "-7 -3 -1 -5"]  # the last counts from the end
    text += "".join("f " + " ".join(f"{v}/{k + 1}" for k, v in enumerate(side.split())) + "\n" for side in sides)
    (tmp_path / "cube.obj").write_text(text)
    vertices, triangles = read_surface(tmp_path / "cube.obj")
    assert (len(vertices), len(triangles)) == (8, 12)
    assert volume(vertices, triangles) == pytest.approx(1)


def test_vertices_as_near_as_float32_rounds_are_merged_and_others_are_not(tmp_path: Path) -> None:
    for gap, expected in ((0.9e-7, 3), (1e-6, 4)):
        points = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 1 + gap * np.sqrt(2), 0]])
        path = tmp_path / "pair.obj"
        path.write_text("".join(f"v {x!r} {y!r} {z!r}\n" for x, y, z in points.tolist()) + "f 1 2 3\nf 1 2 4\n")
        assert len(read_surface(path)[0]) == expected


def test_merging_does_not_look_at_pairs_where_all_vertices_are_near() -> None:
    from qlb.mesh.surface import merge_coincident

    vertices = np.random.default_rng(0).random((100_000, 3))
    vertices[0] = 1e12  # next to which all others are one point; their pairs would fill the memory
    merged, _ = merge_coincident(vertices, np.array([[0, 1, 2]]))
    assert len(merged) == 2


def test_objects_of_a_gltf_scene_stand_where_it_puts_them(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    piece = trimesh.Trimesh(*cube(), process=False)
    scene.add_geometry(piece, transform=trimesh.transformations.translation_matrix((5, 0, 0)))
    scene.add_geometry(piece, transform=np.diag([-2.0, 1, 1, 1]))  # a mirror image, which keeps its outside
    scene.export(tmp_path / "two.glb")
    vertices, triangles = read_surface(tmp_path / "two.glb")
    assert len(triangles) == 24
    assert volume(vertices, triangles) == pytest.approx(3)
    np.testing.assert_allclose(np.ptp(vertices, axis=0), [8, 1, 1])


def test_usd_is_read_in_metres_y_up_at_its_place(tmp_path: Path) -> None:
    pytest.importorskip("pxr")
    path = tmp_path / "stage.usda"
    path.write_text(
        """#usda 1.0
(metersPerUnit = 0.01
 upAxis = "Z")
def Xform "body" {
    double3 xformOp:translate = (100, 200, 300)
    uniform token[] xformOpOrder = ["xformOp:translate"]
    def Mesh "box" {
        int[] faceVertexCounts = [4, 4, 4, 4, 4, 4]
        int[] faceVertexIndices = [0,2,3,1, 4,5,7,6, 0,1,5,4, 2,6,7,3, 0,4,6,2, 1,3,7,5]
        point3f[] points = [(0,0,0),(100,0,0),(0,200,0),(100,200,0),(0,0,300),(100,0,300),(0,200,300),(100,200,300)]
    }
    def Mesh "unseen" {
        int[] faceVertexCounts = [3]
        int[] faceVertexIndices = [0, 1, 2]
        point3f[] points = [(0,0,0),(1,0,0),(0,1,0)]
        token visibility = "invisible"
    }
}
"""
    )
    vertices, triangles = read_surface(path)
    assert (len(vertices), len(triangles)) == (8, 12)
    assert volume(vertices, triangles) == pytest.approx(6)
    # A quarter turn about x takes z up to y up.
    np.testing.assert_allclose(vertices.min(axis=0), [1, 3, -4], atol=1e-6)
    np.testing.assert_allclose(vertices.max(axis=0), [2, 6, -2], atol=1e-6)
    turned = path.with_name("left.usda")
    turned.write_text(path.read_text().replace('"box" {', '"box" {\n uniform token orientation = "leftHanded"'))
    assert volume(*read_surface(turned)) == pytest.approx(-6)


def test_quads_of_a_vtk_file_are_cut_in_two(tmp_path: Path) -> None:
    points = np.array([[0, 0, 0], [2, 0, 0], [2, 1, 0], [0, 1, 0.0]])
    meshio.Mesh(points, [("quad", [[0, 1, 2, 3]])]).write(tmp_path / "plate.vtu")
    vertices, triangles = read_surface(tmp_path / "plate.vtu")
    assert (len(vertices), len(triangles)) == (4, 2)
    assert len(Obstacle.read(tmp_path / "plate.vtu").triangles) == 2


def test_what_holds_no_triangles_says_what_it_holds(tmp_path: Path) -> None:
    (tmp_path / "cloud.obj").write_text("v 0 0 0\nv 1 0 0\n")
    (tmp_path / "words.obj").write_text("no mesh\n")
    (tmp_path / "cube.foo").write_text("no mesh\n")
    for name, says in (("cloud.obj", "only points"), ("words.obj", "nor anything else"), ("cube.foo", "suffix '.foo'")):
        with pytest.raises(InputError, match=says):
            read_surface(tmp_path / name)


def test_tets_are_no_surface_and_a_surface_has_no_tets(tmp_path: Path) -> None:
    FILES["text.vtu"](tmp_path / "tets.vtu")
    with pytest.raises(InputError, match=r"tets.vtu has no triangles, only tetra"):
        read_surface(tmp_path / "tets.vtu")
    FILES["surface.obj"](tmp_path / "cube.obj")
    with pytest.raises(InputError, match=r"cube.obj has no tetrahedra, only triangle"):
        TetMesh.read(tmp_path / "cube.obj")


@pytest.mark.parametrize("regions", [None, np.arange(36) // 12])
@pytest.mark.parametrize("suffix", [".msh", ".vtu", ".vtk", ".mesh"])
def test_written_tets_are_read_back_with_their_regions(tmp_path: Path, suffix: str, regions: np.ndarray | None) -> None:
    mesh = TetMesh.box((1.0, 0.5, 0.25), cells=(3, 2, 1))
    mesh = TetMesh(mesh.positions, mesh.tets, regions=regions)
    mesh.write(tmp_path / f"bar{suffix}")
    read = TetMesh.read(tmp_path / f"bar{suffix}")
    np.testing.assert_array_equal(read.positions, mesh.positions)
    np.testing.assert_array_equal(read.tets, mesh.tets)
    if regions is not None:
        np.testing.assert_array_equal(read.regions, regions)
    assert sorted(p.name for p in tmp_path.iterdir()) == [f"bar{suffix}"]


def test_tets_are_not_written_to_surface_formats_or_nowhere(tmp_path: Path) -> None:
    mesh = TetMesh.box(cells=(1, 1, 1))
    with pytest.raises(InputError, match=r"\.msh, \.vtu"):
        mesh.write(tmp_path / "bar.obj")
    with pytest.raises(InputError, match="cannot be written"):
        mesh.write(tmp_path / "nowhere" / "bar.msh")
