"""Reading tetrahedral meshes from files, through meshio."""

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
    import meshio

    if not path.is_file():
        raise InputError(f"mesh file {path} does not exist")
    if path.stat().st_size == 0:
        raise InputError(f"mesh file {path} is empty")
    try:
        with redirect_stdout(StringIO()), redirect_stderr(StringIO()):  # its readers print
            data = meshio.read(path)
    except (Exception, SystemExit) as error:  # its readers raise whatever they stumble over
        reason = str(error).strip().splitlines()
        raise InputError(f"mesh file {path} cannot be read: {reason[0] if reason else type(error).__name__}") from None
    cells = [block.data for block in data.cells if block.type == "tetra"]
    if not cells:
        kinds = sorted({block.type for block in data.cells}) or ["nothing"]
        raise InputError(f"mesh file {path} has no tetrahedra, only {', '.join(kinds)}")
    tets = np.vstack(cells)
    used, renumbered = np.unique(tets, return_inverse=True)
    if used[0] < 0 or used[-1] >= len(data.points):
        bad = used[-1] if used[0] >= 0 else used[0]
        raise InputError(f"mesh file {path}: node index {bad} is outside its {len(data.points)} nodes")
    positions = np.asarray(data.points, dtype=np.float64)[used, :3]
    return positions, renumbered.reshape(-1, 4).astype(np.int32), _regions(data)


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
