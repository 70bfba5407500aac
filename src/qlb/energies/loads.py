"""Loads on nodes and surfaces, constant or in time."""

from __future__ import annotations

from collections.abc import Callable
from typing import TypeAlias

import numpy as np
import numpy.typing as npt

from qlb import _native
from qlb.arrays import FloatArray, IntArray, LongArray, vectors
from qlb.energies.energy import Energy, TermInTime, checked_nodes
from qlb.energies.potential import DeadLoad, Potential, Term
from qlb.energies.scatter import BlockFinder, StencilScatter
from qlb.errors import InputError
from qlb.integrators.integrator import Stage
from qlb.mesh.tet_mesh import TetMesh

Vector: TypeAlias = npt.ArrayLike | Callable[[float], npt.ArrayLike]
"""Three numbers, or a function of time [s] that gives them."""


class PointForce(Energy):
    """A force [N] on each of some nodes; it keeps its direction.

    Args:
        nodes: node indices.
        force: [N], shape (3,) for each node alike or (k, 3), or a function of time [s] that gives one of the two.
    """

    def __init__(self, nodes: npt.ArrayLike, force: Vector) -> None:
        self.nodes, self.force = nodes, force

    def term(self, mesh: TetMesh, pattern: _native.BlockPattern, threads: int) -> Term:
        """A dead load at the stage's time."""
        nodes = checked_nodes(self, "node", np.reshape(self.nodes, (-1, 1)), mesh).ravel()

        def load(time: float) -> DeadLoad:
            forces = np.zeros_like(mesh.positions)
            np.add.at(forces, nodes, vectors("point force", _at(self.force, time), (len(nodes), 3)))
            return DeadLoad(forces, mesh.positions, threads)

        return TermInTime(load)


class Traction(Energy):
    """A force per area at rest [Pa] on part of the surface; it keeps its direction.

    Args:
        faces: triangles of the mesh's surface, shape (k, 3), as from `TetMesh.faces_where`.
        traction: [Pa], shape (3,), or a function of time [s] that gives it.
    """

    def __init__(self, faces: npt.ArrayLike, traction: Vector) -> None:
        self.faces, self.traction = faces, traction

    def term(self, mesh: TetMesh, pattern: _native.BlockPattern, threads: int) -> Term:
        """A dead load at the stage's time: a third of each triangle's area to each of its nodes."""
        faces = outward(self, self.faces, mesh)
        area = np.linalg.norm(_area_vectors(mesh.positions[faces]), axis=1)
        share = np.bincount(faces.ravel(), weights=np.repeat(area / 3, 3), minlength=len(mesh.positions))

        def load(time: float) -> DeadLoad:
            traction = vectors("traction", _at(self.traction, time), (3,))
            return DeadLoad(np.outer(share, traction), mesh.positions, threads)

        return TermInTime(load)


class Pressure(Energy):
    """A pressure p [Pa] on part of the surface: a force -p n per deformed area, n the outward normal of the body.

    The faces of a cavity have normals that point into it, so a pressure inside a closed cavity inflates it.

    Args:
        faces: triangles of the mesh's surface, shape (k, 3), as from `TetMesh.faces_where`.
        pressure: [Pa], or a function of time [s] that gives it.
    """

    def __init__(self, faces: npt.ArrayLike, pressure: float | Callable[[float], float]) -> None:
        self.faces, self.pressure = faces, pressure

    def term(self, mesh: TetMesh, pattern: _native.BlockPattern, threads: int) -> Term:
        """p V with its lagged correction along the rim."""
        return _PressureTerm(self, outward(self, self.faces, mesh), mesh, pattern)


class _PressureTerm:
    """Phi = p V(x) + p r.x: V = sum of (x0 - o).(x1 - o) x (x2 - o)/6 over the faces, r a correction along their rim.

    On a closed set of faces dV/dx is a third of each area vector to each node, which is the follower load. On an open
    one the cones over its rim add (a - o) x (b - o)/6 to either end of each directed edge (a, b) of the rim; r takes
    that away with the positions of the guess. It has no potential: a pressure on an open set is not conservative.
    """

    def __init__(self, load: Pressure, faces: IntArray, mesh: TetMesh, pattern: _native.BlockPattern) -> None:
        self._load, self._faces, self._rest = load, faces, mesh.positions
        self._scatter = StencilScatter(faces, BlockFinder(pattern))
        self._rim = _rim(faces)
        self.lagged = len(self._rim) > 0

    def at(self, stage: Stage, guess: FloatArray) -> Potential:
        """The potential with the pressure at the stage's time."""
        pressure = float(vectors("pressure", np.atleast_1d(np.asarray(_at(self._load.pressure, stage.time))), (1,))[0])
        origin = guess[self._rim if self.lagged else self._faces].mean(axis=(0, 1))
        correction = np.zeros_like(guess)
        a, b = guess[self._rim[:, 0]] - origin, guess[self._rim[:, 1]] - origin
        for end in self._rim.T:
            np.add.at(correction, end, np.cross(a, b) / 6)
        return _EnclosedVolume(pressure, self._faces, self._scatter, origin, correction, self._rest)


