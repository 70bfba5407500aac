"""The other side of `qlb.mesh.child`: a script that reads mesh files and fills surfaces, in a process of its own.

Readers of mesh formats believe what a file says: they allocate what its header claims, and some wait for a line that
never comes. Here that harms nobody: the address space is limited, and the parent ends what takes too long. fTetWild
prints, and ends the process where it meets what it cannot do.

It imports nothing of qlb, which would make its start slow. A message is a line of JSON, whose "arrays" are name, type
and shape of the arrays that follow in binary. Requests come on standard input, answers go to standard output:

    {"task": "prepare", "path": ...}                      nothing: imports what reads such a file
    {"task": "read", "path": ...}                         points, tets, triangles, regions; "kinds" of the cells
    {"task": "fill", "edge": ..., "epsilon": ..., "folder": ...} + vertices, triangles      positions, tets
    {"refused": reason}                                   instead of an answer
"""

from __future__ import annotations

import json
import os
import sys
import threading
from collections.abc import Callable
from importlib import import_module
from pathlib import Path
from typing import IO, Any

import numpy as np
import numpy.typing as npt

Arrays = dict[str, npt.NDArray[Any]]

IDLE = 20.0
"""Without a request for so long [s], the process ends."""
SPARE_MEMORY = 2 << 30
MEMORY_PER_BYTE = 50
"""Reading may take so much memory [bytes], and so many bytes for each byte of the file."""
REGION_DATA = ("region", "gmsh:physical", "medit:ref")
"""Cell data that hold the region of each tet, the first whole numbers that a file has: our own, gmsh's, Medit's."""
TRIMESH = (".obj", ".stl", ".ply", ".off", ".gltf", ".glb")
USD = (".usd", ".usda", ".usdc", ".usdz")


class Refused(Exception):
    """The file is wrong, and why."""


def prepare(path: Path) -> tuple[dict[str, Any], Arrays]:
    """Import what reads a file, which neither its time nor its memory pays for."""
    import_module("trimesh" if path.suffix.lower() in TRIMESH else "pxr.Usd" if _is_usd(path) else "meshio")
    return {}, {}


def read(path: Path) -> tuple[dict[str, Any], Arrays]:
    """Kinds of cells, and arrays, of a file in any format."""
    reader = _read_trimesh if path.suffix.lower() in TRIMESH else _read_usd if _is_usd(path) else _read_meshio
    _limit_memory(SPARE_MEMORY + MEMORY_PER_BYTE * path.stat().st_size)
    try:
        return reader(path)
    except Refused:
        raise
    except MemoryError:
        raise Refused("it asks for far more memory than a file of its size can need") from None
    except (Exception, SystemExit) as error:  # readers raise whatever they stumble over
        said = " ".join([f"{type(error).__name__}:", *str(error).split()]).removesuffix(":")
        why = "" if isinstance(error, SystemExit) else f" ({said})"  # meshio has printed why, and exits
        raise Refused(f"it is damaged, or not what its suffix says{why}") from None
    finally:
        _limit_memory(None)


def _is_usd(path: Path) -> bool:
    return path.suffix.lower() in USD


def fill(header: dict[str, Any], arrays: Arrays) -> tuple[dict[str, Any], Arrays]:
    """Tets within a surface, by fTetWild."""
    from pytetwild import tetrahedralize  # type: ignore[attr-defined]

    os.chdir(header["folder"])  # where fTetWild leaves a file behind
    positions, tets = tetrahedralize(
        arrays["vertices"],
        arrays["triangles"],
        edge_length_abs=header["edge"],
        epsilon=header["epsilon"],
        vtk_ordering=True,  # which turns its tets to positive orientation
    )
    return {}, {"positions": positions, "tets": tets}


def _limit_memory(spare: int | None) -> None:
    """Let the address space grow by `spare` bytes at most; None: as it was. Nothing happens where that has no limit."""
    try:
        import resource

        _, hard = resource.getrlimit(resource.RLIMIT_AS)
        soft = hard
        if spare is not None:
            pages = int(Path("/proc/self/statm").read_text().split()[0])
            soft = pages * resource.getpagesize() + spare
            soft = soft if hard == resource.RLIM_INFINITY else min(soft, hard)
        resource.setrlimit(resource.RLIMIT_AS, (soft, hard))
    except (ImportError, OSError, ValueError):
        return


