"""USD, read back by its own library: meshes, points, velocities, times and units of every frame."""

from __future__ import annotations

import numpy as np
import pytest

from qlb.export import Recording, write_usd
from tests.export.expected import SINGLE, body_points, body_triangles, body_velocities, obstacle_points, surface_points

pytest.importorskip("pxr")


@pytest.mark.parametrize("suffix", ["usd", "usdc", "usda"])
def test_every_frame_comes_back(run, tmp_path, suffix):
    from pxr import Usd, UsdGeom

    (path,) = write_usd(Recording.of(run), tmp_path / f"two.{suffix}")
    assert path.read_bytes().startswith(b"#usda" if suffix == "usda" else b"PXR-USDC")
    stage = Usd.Stage.Open(str(path))
    assert (stage.GetStartTimeCode(), stage.GetEndTimeCode(), stage.GetTimeCodesPerSecond()) == (0, 4, 100)
    assert UsdGeom.GetStageMetersPerUnit(stage) == 1
    assert UsdGeom.GetStageUpAxis(stage) == "Y"
    assert stage.GetDefaultPrim().GetPath() == "/run"
    meshes = {p.GetDisplayName(): UsdGeom.Mesh(p) for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)}
    assert list(meshes) == ["löw body", "body 1", "obstacle 0", "slope", "plane 0", "plane 1"]
    for frame in run.frames():
        expected = {
            "löw body": (body_points(run, frame, 0), body_velocities(run, frame, 0)),
            "body 1": (body_points(run, frame, 1), body_velocities(run, frame, 1)),
            "obstacle 0": (obstacle_points(run, frame, 0), frame.velocities[-7:-4]),
            "slope": (obstacle_points(run, frame, 1), np.zeros((4, 3))),
        }
        for name, (x, v) in expected.items():
            points = np.array(meshes[name].GetPointsAttr().Get(frame.step))
            np.testing.assert_allclose(points, x, rtol=SINGLE, atol=1e-30, err_msg=name)
            velocities = np.array(meshes[name].GetVelocitiesAttr().Get(frame.step))
            np.testing.assert_allclose(velocities, v, rtol=SINGLE, atol=1e-30, err_msg=name)
            extent = np.array(meshes[name].GetExtentAttr().Get(frame.step))
            np.testing.assert_array_equal(extent, [points.min(axis=0), points.max(axis=0)])
        corners = np.array(meshes["plane 1"].GetPointsAttr().Get(frame.step))
        np.testing.assert_allclose(corners[:, 0], -1 + frame.time, rtol=1e-6)


def test_meshes_are_what_renderers_need(run, tmp_path):
    from pxr import Usd, UsdGeom, UsdShade

    (path,) = write_usd(Recording.of(run), tmp_path / "two.usda")
    stage = Usd.Stage.Open(str(path))
    meshes = [UsdGeom.Mesh(p) for p in stage.Traverse() if p.IsA(UsdGeom.Mesh)]
    for mesh in meshes:
        assert mesh.GetSubdivisionSchemeAttr().Get() == "none"
        indices = np.array(mesh.GetFaceVertexIndicesAttr().Get())
        points = np.array(mesh.GetPointsAttr().Get(0))
        assert UsdGeom.Mesh.ValidateTopology(
            mesh.GetFaceVertexIndicesAttr().Get(), mesh.GetFaceVertexCountsAttr().Get(), len(points)
        )[0]
        assert set(indices) == set(range(len(points)))
        bound = UsdShade.MaterialBindingAPI(mesh.GetPrim()).ComputeBoundMaterial()[0]
        colour = UsdShade.Shader(bound.ComputeSurfaceSource()[0]).GetInput("diffuseColor").Get()
        assert mesh.GetDisplayColorPrimvar().Get()[0] == colour
    slope, rising = meshes[3], meshes[2]
    assert slope.GetPointsAttr().GetNumTimeSamples() == 0
    assert rising.GetPointsAttr().GetTimeSamples() == [0, 1, 2, 3, 4]
    first = np.array(meshes[0].GetPointsAttr().Get(0))
    corners = first[np.array(meshes[0].GetFaceVertexIndicesAttr().Get()).reshape(-1, 3)]
    shift = run.frame(0).positions[: len(run.mesh.positions)] - run.mesh.positions
    assert np.abs(shift).max() == 0
    np.testing.assert_allclose(corners, body_triangles(run, 0), rtol=SINGLE)


def test_of_all_surfaces_none_is_missing(run, tmp_path):
    assert len(surface_points(run, run.mesh.positions)) == sum(len(body_points(run, run.frame(0), b)) for b in (0, 1))
