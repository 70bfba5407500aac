"""Reading tetrahedral meshes from files, through meshio."""

from __future__ import annotations

from pathlib import Path

import numpy as np

from qlb.arrays import FloatArray, IntArray
from qlb.errors import InputError


def read_tets(path: Path) -> tuple[FloatArray, IntArray]:
    """Positions [m] (n, 3) and tets (m, 4) of a mesh file, without unused nodes; see `TetMesh.read`."""
    import meshio

    if not path.is_file():
        raise InputError(f"mesh file {path} does not exist")
    if path.stat().st_size == 0:
        raise InputError(f"mesh file {path} is empty")
    try:
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
    return np.asarray(data.points, dtype=np.float64)[used, :3], renumbered.reshape(-1, 4).astype(np.int32)
