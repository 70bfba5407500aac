"""Fewer frames and vertices, where all of them would make a page too large."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np

from qlb.arrays import FloatArray, IntArray


def spread(items: Sequence[int], count: int) -> list[int]:
    """At most `count` >= 2 of the items, evenly spread, with the first and the last."""
    if len(items) <= count:
        return list(items)
    return [items[int(i)] for i in np.linspace(0, len(items) - 1, count).round()]


def merge_vertices(positions: FloatArray, triangles: IntArray, most: int) -> tuple[IntArray, IntArray]:
    """Vertices that stand for all in the same cell of a grid, fine enough that about `most` are left.

    Args:
        positions: of the vertices [m], shape (v, 3).
        triangles: shape (t, 3).
        most: above this many vertices they are merged; the result has no more.

    Returns:
        the vertices that are kept (k,), and the triangles that are left, of indices into them.
    """
    low = positions.min(axis=0)
    extent = float(np.ptp(positions, axis=0).max()) or 1.0
    kept = np.arange(len(positions))
    member = kept
    cells = max(1.0, np.sqrt(most / 2.0)) * 2.0
    while len(kept) > most and cells >= 2.0:
        cell = np.floor((positions - low) * (cells / extent)).astype(np.int64)
        _, kept, member = np.unique(cell, axis=0, return_index=True, return_inverse=True)
        cells *= 0.9
    merged = member.reshape(-1)[triangles]
    a, b, c = merged.T
    return kept.astype(np.int32), merged[(a != b) & (b != c) & (c != a)].astype(np.int32)
