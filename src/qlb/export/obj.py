"""Wavefront OBJ: one text file for each frame."""

from __future__ import annotations

from pathlib import Path
from typing import TextIO

import numpy as np

from qlb.arrays import FloatArray
from qlb.export.drawing import Drawing
from qlb.export.format import Format, frame_file, frame_files
from qlb.export.recording import Recording
from qlb.results.files import replacing


def write_obj(recording: Recording, path: Path) -> list[Path]:
    """Write NAME_000012.obj and so on for `path` NAME.obj: an object for each body, obstacle and plane, in metres.

    Raises:
        InputError: a frame is damaged.
        WriteError: a file could not be written.
    """
    drawing, files = Drawing(recording), []
    for frame in recording.frames():
        files.append(frame_file(path, frame.step))
        with replacing(files[-1]) as temporary, temporary.open("w", encoding="utf-8", newline="\n") as file:
            file.write(f"# qlb, step {frame.step}, t = {frame.time:.9g} s\n")
            _write_skins(file, drawing, drawing.points(frame))
    return files


def _write_skins(file: TextIO, drawing: Drawing, points: FloatArray) -> None:
    first = 1
    for skin in drawing.skins:
        file.write(f"o {'_'.join(skin.name.split())}\n")
        np.savetxt(file, points[skin.rows], fmt="v %.9g %.9g %.9g")
        np.savetxt(file, skin.triangles + first, fmt="f %d %d %d")
        first += len(skin.rows)


FORMAT = Format("obj", "text, a file a frame, for any modeller", (".obj",), write_obj, files=frame_files)
