"""Tetrahedral meshes of solids, by number of tets or by edge length."""

from __future__ import annotations

import numpy as np

from qlb.arrays import FloatArray, IntArray
from qlb.errors import InputError
from qlb.mesh import TetMesh
from qlb.shapes.solid import Solid
from qlb.shapes.stuffing import stuff
from qlb.shapes.topology import is_closed_surface, pieces

FEWEST, MOST = 100, 2_000_000
CLOSE = 0.03
"""A count of tets is met when it is missed by less than this fraction."""
TRIES, CENTRED_TRIES = 16, 6
SHIFT = (0.13, 0.21, 0.34)
"""Of the lattice, in spacings, where no symmetric mesh has the right number of tets."""
LATTICE = 2e7
"""The most tets that a lattice over the bounds of a solid may have."""


def mesh_solid(solid: Solid, *, tets: int | None = None, edge: float | None = None, name: str = "solid") -> TetMesh:
    """Fill a solid with well-shaped tetrahedra whose boundary nodes lie on its surface.

    Args:
        solid: what to fill; one piece.
        tets: about how many tets to make, 100 to 2 million; or
        edge: spacing of the lattice [m], which is the length of the longest inner edges; the mean is about 0.9 of it.
        name: what errors call the solid.

    Raises:
        InputError: both or neither of `tets` and `edge`, a value out of range, or a mesh so coarse that the solid falls
            into pieces or its surface touches itself.
    """
    if (tets is None) == (edge is None):
        raise InputError(f"{name}: give either tets or edge, not both" if edge else f"{name}: give tets or edge")
    if not (np.isfinite(solid.low).all() and np.isfinite(solid.high).all() and (solid.low < solid.high).all()):
        raise InputError(f"{name} has the bounds {solid.low} to {solid.high}, must be a box of finite size")
    if edge is not None:
        size = float((solid.high - solid.low).max())
        if not (np.isfinite(edge) and size / 1000 <= edge <= size):
            raise InputError(f"{name}: edge {edge} is out of range: {size / 1000:.3g} to {size:.3g} m")
        name = f"{name} with edge {edge:g} m"
        mesh, refusal = _checked(*_stuffed(solid, edge, LATTICE, name))
        if mesh is None:
            raise InputError(f"{name} {refusal}")
        return mesh
    wanted = whole_number(f"{name}: tets", tets, FEWEST, MOST)
    return _with_tets(solid, wanted, f"{name} of {tets} tets")


def whole_number(name: str, value: object, low: int, high: int) -> int:
    """`value` as an int, which must be a whole number from `low` to `high`."""
    whole = isinstance(value, int | np.integer) and not isinstance(value, bool)
    if not whole or not low <= value <= high:  # type: ignore[operator]
        raise InputError(f"{name} {value!r} is out of range: a whole number, {low} to {high}")
    return int(value)  # type: ignore[call-overload, no-any-return]


def _with_tets(solid: Solid, wanted: int, name: str) -> TetMesh:
    """A sound mesh whose number of tets is close to `wanted`; else, the closest one that was found in a few tries.

    The number goes with 1/spacing^3, up to the share of the boundary, but for a symmetric solid on a symmetric lattice
    by jumps; so later tries shift the lattice. Where a lattice happens to pinch the surface, a slightly finer one does
    not.
    """
    spacing = float(np.prod(solid.high - solid.low) * 6 / wanted) ** (1 / 3)
    found: list[tuple[int, FloatArray, IntArray]] = []
    for attempt in range(TRIES):
        # Down to a twentieth of the bounds may be solid.
        most = min(LATTICE, 2e5 + 20 * wanted)
        positions, tets = _stuffed(solid, spacing, most, name, shifted=attempt >= CENTRED_TRIES)
        miss = abs(len(tets) - wanted)
        if miss > CLOSE * wanted:
            found.append((miss, positions, tets))
            spacing *= float(np.clip((len(tets) + 1) / (wanted + 1), 0.3, 10.0)) ** (1 / 3)
            continue
        mesh, refusal = _checked(positions, tets)
        if mesh is not None:
            return mesh
        spacing *= 0.99
    for _, positions, tets in sorted(found, key=lambda made: made[0]):
        mesh, refusal = _checked(positions, tets)
        if mesh is not None:
            return mesh
    raise InputError(f"{name} {refusal}")


def _stuffed(
    solid: Solid, spacing: float, most: float, name: str, *, shifted: bool = False
) -> tuple[FloatArray, IntArray]:
    if 12 * np.prod((solid.high - solid.low) / spacing) > most:
        raise InputError(f"{name}: it is too thin for so few tets" if most < LATTICE else f"{name} is too fine")
    return stuff(solid, spacing, shift=SHIFT if shifted else (0.0, 0.0, 0.0))


def _checked(positions: FloatArray, tets: IntArray) -> tuple[TetMesh | None, str]:
    """A mesh of these tets if they are one body with a closed surface; else None and what they are."""
    if len(tets) == 0:
        return None, "is too coarse: no lattice point falls into the solid"
    mesh = TetMesh(positions, tets)
    count = pieces(mesh)
    if count > 1:
        return None, f"falls into {count} pieces: the solid must be one piece, and thicker than its edges"
    if not is_closed_surface(mesh):
        return None, "is too coarse: its surface touches itself; ask for more tets or a shorter edge"
    return mesh, ""
