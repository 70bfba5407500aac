"""Binary glTF 2.0: each frame is a morph target, played one after the other. Written by hand, without a package."""

from __future__ import annotations

import json
import shutil
import struct
import tempfile
from dataclasses import dataclass, field
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.export.drawing import Drawing, Skin
from qlb.export.format import Format
from qlb.export.recording import Recording
from qlb.results.files import replacing

LIMIT = 2**32 - 1
"""Most bytes that the format can hold."""

_FLOAT, _SHORT, _INT = 5126, 5123, 5125
_VERTICES, _INDICES = 34962, 34963
_JSON, _BINARY = 0x4E4F534A, 0x004E4942


def write_glb(recording: Recording, path: Path) -> list[Path]:
    """Write `path`: a mesh for each body, obstacle and plane, in the colour of the body, which moves in real time.

    Vertices are float32, 12 bytes in each frame. Normals are left out: viewers shade each triangle by its own, and the
    file is half as large. Between two frames vertices go straight.

    Raises:
        InputError: the file would be larger than 4 GiB; a frame is damaged.
        WriteError: a file could not be written.
    """
    drawing = Drawing(recording)
    _require_room(drawing, len(recording.steps))
    with replacing(path) as temporary, tempfile.TemporaryFile(dir=path.parent) as binary:
        document = _document(recording, drawing, _Buffer(binary))
        with temporary.open("wb") as file:
            _assemble(file, document, binary)
    return [path]


def _require_room(drawing: Drawing, frames: int) -> None:
    moving = sum(len(skin.rows) for skin in drawing.skins if skin.moves)
    size = 12 * moving * frames + 4 * frames**2
    if size > 0.99 * LIMIT:
        raise InputError(
            f"{frames} frames of {moving} vertices are {size / 2**30:.1f} GiB, more than the 4 GiB that a glb file can"
            f" hold: choose fewer, such as --steps ::{int(np.ceil(size / (0.9 * LIMIT)))}"
        )


@dataclass
class _Buffer:
    """The binary part, and what the JSON part says of it."""

    file: IO[bytes]
    views: list[dict[str, int]] = field(default_factory=list)
    accessors: list[dict[str, Any]] = field(default_factory=list)

    def add(self, values: npt.NDArray[Any], kind: str, target: int | None = None, *, bounds: bool = False) -> int:
        """Append an array, float32 or unsigned; the index of its accessor."""
        begin = self.file.tell()
        self.file.write(np.ascontiguousarray(values).tobytes())
        size = self.file.tell() - begin
        self.file.write(b"\0" * (-size % 4))
        view = {"buffer": 0, "byteOffset": begin, "byteLength": size}
        self.views.append(view if target is None else view | {"target": target})
        types = {"f4": _FLOAT, "u2": _SHORT, "u4": _INT}
        accessor: dict[str, Any] = {
            "bufferView": len(self.views) - 1,
            "componentType": types[values.dtype.str[1:]],
            "count": len(values),
            "type": kind,
        }
        if bounds:
            rows = values.reshape(len(values), -1)
            accessor |= {"min": rows.min(axis=0).tolist(), "max": rows.max(axis=0).tolist()}
        self.accessors.append(accessor)
        return len(self.accessors) - 1


def _document(recording: Recording, drawing: Drawing, buffer: _Buffer) -> dict[str, Any]:
    """The JSON part; all binary data go to `buffer`."""
    skins = drawing.skins
    primitives: list[dict[str, Any]] = []
    first = np.empty((0, 3), np.float32)
    times = []
    for k, frame in enumerate(recording.frames()):
        points = drawing.points(frame).astype(np.float32)
        times.append(frame.time)
        if k == 0:
            first = points
            primitives = [_primitive(skin, i, points[skin.rows], buffer) for i, skin in enumerate(skins)]
            continue
        for skin, primitive in zip(skins, primitives, strict=True):
            if skin.moves:
                moved = points[skin.rows] - first[skin.rows]
                target = {"POSITION": buffer.add(moved, "VEC3", _VERTICES, bounds=True)}
                primitive.setdefault("targets", []).append(target)
    meshes: list[dict[str, Any]] = [{"name": s.name, "primitives": [p]} for s, p in zip(skins, primitives, strict=True)]
    for mesh, primitive in zip(meshes, primitives, strict=True):
        if "targets" in primitive:
            mesh["weights"] = [0.0] * len(primitive["targets"])
    document = {
        "asset": {"version": "2.0", "generator": "qlb"},
        "scene": 0,
        "scenes": [{"nodes": list(range(len(skins)))}],
        "nodes": [{"name": skin.name, "mesh": i} for i, skin in enumerate(skins)],
        "meshes": meshes,
        "materials": [_material(skin) for skin in skins],
    }
    animation = _animation(skins, np.array(times), buffer)
    if animation:
        document["animations"] = [animation]
    size = buffer.file.tell()
    return document | {
        "accessors": buffer.accessors,
        "bufferViews": buffer.views,
        "buffers": [{"byteLength": size}],
    }


def _primitive(skin: Skin, material: int, points: npt.NDArray[np.float32], buffer: _Buffer) -> dict[str, Any]:
    kind = np.uint16 if len(points) < 2**16 - 1 else np.uint32
    return {
        "attributes": {"POSITION": buffer.add(points, "VEC3", _VERTICES, bounds=True)},
        "indices": buffer.add(skin.triangles.astype(kind).ravel(), "SCALAR", _INDICES),
        "material": material,
        "mode": 4,
    }


def _material(skin: Skin) -> dict[str, Any]:
    surface = {"baseColorFactor": [*skin.colour, 1.0], "metallicFactor": 0.0, "roughnessFactor": 0.7}
    return {"name": skin.name, "pbrMetallicRoughness": surface, "doubleSided": skin.kind != "body"}


def _animation(skins: list[Skin], times: FloatArray, buffer: _Buffer) -> dict[str, Any]:
    """At frame k the weight of target k - 1 is one, all others zero; empty where nothing moves."""
    moving = [i for i, skin in enumerate(skins) if skin.moves]
    if not moving:
        return {}
    weights = np.eye(len(times), dtype=np.float32)[:, 1:]
    sampler = {
        "input": buffer.add((times - times[0]).astype(np.float32), "SCALAR", bounds=True),
        "output": buffer.add(weights.ravel(), "SCALAR"),
        "interpolation": "LINEAR",
    }
    channels = [{"sampler": 0, "target": {"node": i, "path": "weights"}} for i in moving]
    return {"name": "run", "samplers": [sampler], "channels": channels}


def _assemble(file: IO[bytes], document: dict[str, Any], binary: IO[bytes]) -> None:
    """Header, JSON chunk, binary chunk (glTF 2.0, section 4.4)."""
    text = json.dumps(document, separators=(",", ":")).encode("utf-8")
    text += b" " * (-len(text) % 4)
    size = binary.tell()
    file.write(struct.pack("<4sII", b"glTF", 2, 12 + 8 + len(text) + 8 + size))
    file.write(struct.pack("<II", len(text), _JSON) + text)
    file.write(struct.pack("<II", size, _BINARY))
    binary.seek(0)
    shutil.copyfileobj(binary, file)


FORMAT = Format("glb", "browsers, slides, Blender: an animated model in one file", (".glb",), write_glb)
