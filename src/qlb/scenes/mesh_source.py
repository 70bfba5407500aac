"""Where the mesh of a scene comes from, if not from the scene itself."""

from __future__ import annotations

from pathlib import Path
from typing import Any

from pydantic import Field

from qlb.mesh import TetMesh
from qlb.settings import FilePath, Settings, quantity


class MeshSource(Settings):
    """A file of tetrahedra, or of a surface that is filled with them."""

    path: FilePath | None = Field(None, description="A mesh file to use instead: tets, or a surface to fill with tets")
    tets: int = quantity(5000, "About how many tets a shape or surface is to have; a file of tets has its own", ge=100)
    edge: float | None = quantity(None, "Or the length of its edges, before the mesh is scaled", unit="m", gt=0)

    def target(self) -> dict[str, Any]:
        """How fine the mesh is to be, as shapes and `TetMesh.load` take it."""
        return {"tets": self.tets} if self.edge is None else {"edge": self.edge}

    def load(self, path: Path) -> TetMesh:
        """The tets of a file, or those that fill its surface: the one place where a path of a scene becomes a mesh.

        Raises:
            InputError: the file is missing or wrong.
        """
        return TetMesh.load(path, **self.target())
