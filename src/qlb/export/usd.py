"""USD: meshes with time samples, for Blender, Houdini and other tools of film. Needs usd-core."""

from __future__ import annotations

from pathlib import Path
from types import SimpleNamespace
from typing import Any

import numpy as np

from qlb.arrays import FloatArray
from qlb.errors import MissingExtra
from qlb.export.drawing import Drawing, Skin
from qlb.export.format import Format
from qlb.export.recording import Recording
from qlb.results.files import replacing


def write_usd(recording: Recording, path: Path) -> list[Path]:
    """Write `path` (.usd and .usdc binary, .usda text): a mesh with velocities for each body, obstacle and plane.

    The time code of a frame is its step, and a second has 1/h of them. Metres, y up. Points are float32. Normals are
    left to the renderer; the meshes are no subdivision surfaces.

    Raises:
        InputError: a frame is damaged.
        MissingExtra: usd-core is not installed.
        WriteError: a file could not be written.
    """
    pxr, drawing = _import_pxr(), Drawing(recording)
    with replacing(path) as temporary:
        layer = pxr.Sdf.Layer.CreateAnonymous(".usda" if path.suffix == ".usda" else ".usdc")
        stage = pxr.Usd.Stage.Open(layer)
        rate = 1.0 / float(recording.run.summary["step"])
        _describe(pxr, stage, recording, rate)
        meshes = [_mesh(pxr, stage, skin, name) for skin, name in zip(drawing.skins, _names(pxr, drawing), strict=True)]
        for k, frame in enumerate(recording.frames()):
            points, velocities = drawing.points(frame), drawing.velocities(frame)
            for skin, mesh in zip(drawing.skins, meshes, strict=True):
                if skin.moves or k == 0:
                    code = pxr.Usd.TimeCode(frame.step) if skin.moves else pxr.Usd.TimeCode.Default()
                    _set_points(pxr, mesh, points[skin.rows], velocities[skin.rows], code)
        _export(pxr, layer, temporary)
    return [path]


def _describe(pxr: Any, stage: Any, recording: Recording, rate: float) -> None:
    """Units, directions and times of the stage."""
    pxr.UsdGeom.SetStageUpAxis(stage, pxr.UsdGeom.Tokens.y)
    pxr.UsdGeom.SetStageMetersPerUnit(stage, 1.0)
    stage.SetTimeCodesPerSecond(rate)
    stage.SetFramesPerSecond(rate)
    stage.SetStartTimeCode(recording.steps[0])
    stage.SetEndTimeCode(recording.steps[-1])
    stage.SetDefaultPrim(pxr.UsdGeom.Xform.Define(stage, "/run").GetPrim())


def _mesh(pxr: Any, stage: Any, skin: Skin, name: str) -> Any:
    """The mesh of a skin, still without points, and its material."""
    mesh = pxr.UsdGeom.Mesh.Define(stage, f"/run/{name}")
    mesh.CreateFaceVertexCountsAttr(pxr.Vt.IntArray.FromNumpy(np.full(len(skin.triangles), 3, np.int32)))
    mesh.CreateFaceVertexIndicesAttr(pxr.Vt.IntArray.FromNumpy(skin.triangles.ravel()))
    mesh.CreateSubdivisionSchemeAttr(pxr.UsdGeom.Tokens.none)
    mesh.CreateDoubleSidedAttr(skin.kind != "body")
    mesh.GetPrim().SetDisplayName(skin.name)
    colour = pxr.Gf.Vec3f(*skin.colour)
    mesh.CreateDisplayColorPrimvar(pxr.UsdGeom.Tokens.constant).Set([colour])
    material = pxr.UsdShade.Material.Define(stage, f"/run/materials/{name}")
    shader = pxr.UsdShade.Shader.Define(stage, f"/run/materials/{name}/surface")
    shader.CreateIdAttr("UsdPreviewSurface")
    shader.CreateInput("diffuseColor", pxr.Sdf.ValueTypeNames.Color3f).Set(colour)
    shader.CreateInput("roughness", pxr.Sdf.ValueTypeNames.Float).Set(0.7)
    material.CreateSurfaceOutput().ConnectToSource(shader.ConnectableAPI(), "surface")
    pxr.UsdShade.MaterialBindingAPI.Apply(mesh.GetPrim()).Bind(material)
    return mesh


def _set_points(pxr: Any, mesh: Any, points: FloatArray, velocities: FloatArray, code: Any) -> None:
    single = points.astype(np.float32)
    mesh.GetPointsAttr().Set(pxr.Vt.Vec3fArray.FromNumpy(single), code)
    mesh.GetVelocitiesAttr().Set(pxr.Vt.Vec3fArray.FromNumpy(velocities.astype(np.float32)), code)
    corners = np.stack([single.min(axis=0), single.max(axis=0)])
    mesh.GetExtentAttr().Set(pxr.Vt.Vec3fArray.FromNumpy(corners), code)


def _names(pxr: Any, drawing: Drawing) -> list[str]:
    """A name that USD allows for each skin, all different."""
    names: list[str] = []
    for skin in drawing.skins:
        name = pxr.Tf.MakeValidIdentifier(skin.name)
        taken = {"materials", *names}
        names.append(next(n for n in (name, *(f"{name}_{k}" for k in range(len(taken) + 1))) if n not in taken))
    return names


def _export(pxr: Any, layer: Any, path: Path) -> None:
    try:
        done = layer.Export(str(path))
    except pxr.Tf.ErrorException as error:
        raise OSError(" ".join(str(error).split())) from None
    if not done:
        raise OSError("USD could not write it")


def _import_pxr() -> Any:
    try:
        from pxr import Gf, Sdf, Tf, Usd, UsdGeom, UsdShade, Vt
    except ImportError as error:
        raise MissingExtra(f'the format usd needs usd-core: pip install "qlb[usd]" ({error})') from None
    return SimpleNamespace(Gf=Gf, Sdf=Sdf, Tf=Tf, Usd=Usd, UsdGeom=UsdGeom, UsdShade=UsdShade, Vt=Vt)


FORMAT = Format("usd", "Blender, Houdini: meshes with time samples", (".usd", ".usdc", ".usda"), write_usd)
