"""Dead loads on nodes and surfaces, constant or in time."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from qlb import _native
from qlb.arrays import IntArray
from qlb.energies.energy import Energy, TermInTime, checked_nodes
from qlb.energies.in_time import InTime, at_time, check_constant
from qlb.energies.potential import DeadLoad, Term
from qlb.energies.surface import area_vectors, outward
from qlb.errors import InputError
from qlb.mesh.tet_mesh import TetMesh


class PointForce(Energy):
    """A force [N] on each of some nodes; it keeps its direction.

    Args:
        nodes: node indices.
        force: [N], shape (3,) for each node alike or (k, 3), or a function of time [s] that gives one of the two.
    """

    def __init__(self, nodes: npt.ArrayLike, force: InTime) -> None:
        self.nodes, self.force = nodes, force

    def node_sets(self, mesh: TetMesh) -> IntArray:
        """None. Raises `InputError` where nodes or a constant force do not fit."""
        nodes = self._indices(mesh)
        check_constant("point force", self.force, (len(nodes), 3))
        return super().node_sets(mesh)

    def term(self, mesh: TetMesh, pattern: _native.BlockPattern, threads: int) -> Term:
        """A dead load at the stage's time."""
        nodes = self._indices(mesh)

        def load(time: float) -> DeadLoad:
            forces = np.zeros_like(mesh.positions)
            forces[nodes] = at_time("point force", self.force, time, (len(nodes), 3))
            return DeadLoad(forces, mesh.positions, threads)

        return TermInTime(load)

    def _indices(self, mesh: TetMesh) -> IntArray:
        nodes = checked_nodes(self, "node", np.reshape(self.nodes, (-1, 1)), mesh).ravel()
        if len(nodes) == 0:
            raise InputError("no nodes for PointForce: the selection is empty")
        if len(np.unique(nodes)) < len(nodes):
            ordered = np.sort(nodes)
            twice = ordered[1:][ordered[1:] == ordered[:-1]][0]
            raise InputError(f"node {twice} of PointForce is given more than once")
        return nodes


class Traction(Energy):
    """A force per area at rest [Pa] on part of the surface; it keeps its direction.

    Args:
        faces: triangles of the mesh's surface, shape (k, 3), as from `TetMesh.faces_where`.
        traction: [Pa], shape (3,), or a function of time [s] that gives it.
    """

    def __init__(self, faces: npt.ArrayLike, traction: InTime) -> None:
        self.faces, self.traction = faces, traction

    def node_sets(self, mesh: TetMesh) -> IntArray:
        """None. Raises `InputError` where faces or a constant traction do not fit."""
        outward(self, self.faces, mesh)
        check_constant("traction", self.traction, (3,))
        return super().node_sets(mesh)

    def term(self, mesh: TetMesh, pattern: _native.BlockPattern, threads: int) -> Term:
        """A dead load at the stage's time: a third of each triangle's area to each of its nodes."""
        faces = outward(self, self.faces, mesh)
        area = np.linalg.norm(area_vectors(mesh.positions[faces]), axis=1)
        share = np.bincount(faces.ravel(), weights=np.repeat(area / 3, 3), minlength=len(mesh.positions))

        def load(time: float) -> DeadLoad:
            traction = at_time("traction", self.traction, time, (3,))
            return DeadLoad(np.outer(share, traction), mesh.positions, threads)

        return TermInTime(load)
