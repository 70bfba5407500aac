"""Fuzz target: mesh files in the formats that Python reads. Each is a mesh, or there is one `InputError` of one line.

The first byte of an input chooses the suffix, the rest is the file. The reader of `qlb.mesh.worker` runs within this
process, with the limits that the process of its own has otherwise. OpenUSD's readers, compiled, are left out: where
they crash, that process is what ends.
"""

from __future__ import annotations

import json
import signal
import tempfile
from contextlib import redirect_stderr
from io import StringIO
from pathlib import Path
from typing import Any

import atheris

with atheris.instrument_imports(include=["qlb.mesh", "meshio", "trimesh"]):
    import meshio
    import trimesh

    from qlb import InputError, TetMesh
    from qlb.mesh import files, worker
    from qlb.mesh.child import ChildRefused
    from qlb.mesh.surface import repair

from runner import fuzz

SUFFIXES = (".msh", ".vtk", ".vtu", ".mesh", ".obj", ".stl", ".ply", ".off", ".glb", ".gltf")
SECONDS = 5.0
"""CPU time for one read; qlb gives a minute."""


def ask(request: dict[str, Any], arrays: worker.Arrays, *, seconds: float) -> tuple[dict[str, Any], worker.Arrays]:
    """`qlb.mesh.child.ask` within this process."""
    signal.setitimer(signal.ITIMER_VIRTUAL, min(seconds, SECONDS))
    try:
        with redirect_stderr(StringIO()):  # meshio says there what it stumbles over
            header, found = worker.answer(request, arrays)
    finally:
        signal.setitimer(signal.ITIMER_VIRTUAL, 0.0)
    if "refused" in header:
        raise ChildRefused(header["refused"])
    return json.loads(json.dumps(header)), found


def out_of_time(*_: object) -> None:
    """Stop the reader; it is `worker.read` that catches this."""
    raise TimeoutError


def target(data: bytes, path: Path) -> None:
    """Read what `data` holds, the way that `TetMesh.load` takes."""
    if not data:
        return
    path = path.with_suffix(SUFFIXES[data[0] % len(SUFFIXES)])
    path.write_bytes(data[1:])
    try:
        file = files.MeshFile.read(path)
        if len(file.tets):
            positions, tets, regions = file.used_tets()
            TetMesh(positions, tets, regions=regions)
        else:
            repair(*file.surface())
    except InputError as error:
        if "\n" in str(error):
            raise AssertionError(f"no message of one line: {error}") from error


def _seeds() -> dict[str, bytes]:
    box = TetMesh.box((1.0, 0.5, 0.25), cells=(1, 1, 1))
    tets = meshio.Mesh(box.positions, [("tetra", box.tets)])
    surface = trimesh.Trimesh(box.positions, box.boundary_triangles(), process=False)
    seeds = {}
    with tempfile.TemporaryDirectory() as folder:
        for form, suffix in (("gmsh", ".msh"), ("gmsh22", ".msh"), ("vtk", ".vtk"), ("vtu", ".vtu")):
            for binary in (False, True):
                path = Path(folder) / f"{form}-{binary}{suffix}"
                tets.write(path, file_format=form, binary=binary)
                seeds[path.name] = path.read_bytes()
        tets.write(Path(folder) / "medit.mesh", file_format="medit")
        seeds["medit.mesh"] = (Path(folder) / "medit.mesh").read_bytes()
        for form in ("obj", "stl", "stl_ascii", "ply", "off", "glb"):
            made = surface.export(file_type=form)
            seeds[f"{form}.{form.removesuffix('_ascii')}"] = made if isinstance(made, bytes) else made.encode()
        seeds |= {name: made for name, made in surface.export(file_type="gltf").items() if name.endswith(".gltf")}
    return {name: bytes([SUFFIXES.index(Path(name).suffix)]) + content for name, content in seeds.items()}


WORDS = [
    "$Nodes",
    "$EndNodes",
    "$Elements",
    "$EndElements",
    "$PhysicalNames",
    "$Entities",
    "2.2",
    "4.1",
    "POINTS",
    "CELLS",
    "CELL_TYPES",
    "ASCII",
    "BINARY",
    "DATASET",
    "UNSTRUCTURED_GRID",
    "element",
    "vertex",
    "face",
    "property",
    "list",
    "uchar",
    "binary_little_endian",
    "end_header",
    "OFF",
    "solid",
    "facet",
    "endfacet",
    "Vertices",
    "Tetrahedra",
    "Triangles",
    "End",
    "usemtl",
    "mtllib",
    "accessors",
    "bufferViews",
    "byteOffset",
    "componentType",
    "nan",
    "inf",
    "-1",
    "1000000000000",
]

if __name__ == "__main__":
    files.ask = ask
    files.SECONDS = SECONDS
    signal.signal(signal.SIGVTALRM, out_of_time)
    fuzz("meshes", _seeds(), WORDS, target)
