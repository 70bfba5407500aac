"""Tetrahedral meshes: the type with its checks, and where they come from."""

from qlb.mesh.embedded_surface import EmbeddedSurface
from qlb.mesh.tet_mesh import TetMesh

__all__ = ["EmbeddedSurface", "TetMesh"]
