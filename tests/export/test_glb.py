"""Animated GLB: the validator of Khronos finds nothing, and the vertices of every frame are those of the run.

They are taken apart here by `struct` and by two loaders.
"""

from __future__ import annotations

import json
import shutil
import struct
import subprocess
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import qlb
from qlb.export import Recording, glb, write_glb
from tests.export.expected import body_points, body_triangles, obstacle_points
from tests.support import Array

COMPONENTS = {5126: np.dtype("<f4"), 5123: np.dtype("<u2"), 5125: np.dtype("<u4")}
WIDTH = {"SCALAR": 1, "VEC3": 3}
NAMES = ["löw body", "body 1", "obstacle 0", "slope", "plane 0", "plane 1"]


def parts(path: Path) -> tuple[dict[str, Any], bytes]:
    """JSON and binary chunk, by section 4.4 of the standard."""
    data = path.read_bytes()
    magic, version, length = struct.unpack_from("<4sII", data)
    assert (magic, version, length) == (b"glTF", 2, len(data))
    size, kind = struct.unpack_from("<II", data, 12)
    assert (kind, size % 4) == (0x4E4F534A, 0)
    document = json.loads(data[20 : 20 + size])
    binary, kind = struct.unpack_from("<II", data, 20 + size)
    assert (kind, binary % 4, 28 + size + binary) == (0x004E4942, 0, len(data))
    return document, data[28 + size :]


def accessor(document: dict[str, Any], binary: bytes, index: int) -> Array:
    a = document["accessors"][index]
    view = document["bufferViews"][a["bufferView"]]
    kind, width = COMPONENTS[a["componentType"]], WIDTH[a["type"]]
    assert view["byteOffset"] % kind.itemsize == 0
    assert a["count"] * width * kind.itemsize == view["byteLength"]
    assert view["byteOffset"] + view["byteLength"] <= document["buffers"][0]["byteLength"] <= len(binary)
    values = np.frombuffer(binary, kind, a["count"] * width, view["byteOffset"]).reshape(a["count"], width)
    assert np.isfinite(values).all()
    if "min" in a:
        np.testing.assert_array_equal(a["min"], values.min(axis=0).astype(float))
        np.testing.assert_array_equal(a["max"], values.max(axis=0).astype(float))
    return values if width > 1 else values[:, 0]


def played(document: dict[str, Any], binary: bytes, name: str, time: float) -> Array:
    """Vertices of a node at a time [s]: weights interpolated between keyframes, morph targets added up."""
    node = next(k for k, n in enumerate(document["nodes"]) if n["name"] == name)
    mesh = document["meshes"][document["nodes"][node]["mesh"]]
    (primitive,) = mesh["primitives"]
    x = accessor(document, binary, primitive["attributes"]["POSITION"]).astype(float)
    channels = [c for c in document["animations"][0]["channels"] if c["target"] == {"node": node, "path": "weights"}]
    if not channels:
        assert "targets" not in primitive
        return x
    sampler = document["animations"][0]["samplers"][channels[0]["sampler"]]
    times = accessor(document, binary, sampler["input"])
    assert (np.diff(times) > 0).all()
    weights = accessor(document, binary, sampler["output"]).reshape(len(times), -1)
    assert weights.shape[1] == len(primitive["targets"]) == len(mesh["weights"])
    for k, target in enumerate(primitive["targets"]):
        x = x + np.interp(time, times, weights[:, k]) * accessor(document, binary, target["POSITION"])
    return x


def test_every_frame_is_played(run, tmp_path):
    document, binary = parts(write_glb(Recording.of(run, "1:"), tmp_path / "two.glb")[0])
    assert [node["name"] for node in document["nodes"]] == NAMES
    begin = run.frame(1).time
    for step in (1, 2, 3, 4):
        frame = run.frame(step)
        expected = {
            "löw body": body_points(run, frame, 0),
            "body 1": body_points(run, frame, 1),
            "obstacle 0": obstacle_points(run, frame, 0),
            "slope": obstacle_points(run, frame, 1),
        }
        for name, x in expected.items():
            seen = played(document, binary, name, np.float32(frame.time - begin))
            np.testing.assert_allclose(seen, x, rtol=0, atol=2e-7, err_msg=name)
        np.testing.assert_allclose(played(document, binary, "plane 1", frame.time - begin)[:, 0], -1 + frame.time, 1e-6)


def test_between_two_frames_vertices_go_straight(run, tmp_path):
    document, binary = parts(write_glb(Recording.of(run), tmp_path / "two.glb")[0])
    first, second = (body_points(run, run.frame(k), 0) for k in (2, 3))
    seen = played(document, binary, "löw body", 0.0225)
    np.testing.assert_allclose(seen, 0.75 * first + 0.25 * second, rtol=0, atol=1e-6)


