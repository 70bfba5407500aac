"""Writing the tets of a mesh to a file, through meshio."""

from __future__ import annotations

import os
import tempfile
from contextlib import redirect_stderr, redirect_stdout
from io import StringIO
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from qlb.errors import InputError
from qlb.mesh.files import MeshFile

if TYPE_CHECKING:
    from qlb.mesh.tet_mesh import TetMesh

SUFFIXES = (".msh", ".vtu", ".vtk", ".mesh", ".xdmf", ".inp", ".med", ".bdf", ".f3grid", ".su2")
"""Of files that hold tets."""
REGIONS: dict[str, tuple[str | None, tuple[str, ...]]] = {
    ".msh": ("gmsh22", ("gmsh:physical", "gmsh:geometrical")),  # as gmsh 4.1 meshio loses them
    ".mesh": (None, ("medit:ref",)),
}
"""Format, and names of regions in it, where they are not meshio's choice and our name."""


def write_tets(mesh: TetMesh, path: Path) -> None:
    """Write nodes, tets and regions in the format of the suffix, in place of what was there; see `TetMesh.write`."""
    import meshio

    if path.suffix.lower() not in SUFFIXES:
        raise InputError(f"{path}: tets are written to files that end in {', '.join(SUFFIXES)}")
    form, data = None, {}
    if mesh.regions is not None:
        form, names = REGIONS.get(path.suffix.lower(), (None, ("region",)))
        data = {name: [mesh.regions] for name in names}
    try:
        with tempfile.TemporaryDirectory(prefix=".qlb-", dir=path.absolute().parent) as folder:
            written = Path(folder) / path.name
            # Its writers warn about optional data that a plain mesh lacks.
            with redirect_stdout(StringIO()), redirect_stderr(StringIO()):
                meshio.Mesh(mesh.positions, [("tetra", mesh.tets)], cell_data=data).write(written, file_format=form)
            _check(mesh, written)
            for file in Path(folder).iterdir():  # XDMF has a second one
                os.replace(file, path.parent / file.name)
    except OSError as error:
        raise InputError(f"{path} cannot be written: {error.strerror or error}") from None
    except (ImportError, meshio.WriteError, ValueError, KeyError) as error:
        raise InputError(f"{path} cannot be written: {' '.join(str(error).split())}") from None


def _check(mesh: TetMesh, written: Path) -> None:
    """Raise `ValueError` where the file does not hold the mesh, up to the digits that its format has room for."""
    read = MeshFile.read(written).used_tets()
    size = float(np.linalg.norm(np.ptp(mesh.positions, axis=0)))
    same = read[0].shape == mesh.positions.shape and read[1].shape == mesh.tets.shape
    if not same or np.abs(read[0] - mesh.positions).max() > 1e-5 * size or (read[1] != mesh.tets).any():
        raise ValueError("what its format holds is not this mesh")
