"""Tetrahedral meshes of solids, by number of tets or by edge length."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np

from qlb.arrays import FloatArray, IntArray, whole_number
from qlb.errors import InputError
from qlb.mesh import TetMesh
from qlb.mesh.geometry import tet_components
from qlb.shapes.smoothing import smooth
from qlb.shapes.solid import Solid
from qlb.shapes.stuffing import stuff
from qlb.shapes.topology import characteristic, is_closed_surface

FEWEST, MOST = 100, 2_000_000
CLOSE, ALLOWED = 0.03, 0.2
"""The search ends at a count of tets that is missed by less than the first fraction, and never gives one that is missed
by more than the second."""
TRIES, CENTRED_TRIES = 16, 6
SHIFT = (0.13, 0.21, 0.34)
"""Of the lattice, in spacings, where no symmetric mesh has the right number of tets."""
SMALLEST, LARGEST = 1e-12, 1e12
"""Lengths of a solid [m]."""
LATTICE = 2e7
"""The most tets that a lattice over the bounds of a solid may have."""


def mesh_solid(
    solid: Solid,
    *,
    tets: int | None = None,
    edge: float | None = None,
    smoothing: bool = True,
    euler: int | None = None,
    name: str = "solid",
) -> TetMesh:
    """Fill a solid with well-shaped tetrahedra whose boundary nodes lie on its surface.

    Args:
        solid: what to fill; one piece.
        tets: about how many tets to make, 100 to 2 million; or
        edge: spacing of the lattice [m], which is the length of the longest inner edges; the mean is about 0.9 of it.
        smoothing: whether to even out the tets of the lattice afterwards.
        euler: the Euler characteristic that the boundary must have, if given: 2 for a body without handles.
        name: what errors call the solid.

    Raises:
        InputError: both or neither of `tets` and `edge`, a value out of range, or a mesh so coarse that the solid falls
            into pieces, its surface touches itself or has the wrong characteristic.
    """
    if (tets is None) == (edge is None):
        raise InputError(f"{name}: give either tets or edge, not both" if edge else f"{name}: give tets or edge")
    if not (np.isfinite(solid.low).all() and np.isfinite(solid.high).all() and (solid.low < solid.high).all()):
        raise InputError(f"{name} has the bounds {solid.low} to {solid.high}, must be a box of finite size")
    extent = solid.high - solid.low
    if not (extent.min() >= SMALLEST and extent.max() <= LARGEST):
        lengths = " x ".join(f"{length:.3g}" for length in extent)
        raise InputError(f"{name} is {lengths} m large, must be {SMALLEST:g} to {LARGEST:g} m along each axis")
    if edge is not None:
        size = float(extent.max())
        if not (np.isfinite(edge) and size / 1000 <= edge <= size):
            raise InputError(f"{name}: edge {edge} is out of range: {size / 1000:.3g} to {size:.3g} m")
        mesh = _Filling(solid, f"{name} with edge {edge:g} m", euler, LATTICE).by_edge(edge)
    else:
        wanted = whole_number(f"{name}: tets", tets, FEWEST, MOST)
        # Down to a twentieth of the bounds may be solid.
        mesh = _Filling(solid, f"{name} of {tets} tets", euler, min(LATTICE, 2e5 + 20 * wanted)).by_number(wanted)
    return smooth(mesh, solid) if smoothing else mesh


@dataclass
class _Filling:
    """One solid, to be filled by lattices of several spacings.

    Attributes:
        solid: what to fill.
        name: what errors call it.
        euler: the characteristic that the boundary must have, or None for any.
        most: tets that a lattice over its bounds may have at most.
        refusal: why the last mesh was refused.
    """

    solid: Solid
    name: str
    euler: int | None
    most: float
    refusal: str = "has no mesh with about so many"

    def by_edge(self, edge: float) -> TetMesh:
        mesh = self._checked(*self._stuffed(edge))
        if mesh is None:
            raise InputError(f"{self.name} {self.refusal}")
        return mesh

    def by_number(self, wanted: int) -> TetMesh:
        """A sound mesh whose number of tets is close to `wanted`; else, the closest that was found in a few tries.

        The number goes with 1/spacing^3, up to the share of the boundary, but for a symmetric solid on a symmetric
        lattice by jumps; so later tries shift the lattice. Where a lattice happens to pinch the surface, a slightly
        finer one does not.
        """
        spacing = float(np.prod(self.solid.high - self.solid.low) * 6 / wanted) ** (1 / 3)
        found: list[tuple[int, FloatArray, IntArray]] = []
        for attempt in range(TRIES):
            positions, tets = self._stuffed(spacing, SHIFT if attempt >= CENTRED_TRIES else (0.0, 0.0, 0.0))
            miss = abs(len(tets) - wanted)
            if miss <= CLOSE * wanted:
                mesh = self._checked(positions, tets)
                if mesh is not None:
                    return mesh
                spacing *= 0.99
                continue
            if miss <= ALLOWED * wanted:
                found.append((miss, positions, tets))
            spacing *= float(np.clip((len(tets) + 1) / (wanted + 1), 0.3, 10.0)) ** (1 / 3)
        for _, positions, tets in sorted(found, key=lambda made: made[0]):
            mesh = self._checked(positions, tets)
            if mesh is not None:
                return mesh
        raise InputError(f"{self.name} {self.refusal}")

    def _stuffed(
        self, spacing: float, shift: tuple[float, float, float] = (0.0, 0.0, 0.0)
    ) -> tuple[FloatArray, IntArray]:
        # At least one cube lies along each axis, also of a solid that is thinner than that.
        if 12 * np.prod(np.ceil((self.solid.high - self.solid.low) / spacing)) > self.most:
            raise InputError(f"{self.name}: its bounds would hold more than {self.most:.2g} tets, too much to fill")
        return stuff(self.solid, spacing, shift=shift)

    def _checked(self, positions: FloatArray, tets: IntArray) -> TetMesh | None:
        """A mesh of these tets if they are one body with the right surface; else None, and why is kept."""
        if len(tets) == 0:
            self.refusal = "is too coarse: no lattice point falls into the solid"
            return None
        mesh = TetMesh(positions, tets)
        count = tet_components(mesh.tets)
        if count > 1:
            self.refusal = f"falls into {count} pieces: the solid must be one piece, and thicker than its edges"
        elif not is_closed_surface(mesh):
            self.refusal = "is too coarse: its surface touches itself; ask for more tets or a shorter edge"
        elif self.euler not in (None, found := characteristic(mesh)):
            self.refusal = f"is too coarse: its surface has Euler characteristic {found}, not {self.euler}"
        else:
            return mesh
        return None
