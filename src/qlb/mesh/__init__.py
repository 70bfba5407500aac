"""Tetrahedral meshes: the type with its checks, and generators."""

from qlb.mesh.box import box_mesh
from qlb.mesh.tet_mesh import TetMesh

__all__ = ["TetMesh", "box_mesh"]
