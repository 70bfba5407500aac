"""Energies that a user adds to a simulation: whatever can be written down in NumPy."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Callable
from typing import Any

import numpy as np
import numpy.typing as npt

from qlb import _native
from qlb.arrays import FloatArray, IntArray
from qlb.energies.potential import Potential, Term
from qlb.energies.scatter import BlockFinder, StencilScatter, positive_semidefinite
from qlb.errors import InputError
from qlb.integrators.integrator import Stage
from qlb.mesh.tet_mesh import TetMesh


class Energy(ABC):
    """What `Simulation.add` takes: loads, and energies of the user's own."""

    def node_sets(self, mesh: TetMesh) -> IntArray:
        """Sets of nodes (k, w) that its Hessian couples, in addition to those of one tet; none by default.

        Raises:
            InputError: something that does not fit `mesh`.
        """
        return np.empty((0, 2), dtype=np.int32)

    @abstractmethod
    def term(self, mesh: TetMesh, pattern: _native.BlockPattern, threads: int) -> Term:
        """Its part in a system over `mesh`. Raises `InputError` as `node_sets` does."""


class StencilEnergy(Energy):
    """A sum over small sets of nodes, such as springs or hinges: Phi(x) = sum_s phi(x of stencil s, time).

    A subclass sets `stencils` and writes the three functions below, each for all stencils at once. Its Hessians are
    projected to positive semidefinite, stencil by stencil, where a solver asks for it. Where phi is not defined, it is
    NaN or infinite: a line search goes no further than that.
    """

    stencils: npt.ArrayLike
    """Nodes of each stencil, shape (k, w)."""

    @abstractmethod
    def value(self, x: FloatArray, time: float) -> npt.ArrayLike:
        """phi [J] of each stencil, shape (k,), at positions `x` (k, w, 3) [m] and `time` [s]."""

    @abstractmethod
    def gradient(self, x: FloatArray, time: float) -> npt.ArrayLike:
        """d phi/dx [N], shape (k, w, 3)."""

    @abstractmethod
    def hessian(self, x: FloatArray, time: float) -> npt.ArrayLike:
        """d2 phi/dx2 [N/m], shape (k, 3 w, 3 w) or (k, w, 3, w, 3); symmetric."""

    def node_sets(self, mesh: TetMesh) -> IntArray:
        """The stencils."""
        return checked_nodes(self, "stencil", getattr(self, "stencils", None), mesh)

    def term(self, mesh: TetMesh, pattern: _native.BlockPattern, threads: int) -> Term:
        """The sum over the stencils."""
        nodes = self.node_sets(mesh)
        scatter = StencilScatter(nodes, BlockFinder(pattern))
        return TermInTime(lambda time: _StencilSum(self, nodes, scatter, time))


class NodalEnergy(Energy):
    """Any energy Phi(x, time) of all nodes, with a sparse Hessian.

    A subclass writes the three functions below; where its Hessian couples nodes that no tet has in common, it lists
    them in `couplings`. The pattern of the Hessian is fixed for the whole run. Where Phi is not defined, it is NaN or
    infinite: a line search goes no further than that.
    """

    couplings: npt.ArrayLike = np.empty((0, 2), dtype=np.int32)
    """Sets of nodes that are coupled with each other, shape (k, w)."""

    @abstractmethod
    def value(self, x: FloatArray, time: float) -> float:
        """Phi [J] at positions `x` (n, 3) [m] and `time` [s]."""

    @abstractmethod
    def gradient(self, x: FloatArray, time: float) -> npt.ArrayLike:
        """dPhi/dx [N], shape (n, 3)."""

    @abstractmethod
    def hessian(self, x: FloatArray, time: float, project: bool) -> Any:
        """d2Phi/dx2 [N/m], a SciPy sparse matrix of shape (3 n, 3 n), degrees of freedom node by node; symmetric.

        With `project` it should be positive semidefinite: leave out or change what is not.
        """

    def node_sets(self, mesh: TetMesh) -> IntArray:
        """The couplings."""
        return (
            checked_nodes(self, "coupling", self.couplings, mesh)
            if np.size(self.couplings)
            else super().node_sets(mesh)
        )

    def term(self, mesh: TetMesh, pattern: _native.BlockPattern, threads: int) -> Term:
        """The energy at the stage's time."""
        finder = BlockFinder(pattern)
        return TermInTime(lambda time: _NodalSum(self, finder, time))


class TermInTime:
    """A term whose potential depends on the time of the stage alone."""

    lagged = False

    def __init__(self, potential: Callable[[float], Potential]) -> None:
        self._potential = potential

    def at(self, stage: Stage, guess: FloatArray) -> Potential:
        """The potential at the stage's time."""
        return self._potential(stage.time)


