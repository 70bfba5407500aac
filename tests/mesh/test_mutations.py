"""A mesh file that is damaged is refused with one clear line, or is a mesh: nothing hangs, crashes or eats the memory.

204 files: 17 of 10 formats, each damaged in 12 ways, some at random (with a fixed seed).
"""

from __future__ import annotations

import re
import subprocess
import sys
import time
from pathlib import Path

import numpy as np
import pytest

from qlb import InputError, TetMesh
from qlb.mesh import child, files
from qlb.mesh.files import MeshFile
from qlb.mesh.surface import repair
from tests.mesh.surfaces import FILES

NUMBER = re.compile(rb"(?<![\w.+-])-?\d+(?:\.\d+)?(?:[eE][+-]?\d+)?(?![\w.])")


def _number(content: bytes, rng: np.random.Generator, becomes: bytes, *, integer: bool = False) -> bytes:
    """`content` with one of its numbers replaced; in a binary file, where there are few, also four of its bytes."""
    found = [m for m in NUMBER.finditer(content) if not integer or m.group().isdigit()]
    if found:
        chosen = found[rng.integers(len(found))]
        content = content[: chosen.start()] + becomes + content[chosen.end() :]
    if b"\0" in content:
        at = int(rng.integers(len(content) - 4))
        content = (
            content[:at] + rng.choice([b"\xff\xff\xff\x7f", b"\xff\xff\xff\xff", b"\0\0\xc0\x7f"]) + content[at + 4 :]
        )
    return content


def _flipped(content: bytes, rng: np.random.Generator, count: int) -> bytes:
    data = np.frombuffer(bytearray(content), np.uint8)
    data[rng.integers(len(data), size=count)] = rng.integers(256, size=count)
    return data.tobytes()


def _without_lines(content: bytes, rng: np.random.Generator) -> bytes:
    lines = content.splitlines(keepends=True)
    return b"".join(line for line in lines if rng.random() > 0.1)


MUTATIONS = {
    "cut short": lambda c, rng: c[: int(len(c) * rng.uniform(0.05, 0.95))],
    "last bytes missing": lambda c, rng: c[: -int(rng.integers(1, 40))],
    "huge number": lambda c, rng: _number(c, rng, b"1000000000000", integer=True),
    "huge header": lambda c, rng: _number(c[:200], rng, b"1000000000000", integer=True) + c[200:],
    "negative number": lambda c, rng: _number(c, rng, b"-7", integer=True),
    "index one too large": lambda c, rng: _number(c, rng, b"33", integer=True),
    "nan": lambda c, rng: _number(c, rng, b"nan"),
    "infinite": lambda c, rng: _number(c, rng, b"1e308"),
    "a few bytes": lambda c, rng: _flipped(c, rng, 3),
    "many bytes": lambda c, rng: _flipped(c, rng, max(1, len(c) // 10)),
    "lines missing": _without_lines,
    "twice": lambda c, rng: c + c,
}


def read(path: Path) -> str:
    """What comes of a file, by the way that `TetMesh.load` takes."""
    try:
        file = MeshFile.read(path)
        if len(file.tets):
            positions, tets, regions = file.used_tets()
            TetMesh(positions, tets, regions=regions)
        else:
            repair(*file.surface())
    except InputError as error:
        message = str(error)
        assert "\n" not in message
        assert "Traceback" not in message
        return message
    return ""


@pytest.fixture(autouse=True)
def little_patience(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(files, "SECONDS", 5.0)


@pytest.mark.parametrize("name", FILES)
def test_damaged_files_are_refused_or_meshes(tmp_path: Path, name: str) -> None:
    rng = np.random.default_rng(sorted(FILES).index(name))
    path = tmp_path / name
    FILES[name](path)
    content = path.read_bytes()
    assert read(path) == ""
    refused = 0
    for mutation, change in MUTATIONS.items():
        path.write_bytes(change(content, rng))
        begin = time.monotonic()
        message = read(path)
        assert time.monotonic() - begin < 30, mutation
        refused += message.startswith("mesh file ") or message.startswith(("tet ", "node "))
        assert message == "" or str(path) in message or message.startswith(("tet ", "node ")), mutation
    assert refused >= 4  # or nothing was damaged


BOMBS = {
    "bomb.ply": b"ply\nformat binary_little_endian 1.0\nelement vertex 1000000000000\nproperty double x\n"
    b"property double y\nproperty double z\nelement face 1\nproperty list uchar int vertex_indices\nend_header\n",
    "bomb.off": b"OFF\n1000000000000 1 0\n0 0 0\n1 0 0\n0 1 0\n3 0 1 2\n",
    "bomb.stl": bytes(80) + b"\xff\xff\xff\x7f" + bytes(50),
    "bomb.msh": b"$MeshFormat\n2.2 0 8\n$EndMeshFormat\n$Nodes\n1000000000000\n1 0 0 0\n$EndNodes\n",
    "bomb4.msh": b"$MeshFormat\n4.1 0 8\n$EndMeshFormat\n$Nodes\n1 1000000000000 1 1000000000000\n"
    b"3 1 0 1000000000000\n",
    "bomb.vtk": b"# vtk DataFile Version 3.0\nx\nBINARY\nDATASET UNSTRUCTURED_GRID\nPOINTS 1000000000000 double\n0\n",
    "bomb.mesh": b"MeshVersionFormatted 2\nDimension 3\nVertices\n1000000000000\n0 0 0 1\n",
    "index.obj": b"v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 1000000000000\n",
}  # fmt: skip


@pytest.mark.parametrize("name", BOMBS)
def test_a_header_that_claims_a_great_many_allocates_little(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    path.write_bytes(BOMBS[name])
    assert read(path) != ""
    kept = child._kept
    status = Path(f"/proc/{kept._process.pid}/status") if kept is not None else None
    if status is not None and status.is_file():
        peak = int(re.search(r"VmHWM:\s*(\d+) kB", status.read_text())[1])  # type: ignore[index]
        assert peak < 1.5e6  # 1.5 GB


@pytest.mark.slow
@pytest.mark.parametrize("name", ["gmsh41 text.msh", "text.vtu", "surface.obj", "binary.stl", "surface.glb"])
def test_the_command_ends_with_status_2(tmp_path: Path, name: str) -> None:
    path = tmp_path / name
    FILES[name](path)
    path.write_bytes(path.read_bytes()[:150])
    call = [sys.executable, "-c", "from qlb.cli.main import main; main()", "mesh", str(path)]
    done = subprocess.run(call, capture_output=True, text=True, timeout=60, check=False)
    assert done.returncode == 2, done.stderr
    assert done.stderr.startswith("error: mesh file ")
    assert "Traceback" not in done.stderr
