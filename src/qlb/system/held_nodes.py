"""Dirichlet nodes: fixed, or moved by a script. Their rows are eliminated and their positions set exactly."""

from __future__ import annotations

from dataclasses import dataclass
from math import inf

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
    until: float
    """[s]"""

    @property
    def place(self) -> tuple[IntArray, ...]:
        """Where its degrees of freedom are in an array of shape (n, 3)."""
        return np.ix_(self.nodes, self.axes)

    def positions(self, time: float) -> FloatArray:
        if self.motion is None:
            return self.anchors
        target = np.asarray(self.motion(self.anchors, time), dtype=np.float64)
        if target.shape != self.anchors.shape or not np.isfinite(target).all():
            raise InputError(f"a motion gave positions of shape {target.shape} or not finite at time {time:g} s")
        return target

    def velocities(self, begin: float, end: float) -> FloatArray:
        """At `end` [m/s], shape (k, 3), exact to second order from three positions since `begin` [s]."""
        if self.motion is None:
            return np.zeros_like(self.anchors)
        first, middle, last = (self.positions(time) for time in (begin, 0.5 * (begin + end), end))
        return (first - 4 * middle + 3 * last) / (end - begin)


class HeldNodes:
    """Which degrees of freedom are held, where they are at each time, and until when."""

    def __init__(self, nodes: int) -> None:
        self.fixed = np.zeros((nodes, 3), dtype=np.uint8)
        """Nonzero where a degree of freedom is held, shape (n, 3)."""
        self._groups: list[_Group] = []

    def hold(
        self,
        nodes: npt.ArrayLike,
        positions: FloatArray,
        motion: Motion | None = None,
        axes: str = "xyz",
        until: float | None = None,
    ) -> None:
        """Hold `nodes` at their places in `positions` (n, 3) [m], or move them from there by `motion`.

        From time `until` [s] on they are held no longer; for ever where that is None.

        Raises:
            InputError: no nodes, an index out of range, a node held already, an axis that is not x, y or z, `until`
                not above 0.
        """
        if until is not None and not _is_time(until):
            raise InputError(f"until = {until!r} is out of range: must be > 0 s, or None")
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
        self._groups.append(_Group(indices, columns, positions[indices].copy(), motion, until or inf))

    def at(self, time: float) -> HeldNodes:
        """What is still held at `time` [s]: this itself where that is everything."""
        left = [group for group in self._groups if group.until > time]
        if len(left) == len(self._groups):
            return self
        held = HeldNodes(len(self.fixed))
        held._groups = left
        for group in left:
            held.fixed[group.place] = 1
        return held

    def velocities_at(self, velocities: FloatArray, begin: float, end: float) -> FloatArray:
        """`velocities` (n, 3) [m/s] at `end` [s], with those that come from scripts as exact as the scripts.

        What an integrator makes of the positions of a scripted node is exact to first order only, but for BDF2.

        Args:
            velocities: of all nodes, as the integrator gave them.
            begin: when the step began [s].
            end: when it ended [s].
        """
        exact = velocities.copy()
        for group in self._groups:
            exact[group.place] = group.velocities(begin, end)[:, group.axes]
        return exact

    def place(self, positions: FloatArray, time: float) -> FloatArray:
        """`positions` (n, 3) [m] with every held degree of freedom exactly where it is at `time` [s]; a copy.

        Raises:
            InputError: a motion that gives another shape or a position that is not finite.
        """
        placed = positions.copy()
        for group in self._groups:
            placed[group.place] = group.positions(time)[:, group.axes]
        return placed


def _is_time(value: object) -> bool:
    return isinstance(value, int | float | np.number) and not isinstance(value, bool) and 0 < float(value) < inf