def test_the_document_keeps_the_rules(run, tmp_path):
    document, binary = parts(write_glb(Recording.of(run), tmp_path / "two.glb")[0])
    assert document["asset"]["version"] == "2.0"
    assert document["scenes"][document["scene"]]["nodes"] == list(range(len(NAMES)))
    vertices = indices = 0
    for mesh, material in zip(document["meshes"], document["materials"], strict=True):
        (primitive,) = mesh["primitives"]
        positions = document["accessors"][primitive["attributes"]["POSITION"]]
        assert {"min", "max"} <= set(positions)
        used = accessor(document, binary, primitive["indices"])
        assert used.max() < positions["count"]
        assert len(used) % 3 == 0
        limit = np.iinfo(COMPONENTS[document["accessors"][primitive["indices"]]["componentType"]]).max
        assert used.max() < limit  # the largest index of its type restarts a primitive
        for target in primitive.get("targets", []):
            found = document["accessors"][target["POSITION"]]
            assert {"min", "max"} <= set(found)
            assert found["count"] == positions["count"]
        assert all(0 <= value <= 1 for value in material["pbrMetallicRoughness"]["baseColorFactor"])
        vertices, indices = vertices + positions["count"], indices + len(used)
    assert document["accessors"][document["animations"][0]["samplers"][0]["input"]]["min"] == [0.0]
    targets = {view.get("target") for view in document["bufferViews"]}
    assert targets == {34962, 34963, None}
    ends = [view["byteOffset"] + view["byteLength"] for view in document["bufferViews"]]
    begins = [view["byteOffset"] for view in document["bufferViews"]]
    assert all(0 <= begin - end < 4 for begin, end in zip(begins[1:], ends[:-1], strict=True))
    for k in range(len(document["accessors"])):
        accessor(document, binary, k)


def validated(*paths: Path) -> list[dict[str, Any]]:
    """What the validator says of each file; a development dependency of web/."""
    web = Path(__file__).parents[2] / "web"
    if shutil.which("node") is None or not (web / "node_modules" / "gltf-validator").is_dir():
        pytest.skip("needs Node.js and web/node_modules (npm ci --prefix web)")
    command = ["node", str(web / "validate-glb.mjs"), *map(str, paths)]
    done = subprocess.run(command, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    return [report["issues"] for report in json.loads(done.stdout)]


def test_the_validator_finds_nothing(run, bar, make_still, tmp_path):
    """Not even a hint: several bodies, obstacles and planes that move and stand, one body, a single frame."""
    recordings = [Recording.of(run), Recording.of(bar), Recording.of(bar, "2"), Recording.of(make_still())]
    paths = [write_glb(recording, tmp_path / f"{k}.glb")[0] for k, recording in enumerate(recordings)]
    assert [issues["messages"] for issues in validated(*paths)] == [[]] * len(paths)


def test_the_validator_is_listened_to(bar, tmp_path):
    (path,) = write_glb(Recording.of(bar), tmp_path / "bar.glb")
    whole = path.read_bytes()
    path.write_bytes(whole[:-8] + b"\xff" * 8)  # not a number
    (issues,) = validated(path)
    assert issues["numErrors"] > 0


def test_trimesh_and_pygltflib_load_it(run, tmp_path):
    trimesh, pygltflib = pytest.importorskip("trimesh"), pytest.importorskip("pygltflib")
    (path,) = write_glb(Recording.of(run), tmp_path / "two.glb")
    scene = trimesh.load_scene(path)
    for body, name in ((0, "löw body"), (1, "body 1")):
        mesh = next(g for g in scene.geometry.values() if len(g.faces) == len(body_triangles(run, body)))
        np.testing.assert_allclose(
            mesh.vertices[mesh.faces], body_triangles(run, body), rtol=0, atol=1e-7, err_msg=name
        )
    loaded = pygltflib.GLTF2().load(str(path))
    assert [node.name for node in loaded.nodes] == NAMES
    assert len(loaded.meshes[0].primitives[0].targets) == 4
    assert len(loaded.binary_blob()) == loaded.buffers[0].byteLength


def test_vtk_plays_it(bar, tmp_path):
    pytest.importorskip("vtk")
    from vtkmodules.util.numpy_support import vtk_to_numpy
    from vtkmodules.vtkIOGeometry import vtkGLTFReader

    (path,) = write_glb(Recording.of(bar), tmp_path / "bar.glb")
    reader = vtkGLTFReader()
    reader.SetFileName(str(path))
    reader.SetApplyDeformationsToGeometry(True)
    reader.SetFrameRate(100)
    reader.UpdateInformation()
    assert reader.GetNumberOfAnimations() == 1
    reader.EnableAnimation(0)
    for frame in bar.frames():
        reader.UpdateTimeStep(frame.time)
        block = reader.GetOutputDataObject(0)
        while block.IsA("vtkMultiBlockDataSet"):
            block = block.GetBlock(0)
        x = vtk_to_numpy(block.GetPoints().GetData())
        np.testing.assert_allclose(x, body_points(bar, frame, 0), rtol=0, atol=2e-7)


def test_a_single_frame_has_no_animation(bar, tmp_path):
    document, binary = parts(write_glb(Recording.of(bar, "2"), tmp_path / "bar.glb")[0])
    assert "animations" not in document
    position = document["meshes"][0]["primitives"][0]["attributes"]["POSITION"]
    np.testing.assert_allclose(accessor(document, binary, position), body_points(bar, bar.frame(2), 0), rtol=1.2e-7)


def test_what_does_not_fit_is_refused_with_a_way_out(bar, tmp_path, monkeypatch):
    monkeypatch.setattr(glb, "LIMIT", 300)
    with pytest.raises(qlb.InputError, match=r"4 frames of 12 vertices are .* --steps ::3"):
        write_glb(Recording.of(bar), tmp_path / "bar.glb")
    assert list(tmp_path.glob("*.glb")) == []