def _read_meshio(path: Path) -> tuple[dict[str, Any], Arrays]:
    import meshio

    if not any(map(path.name.lower().endswith, meshio.extension_to_filetypes)):
        raise Refused(f"the suffix {path.suffix!r} is of no format that is known, such as .obj, .stl, .ply, .msh, .vtu")
    data = meshio.read(path)
    blocks = [(block.type, np.asarray(block.data)) for block in data.cells if len(block.data)]
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    triangles = [cells if kind == "triangle" else cells[:, halves] for kind, cells in blocks if kind in SIDES]
    tets = [cells for kind, cells in blocks if kind == "tetra"]
    arrays: Arrays = {"points": np.asarray(data.points, dtype=np.float64)}
    arrays["triangles"] = np.concatenate([np.empty((0, 3), np.int64), *(t.reshape(-1, 3) for t in triangles)])
    arrays["tets"] = np.concatenate([np.empty((0, 4), np.int64), *tets])
    for name in REGION_DATA:
        if name in data.cell_data:
            given = zip(data.cells, data.cell_data[name], strict=True)
            values = np.concatenate([np.empty(0), *(np.asarray(v) for block, v in given if block.type == "tetra")])
            if values.ndim == 1 and np.isfinite(values).all() and (np.floor(values) == values).all():
                arrays["regions"] = values.astype(np.int64)
                break
    return {"kinds": sorted({kind for kind, _ in blocks})}, arrays


SIDES = ("triangle", "quad")
PARTS = {"PointCloud": "points", "Path2D": "lines", "Path3D": "lines"}
"""What trimesh makes of a file without triangles."""


def _read_trimesh(path: Path) -> tuple[dict[str, Any], Arrays]:
    import trimesh

    scene = trimesh.load_scene(path, process=False, skip_materials=True)
    parts = []
    for node in scene.graph.nodes_geometry:
        transform, name = scene.graph[node]
        geometry = scene.geometry[name]
        if isinstance(geometry, trimesh.Trimesh):
            parts.append((np.asarray(geometry.vertices), np.asarray(geometry.faces), np.asarray(transform)))
    kinds = sorted(PARTS.get(type(geometry).__name__, "others") for geometry in scene.geometry.values())
    return {"kinds": list(dict.fromkeys(kinds)) if not parts else ["triangle"]}, _joined(parts)


def _read_usd(path: Path) -> tuple[dict[str, Any], Arrays]:
    from pxr import Usd, UsdGeom

    stage = Usd.Stage.Open(str(path))
    time = Usd.TimeCode.EarliestTime()
    transforms = UsdGeom.XformCache(time)
    parts, kinds = [], set()
    for prim in Usd.PrimRange(stage.GetPseudoRoot(), Usd.TraverseInstanceProxies()):
        kinds.add(str(prim.GetTypeName()))
        mesh = UsdGeom.Mesh(prim)
        if mesh and mesh.ComputePurpose() in ("default", "render") and mesh.ComputeVisibility(time) != "invisible":
            transform = np.array(transforms.GetLocalToWorldTransform(prim)).T
            parts.append((_usd_points(mesh, time), _usd_triangles(mesh, time), transform))
    arrays = _joined(parts)
    arrays["points"] = arrays["points"] * UsdGeom.GetStageMetersPerUnit(stage)
    if UsdGeom.GetStageUpAxis(stage) == "Z":
        arrays["points"] = arrays["points"][:, [0, 2, 1]] * [1.0, 1.0, -1.0]  # a quarter turn about x
    return {"kinds": ["triangle"] if parts else sorted(filter(None, kinds))}, arrays


def _usd_points(mesh: Any, time: Any) -> npt.NDArray[np.float64]:
    return np.array(mesh.GetPointsAttr().Get(time) or np.empty((0, 3)), dtype=np.float64).reshape(-1, 3)


