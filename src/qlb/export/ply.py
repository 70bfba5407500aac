"""PLY: one binary file for each frame, with velocity and von Mises stress at the vertices."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from qlb.export.drawing import Drawing
from qlb.export.format import Format, frame_file, frame_files
from qlb.export.recording import Recording
from qlb.results import Frame
from qlb.results.files import replacing

_FLOATS = ("x", "y", "z", "vx", "vy", "vz")
_STRESS = "von_mises"
_FACE = np.dtype([("count", "u1"), ("nodes", "<i4", 3)])


def write_ply(recording: Recording, path: Path) -> list[Path]:
    """Write NAME_000012.ply and so on for `path` NAME.ply, little endian.

    Vertices have x, y, z [m], velocity vx, vy, vz [m/s], von_mises [Pa] where the material is known, and the group that
    they belong to: bodies from 0, then obstacles, then planes.

    Raises:
        InputError: a frame is damaged.
        WriteError: a file could not be written.
    """
    drawing, files = Drawing(recording), []
    triangles, groups = drawing.triangles(), drawing.groups
    faces = np.empty(len(triangles), _FACE)
    faces["count"], faces["nodes"] = 3, triangles
    for frame in recording.frames():
        columns = [*drawing.points(frame).T, *drawing.velocities(frame).T]
        if recording.without_stress is None:
            columns.append(drawing.von_mises(recording.run.snapshot(frame)))
        names = (*_FLOATS, _STRESS)[: len(columns)]
        vertices = np.empty(len(groups), np.dtype([*((name, "<f4") for name in names), ("group", "<i4")]))
        vertices["group"] = groups
        for name, column in zip(names, columns, strict=True):
            vertices[name] = column
        files.append(frame_file(path, frame.step))
        with replacing(files[-1]) as temporary, temporary.open("wb") as file:
            file.write(_header(frame, names, len(vertices), len(faces)))
            file.write(vertices.tobytes())
            file.write(faces.tobytes())
    return files


def _header(frame: Frame, floats: tuple[str, ...], vertices: int, faces: int) -> bytes:
    lines = [
        "ply",
        "format binary_little_endian 1.0",
        f"comment qlb, step {frame.step}, t = {frame.time:.9g} s",
        f"element vertex {vertices}",
        *(f"property float {name}" for name in floats),
        "property int group",
        f"element face {faces}",
        "property list uchar int vertex_indices",
        "end_header",
    ]
    return ("\n".join(lines) + "\n").encode("ascii")


FORMAT = Format("ply", "binary, a file a frame, with velocity and stress", (".ply",), write_ply, files=frame_files)
