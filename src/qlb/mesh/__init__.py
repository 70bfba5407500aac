"""Tetrahedral meshes: the type with its checks, and where they come from."""

from qlb.mesh.embedded_surface import EmbeddedSurface
from qlb.mesh.files import read_surface
from qlb.mesh.filling import MeshReport
from qlb.mesh.quality import MeshQuality
from qlb.mesh.surface import SurfaceReport
from qlb.mesh.tet_mesh import TetMesh

__all__ = ["EmbeddedSurface", "MeshQuality", "MeshReport", "SurfaceReport", "TetMesh", "read_surface"]