class _EnclosedVolume:
    def __init__(
        self,
        pressure: float,
        faces: IntArray,
        scatter: StencilScatter,
        origin: FloatArray,
        correction: FloatArray,
        rest: FloatArray,
    ) -> None:
        self._pressure, self._faces, self._scatter = pressure, faces, scatter
        self._origin, self._correction, self._rest = origin, correction, rest

    def add_value_gradient(self, x: FloatArray, scale: float, gradient: FloatArray, /) -> float:
        corners = x[self._faces] - self._origin
        sixth = np.stack([np.cross(corners[:, (k + 1) % 3], corners[:, (k + 2) % 3]) for k in range(3)], axis=1) / 6
        volume = float(np.sum(corners[:, 0] * sixth[:, 0]))
        scale *= self._pressure
        self._scatter.add_vectors(scale * sixth, gradient)
        gradient += scale * self._correction
        return scale * (volume + float(np.sum(self._correction * (x - self._rest))))

    def add_hessian(self, x: FloatArray, scale: float, project: bool, matrix: _native.BlockMatrix, /) -> None:
        """Block (k, k+1) of a face is -[x_(k+2)]_x/6. Its eigenvalues come in pairs +-: projected, it is left out."""
        if project:
            return
        corners = x[self._faces] - self._origin
        blocks = np.zeros((len(corners), 3, 3, 3, 3))
        for k in range(3):
            cross = _cross_matrices(corners[:, (k + 2) % 3]) / 6
            blocks[:, k, :, (k + 1) % 3, :] = -cross
            blocks[:, (k + 1) % 3, :, k, :] = cross
        self._scatter.add_blocks(blocks.reshape(-1, 9, 9), scale * self._pressure, matrix)


def outward(energy: Energy, faces: npt.ArrayLike, mesh: TetMesh) -> IntArray:
    """`faces` (k, 3) as outward triangles of the surface of `mesh`.

    Raises:
        InputError: no faces, another shape, one that is not on the surface, one given twice.
    """
    given = checked_nodes(energy, "face", faces, mesh)
    if given.shape[1] != 3 or len(given) == 0:
        raise InputError(f"faces of {type(energy).__name__} have shape {given.shape}, must be (k, 3) with k >= 1")
    surface = mesh.boundary_triangles()
    keys, wanted = _keys(surface, len(mesh.positions)), _keys(given, len(mesh.positions))
    order = np.argsort(keys)
    found = order[np.minimum(np.searchsorted(keys[order], wanted), len(keys) - 1)]
    outside = keys[found] != wanted
    if outside.any():
        k = int(np.argmax(outside))
        raise InputError(f"face {k} of {type(energy).__name__}, {given[k].tolist()}, is not on the mesh's surface")
    _, first, count = np.unique(wanted, return_index=True, return_counts=True)
    if (count > 1).any():
        k = int(first[np.argmax(count > 1)])
        raise InputError(f"face {k} of {type(energy).__name__}, {given[k].tolist()}, is given more than once")
    return surface[found]


def _keys(faces: IntArray, nodes: int) -> LongArray:
    """A number for each triangle, whatever the order of its nodes."""
    low, middle, high = np.sort(faces, axis=1).astype(np.int64).T
    return np.asarray((low * nodes + middle) * nodes + high)


def _rim(faces: IntArray) -> IntArray:
    """Directed edges (r, 2) of the faces whose reverse belongs to none of them."""
    edges = np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]])
    n = int(edges.max()) + 1
    forth, back = edges[:, 0].astype(np.int64) * n + edges[:, 1], edges[:, 1].astype(np.int64) * n + edges[:, 0]
    return edges[~np.isin(forth, back)]


def _area_vectors(corners: FloatArray) -> FloatArray:
    """Normals of triangles (k, 3, 3), as long as their areas."""
    return np.asarray(0.5 * np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]))


def _cross_matrices(a: FloatArray) -> FloatArray:
    """[a]_x with [a]_x b = a x b, shape (k, 3, 3)."""
    matrices = np.zeros((len(a), 3, 3))
    for i, j, k in ((0, 1, 2), (1, 2, 0), (2, 0, 1)):
        matrices[:, i, j], matrices[:, j, i] = -a[:, k], a[:, k]
    return matrices


def _at(value: npt.ArrayLike | Callable[[float], npt.ArrayLike], time: float) -> npt.ArrayLike:
    return value(time) if callable(value) else value
