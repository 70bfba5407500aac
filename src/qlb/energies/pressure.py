"""Pressure: a load that follows the surface."""

from __future__ import annotations

import numpy as np
import numpy.typing as npt

from qlb import _native
from qlb.arrays import FloatArray, IntArray
from qlb.energies.energy import Energy
from qlb.energies.in_time import InTime, at_time, check_constant
from qlb.energies.potential import Potential, Term
from qlb.energies.scatter import BlockFinder, StencilScatter
from qlb.energies.surface import outward, rim
from qlb.integrators.integrator import Stage
from qlb.mesh.tet_mesh import TetMesh


class Pressure(Energy):
    """A pressure p [Pa] on part of the surface: a force -p n per deformed area, n the outward normal of the body.

    The faces of a cavity have normals that point into it, so a pressure inside a closed cavity inflates it.

    Args:
        faces: triangles of the mesh's surface, shape (k, 3), as from `TetMesh.faces_where`.
        pressure: [Pa], or a function of time [s] that gives it.
    """

    def __init__(self, faces: npt.ArrayLike, pressure: InTime) -> None:
        self.faces, self.pressure = faces, pressure

    def node_sets(self, mesh: TetMesh) -> IntArray:
        """None but those of the tets. Raises `InputError` where faces or a constant pressure do not fit."""
        outward(self, self.faces, mesh)
        check_constant("pressure", self.pressure, ())
        return super().node_sets(mesh)

    def term(self, mesh: TetMesh, pattern: _native.BlockPattern, threads: int) -> Term:
        """p V, with what its rim lacks taken at the guess."""
        return _PressureTerm(self, outward(self, self.faces, mesh), pattern)


class _PressureTerm:
    """Phi = p V(x) + p C(x): V = sum of (x0 - o).(x1 - o) x (x2 - o)/6 over the faces, C what their rim lacks.

    On a closed set of faces dV/dx is a third of each area vector to each node, which is the follower load. On an open
    one the cones from o over the rim leave out (a - o) x (b - o)/6 at either end of each directed edge (a, b) of it.
    That has no potential (a pressure on an open set is not conservative); C has its value and the symmetric part of
    its derivative at the guess.
    """

    def __init__(self, load: Pressure, faces: IntArray, pattern: _native.BlockPattern) -> None:
        finder = BlockFinder(pattern)
        self._load, self._faces, self._rim = load, faces, rim(faces)
        self._face_scatter, self._rim_scatter = StencilScatter(faces, finder), StencilScatter(self._rim, finder)
        self.lagged = len(self._rim) > 0

    def at(self, stage: Stage, guess: FloatArray) -> Potential:
        """The potential with the pressure at the stage's time."""
        pressure = float(at_time("pressure", self._load.pressure, stage.time, ()))
        origin = guess[self._rim if self.lagged else self._faces].mean(axis=(0, 1))
        volume = _Volume(pressure, self._faces, self._face_scatter, origin)
        return _OpenVolume(volume, pressure, self._rim, self._rim_scatter, guess) if self.lagged else volume


class _Volume:
    """p V."""

    def __init__(self, pressure: float, faces: IntArray, scatter: StencilScatter, origin: FloatArray) -> None:
        self._pressure, self._faces, self._scatter, self.origin = pressure, faces, scatter, origin

    def add_value_gradient(self, x: FloatArray, scale: float, gradient: FloatArray, /) -> float:
        corners = x[self._faces] - self.origin
        sixth = np.stack([np.cross(corners[:, (k + 1) % 3], corners[:, (k + 2) % 3]) for k in range(3)], axis=1) / 6
        self._scatter.add_vectors(scale * self._pressure * sixth, gradient)
        return scale * self._pressure * float(np.sum(corners[:, 0] * sixth[:, 0]))

    def add_hessian(self, x: FloatArray, scale: float, project: bool, matrix: _native.BlockMatrix, /) -> None:
        """Block (k, k+1) of a face is -[x_(k+2)]_x/6. Its eigenvalues come in pairs +-: projected, it is left out."""
        if project:
            return
        corners = x[self._faces] - self.origin
        blocks = np.zeros((len(corners), 3, 3, 3, 3))
        for k in range(3):
            cross = _cross_matrices(corners[:, (k + 2) % 3]) / 6
            blocks[:, k, :, (k + 1) % 3, :] = -cross
            blocks[:, (k + 1) % 3, :, k, :] = cross
        self._scatter.add_blocks(blocks.reshape(-1, 9, 9), scale * self._pressure, matrix)


class _OpenVolume:
    """p V + p C, with C = r.u + sum of u_a.(a + b) x u_b/12 over the directed rim edges (a, b), u = x - guess.

    r = (a x b)/6 at either end, a and b in the guess and seen from the origin. Its derivative there is -[b]_x/6 in the
    columns of a and [a]_x/6 in those of b, whose symmetric part are the blocks +-[a + b]_x/12. The rest of it, which is
    skew, does not depend on the origin and is as small as an edge is long: it is what the lagging has to catch up.
    """

    def __init__(
        self, volume: _Volume, pressure: float, edges: IntArray, scatter: StencilScatter, guess: FloatArray
    ) -> None:
        self._volume, self._pressure, self._edges, self._scatter = volume, pressure, edges, scatter
        self._guess = guess[edges]
        a, b = self._guess[:, 0] - volume.origin, self._guess[:, 1] - volume.origin
        self._sum = (a + b) / 12
        self._ends = np.repeat(np.cross(a, b)[:, None] / 6, 2, axis=1)

    def add_value_gradient(self, x: FloatArray, scale: float, gradient: FloatArray, /) -> float:
        energy = self._volume.add_value_gradient(x, scale, gradient)
        scale *= self._pressure
        u = x[self._edges] - self._guess
        turned = np.stack([np.cross(self._sum, u[:, 1]), -np.cross(self._sum, u[:, 0])], axis=1)
        self._scatter.add_vectors(scale * (self._ends + turned), gradient)
        return energy + scale * float(np.sum(u * (self._ends + 0.5 * turned)))

    def add_hessian(self, x: FloatArray, scale: float, project: bool, matrix: _native.BlockMatrix, /) -> None:
        """With that of V; projected, both are left out."""
        if project:
            return
        self._volume.add_hessian(x, scale, project, matrix)
        cross = _cross_matrices(self._sum)
        blocks = np.zeros((len(cross), 2, 3, 2, 3))
        blocks[:, 0, :, 1, :], blocks[:, 1, :, 0, :] = cross, -cross
        self._scatter.add_blocks(blocks.reshape(-1, 6, 6), scale * self._pressure, matrix)


def _cross_matrices(a: FloatArray) -> FloatArray:
    """[a]_x with [a]_x b = a x b, shape (k, 3, 3)."""
    matrices = np.zeros((len(a), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrices[:, i, j], matrices[:, j, i] = -a[:, k], a[:, k]
    return matrices