class _StencilSum:
    def __init__(self, energy: StencilEnergy, nodes: IntArray, scatter: StencilScatter, time: float) -> None:
        self._energy, self._nodes, self._scatter, self._time = energy, nodes, scatter, time

    def add_value_gradient(self, x: FloatArray, scale: float, gradient: FloatArray, /) -> float:
        stencils, (k, w) = x[self._nodes], self._nodes.shape
        value = shaped(self._energy, "value", self._energy.value(stencils, self._time), (k,))
        forces = shaped(self._energy, "gradient", self._energy.gradient(stencils, self._time), (k, w, 3))
        self._scatter.add_vectors(scale * forces, gradient)
        return scale * float(value.sum())

    def add_hessian(self, x: FloatArray, scale: float, project: bool, matrix: _native.BlockMatrix, /) -> None:
        k, w = self._nodes.shape
        given = self._energy.hessian(x[self._nodes], self._time)
        blocks = shaped(self._energy, "hessian", given, (k, 3 * w, 3 * w), (k, w, 3, w, 3)).reshape(k, 3 * w, 3 * w)
        _require_symmetric(self._energy, blocks, blocks.transpose(0, 2, 1))
        self._scatter.add_blocks(positive_semidefinite(blocks) if project else blocks, scale, matrix)


class _NodalSum:
    def __init__(self, energy: NodalEnergy, finder: BlockFinder, time: float) -> None:
        self._energy, self._finder, self._time = energy, finder, time

    def add_value_gradient(self, x: FloatArray, scale: float, gradient: FloatArray, /) -> float:
        value = shaped(self._energy, "value", self._energy.value(x, self._time), ())
        forces = shaped(self._energy, "gradient", self._energy.gradient(x, self._time), x.shape)
        with np.errstate(invalid="ignore"):
            gradient += scale * forces
        return scale * float(value)

    def add_hessian(self, x: FloatArray, scale: float, project: bool, matrix: _native.BlockMatrix, /) -> None:
        given = self._energy.hessian(x, self._time, project)
        if not hasattr(given, "tobsr") or given.shape != (x.size, x.size) or given.dtype.kind not in _REAL:
            what = f"{type(given).__name__} of shape {np.shape(given)} and type {getattr(given, 'dtype', None)}"
            allowed = f"a SciPy sparse matrix of shape ({x.size}, {x.size})"
            raise InputError(f"hessian of {_name(self._energy)} gives {what}, must be {allowed} of real numbers")
        entries = given.tocsr().astype(np.float64)  # a copy
        _require_symmetric(self._energy, entries, entries.T)
        blocks = entries.tobsr(blocksize=(3, 3))
        rows = np.repeat(np.arange(len(x)), np.diff(blocks.indptr))
        kept = (rows >= blocks.indices) & blocks.data.any(axis=(1, 2))
        try:
            found = self._finder.find(rows[kept], blocks.indices[kept])
        except InputError as error:
            raise InputError(f"hessian of {_name(self._energy)}: {error}") from None
        matrix.values[found] += scale * blocks.data[kept]


def checked_nodes(energy: Energy, what: str, given: npt.ArrayLike | None, mesh: TetMesh) -> IntArray:
    """`given` as node indices (k, w) of `mesh`. Raises `InputError` where they are not."""
    nodes = _as_array(given)
    if nodes.ndim != 2 or not np.issubdtype(nodes.dtype, np.integer):
        raise InputError(
            f"{what}s of {_name(energy)} have shape {nodes.shape} and type {nodes.dtype}, must be integers (k, w)"
        )
    outside = (nodes < 0) | (nodes >= len(mesh.positions))
    if outside.any():
        s, a = np.argwhere(outside)[0]
        last = len(mesh.positions) - 1
        raise InputError(f"{what} {s} of {_name(energy)} names node {nodes[s, a]}, must be in [0, {last}]")
    return np.ascontiguousarray(nodes, dtype=np.int32)


def shaped(energy: Energy, what: str, given: npt.ArrayLike, *shapes: tuple[int, ...]) -> FloatArray:
    """`given` as an array of one of `shapes`. Raises `InputError` where it is not."""
    array = _as_array(given)
    if array.dtype.kind not in _REAL:
        raise InputError(f"{what} of {_name(energy)} gives {type(given).__name__}, must be real numbers")
    if array.shape not in shapes:
        allowed = " or ".join("one number" if shape == () else str(shape) for shape in shapes)
        raise InputError(f"{what} of {_name(energy)} gives shape {array.shape}, must be {allowed}")
    return array.astype(np.float64, copy=False)


_REAL = "fiu"


def _as_array(given: npt.ArrayLike | None) -> npt.NDArray[Any]:
    """`given` as an array, of objects where it is no array of numbers."""
    try:
        return np.asarray(given)
    except ValueError:  # rows of different lengths
        return np.asarray(None)


@np.errstate(invalid="ignore")
def _require_symmetric(energy: Energy, given: Any, mirrored: Any) -> None:
    """Raise `InputError` where |H - H^T| is more than what float32 leaves of |H|. NaN is left to the solver."""
    off = abs(given - mirrored).max() if given.shape[0] else 0.0
    if off > 1e-5 * (abs(given).max() if off else 0.0):
        raise InputError(f"hessian of {_name(energy)} is not symmetric: entries differ by {off:.3g} from their mirror")


def _name(energy: Energy) -> str:
    return type(energy).__name__
