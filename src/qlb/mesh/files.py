"""Reading meshes from files, through meshio."""

from __future__ import annotations

from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import Any

import numpy as np

from qlb.arrays import FloatArray, IntArray, LongArray
from qlb.errors import InputError

# Cell data that hold the region of each tet, the first that a file has: our own, gmsh's, Medit's.
REGION_DATA = ("region", "gmsh:physical", "medit:ref")


def read_tets(path: Path) -> tuple[FloatArray, IntArray, LongArray | None]:
    """Positions [m] (n, 3), tets (m, 4) without unused nodes, and regions (m,) of a mesh file; see `TetMesh.read`."""
    data = _read(path)
    cells = [block.data for block in data.cells if block.type == "tetra"]
    positions, tets = _used(path, data, cells, "tetrahedra")
    return positions, tets, _regions(data)


def read_triangles(path: Path) -> tuple[FloatArray, IntArray]:
    """Vertices [m] (q, 3) and triangles (t, 3) of a mesh file, quads cut in two; see `Obstacle.read`."""
    data = _read(path)
    halves = np.array([[0, 1, 2], [0, 2, 3]])
    triangles = {"triangle": lambda cells: cells, "quad": lambda cells: cells[:, halves].reshape(-1, 3)}
    cells = [triangles[block.type](np.asarray(block.data)) for block in data.cells if block.type in triangles]
    return _used(path, data, cells, "triangles")


def _read(path: Path) -> Any:
    """What meshio makes of a file. Raises `InputError` where it is missing, empty or cannot be read."""
    import meshio

    if not path.is_file():
        raise InputError(f"mesh file {path} does not exist")
    if path.stat().st_size == 0:
        raise InputError(f"mesh file {path} is empty")
    try:
        # Its readers print, and count in few bits where they guess whether an STL is text.
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()), np.errstate(over="ignore"):
            return meshio.read(path)
    except (Exception, SystemExit) as error:  # its readers raise whatever they stumble over
        reason = str(error).strip().splitlines()
        raise InputError(f"mesh file {path} cannot be read: {reason[0] if reason else type(error).__name__}") from None


def _used(path: Path, data: Any, cells: list[Any], what: str) -> tuple[FloatArray, IntArray]:
    """The nodes that `cells` use, and all cells in terms of them. Raises `InputError` where there are none."""
    if not any(map(len, cells)):
        kinds = sorted({block.type for block in data.cells}) or ["nothing"]
        raise InputError(f"mesh file {path} has no {what}, only {', '.join(kinds)}")
    stacked = np.vstack(cells)
    used, renumbered = np.unique(stacked, return_inverse=True)
    if used[0] < 0 or used[-1] >= len(data.points):
        bad = used[-1] if used[0] >= 0 else used[0]
        raise InputError(f"mesh file {path}: node index {bad} is outside its {len(data.points)} nodes")
    positions = np.asarray(data.points, dtype=np.float64)[used, :3]
    return positions, renumbered.reshape(stacked.shape).astype(np.int32)


def _regions(data: Any) -> LongArray | None:
    """The region of each tet of a meshio mesh, shape (m,), where it has such data and they are whole numbers."""
    for name in REGION_DATA:
        if name in data.cell_data:
            pairs = zip(data.cells, data.cell_data[name], strict=True)
            values = np.concatenate([np.asarray(given) for block, given in pairs if block.type == "tetra"])
            whole = values.ndim == 1 and values.dtype.kind in "iuf" and np.isfinite(values).all()
            if whole and (np.floor(values) == values).all():
                return values.astype(np.int64)
    return None
