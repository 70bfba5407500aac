"""Dirichlet nodes: fixed, or moved by a script. Their rows are eliminated and their positions set exactly."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray
from qlb.errors import InputError
from qlb.system.motions import Motion


@dataclass(frozen=True)
class _Group:
    nodes: IntArray
    axes: IntArray
    anchors: FloatArray
    motion: Motion | None

    def positions(self, time: float) -> FloatArray:
        if self.motion is None:
            return self.anchors
        target = np.asarray(self.motion(self.anchors, time), dtype=np.float64)
        if target.shape != self.anchors.shape or not np.isfinite(target).all():
            raise InputError(f"a motion gave positions of shape {target.shape} or not finite at time {time:g} s")
        return target


class HeldNodes:
    """Which degrees of freedom are held, and where they are at each time."""

    def __init__(self, nodes: int) -> None:
        self.fixed = np.zeros((nodes, 3), dtype=np.uint8)
        """Nonzero where a degree of freedom is held, shape (n, 3)."""
        self._groups: list[_Group] = []

    def hold(
        self, nodes: npt.ArrayLike, positions: FloatArray, motion: Motion | None = None, axes: str = "xyz"
    ) -> None:
        """Hold `nodes` at their places in `positions` (n, 3) [m], or move them from there by `motion`.

        Raises:
            InputError: no nodes, an index out of range, a node held already, an axis that is not x, y or z.
        """
        selection = np.asarray(nodes)
        if selection.size == 0:
            raise InputError("no nodes to hold: the selection is empty")
        if not np.issubdtype(selection.dtype, np.integer):
            raise InputError(f"nodes to hold have type {selection.dtype}, must be integers: node indices")
        indices = np.unique(selection)
        if indices[0] < 0 or indices[-1] >= len(self.fixed):
            bad = indices[0] if indices[0] < 0 else indices[-1]
            raise InputError(f"held node {bad} is out of range: must be in [0, {len(self.fixed) - 1}]")
        if not axes or not set(axes) <= set("xyz"):
            raise InputError(f"axes {axes!r} must be letters out of x, y, z")
        indices = indices.astype(np.int32)
        columns = np.array(sorted({"xyz".index(axis) for axis in axes}), dtype=np.int32)
        held = self.fixed[np.ix_(indices, columns)].any(axis=1)
        if held.any():
            raise InputError(f"node {indices[np.argmax(held)]} is held already; release it first")
        self.fixed[np.ix_(indices, columns)] = 1
        self._groups.append(_Group(indices, columns, positions[indices].copy(), motion))

    def place(self, positions: FloatArray, time: float) -> FloatArray:
        """`positions` (n, 3) [m] with every held degree of freedom exactly where it is at `time` [s]; a copy.

        Raises:
            InputError: a motion that gives another shape or a position that is not finite.
        """
        placed = positions.copy()
        for group in self._groups:
            placed[np.ix_(group.nodes, group.axes)] = group.positions(time)[:, group.axes]
        return placed