def _usd_triangles(mesh: Any, time: Any) -> npt.NDArray[np.int64]:
    """Polygons as fans of triangles, counterclockwise from outside, shape (t, 3)."""
    counts = np.array(mesh.GetFaceVertexCountsAttr().Get(time) or [], dtype=np.int64)
    corners = np.array(mesh.GetFaceVertexIndicesAttr().Get(time) or [], dtype=np.int64)
    if (counts < 0).any() or counts.sum() != len(corners):
        raise Refused(f"faceVertexCounts of {mesh.GetPath()} do not fit its {len(corners)} faceVertexIndices")
    fans = np.maximum(counts - 2, 0)
    first = np.repeat(np.cumsum(counts) - counts, fans)
    k = np.arange(fans.sum()) - np.repeat(np.cumsum(fans) - fans, fans)
    triangles = np.stack([corners[first], corners[first + k + 1], corners[first + k + 2]], axis=1)
    left = mesh.GetOrientationAttr().Get() == "leftHanded"
    return triangles[:, ::-1] if left else triangles


def _joined(parts: list[tuple[Any, Any, Any]]) -> Arrays:
    """Vertices, triangles and transforms (4, 4) of several objects as one; a mirrored one keeps its outside."""
    points, triangles, begin = [np.empty((0, 3))], [np.empty((0, 3), np.int64)], 0
    for vertices, faces, transform in parts:
        if faces.size and (faces.min() < 0 or faces.max() >= len(vertices)):
            bad = faces.min() if faces.min() < 0 else faces.max()
            raise Refused(f"vertex index {bad} is outside its {len(vertices)} vertices")
        points.append(vertices @ transform[:3, :3].T + transform[:3, 3])
        mirrored = np.linalg.det(transform[:3, :3]) < 0
        triangles.append((faces[:, ::-1] if mirrored else faces).astype(np.int64) + begin)
        begin += len(vertices)
    return {
        "points": np.concatenate(points),
        "triangles": np.concatenate(triangles),
        "tets": np.empty((0, 4), np.int64),
    }


def send(stream: IO[bytes], header: dict[str, Any], arrays: Arrays) -> None:
    """Write a message."""
    described = [(name, array.dtype.str, array.shape) for name, array in arrays.items()]
    stream.write(json.dumps(header | {"arrays": described}).encode() + b"\n")
    for array in arrays.values():
        stream.write(array.tobytes())
    stream.flush()


def receive(stream: IO[bytes]) -> tuple[dict[str, Any], Arrays]:
    """Read a message. Raises `EOFError` where the other side has gone."""
    line = stream.readline()
    if not line.endswith(b"\n"):
        raise EOFError
    header, arrays = json.loads(line), {}
    for name, kind, shape in header.pop("arrays"):
        size = int(np.prod(shape)) * np.dtype(kind).itemsize
        data = stream.read(size)
        if len(data) < size:
            raise EOFError
        arrays[name] = np.frombuffer(bytearray(data), kind).reshape(shape)
    return header, arrays


def answer(header: dict[str, Any], arrays: Arrays) -> tuple[dict[str, Any], Arrays]:
    """What to send back for a request."""
    try:
        if header["task"] == "fill":
            return fill(header, arrays)
        return {"prepare": prepare, "read": read}[header["task"]](Path(header["path"]))
    except (Exception, SystemExit) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        return {"refused": reason[:300] + ("..." if len(reason) > 300 else "")}, {}


def main() -> None:
    """Answer requests until there are no more, or none comes for `IDLE` seconds."""
    requests, answers = sys.stdin.buffer, os.fdopen(os.dup(1), "wb")
    os.dup2(os.open(os.devnull, os.O_WRONLY), 1)  # for what readers print; standard error is the parent's choice
    exit_now: Callable[[], None] = lambda: os._exit(0)  # noqa: E731
    while True:
        timer = threading.Timer(IDLE, exit_now)
        timer.daemon = True
        timer.start()
        try:
            header, arrays = receive(requests)
        except EOFError:
            return
        timer.cancel()
        send(answers, *answer(header, arrays))


if __name__ == "__main__":
    main()
