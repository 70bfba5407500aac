"""The tetrahedral mesh that every simulation starts from."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from copy import copy
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
import numpy.typing as npt

from qlb.arrays import BoolArray, FloatArray, IntArray, LongArray
from qlb.errors import InputError
from qlb.mesh.box import kuhn_box
from qlb.mesh.embedded_surface import EmbeddedSurface
from qlb.mesh.files import read_tets
from qlb.mesh.geometry import signed_volumes

if TYPE_CHECKING:
    from qlb.mesh.filling import MeshReport

# A tet counts as flat when its volume is below this fraction of its longest edge cubed (a regular one has 0.118).
FLAT = 1e-10

FARTHEST = 1e60
"""Of a node from the origin [m]: powers of lengths further away are no numbers any more."""


class TetMesh:
    """Linear tetrahedra at rest, checked when made.

    Attributes:
        positions: rest positions [m], shape (n, 3), float64.
        tets: node indices, shape (m, 4), int32, positively oriented: det(x1 - x0, x2 - x0, x3 - x0) > 0.
        regions: id of the region of each tet, shape (m,), int64, for parameters that differ from region to region; or
            None.
        surface: what pictures and exports show of it, or None for its boundary (`rendered`).
        report: how it was made, if `from_surface` did.

    Raises:
        InputError: a NaN position, an index out of range, a tet that names a node twice, is flat or inverted, a node
            that no tet uses. The message names the first such tet or node. Regions that are not (m,) integers.
    """

    def __init__(self, positions: npt.ArrayLike, tets: npt.ArrayLike, *, regions: npt.ArrayLike | None = None) -> None:
        x, t = _array("positions", positions, np.float64), _array("tets", tets)
        if x.ndim != 2 or x.shape[1] != 3:
            raise InputError(f"positions have shape {x.shape}, must be (n, 3)")
        if t.ndim != 2 or t.shape[1] != 4 or len(t) == 0:
            raise InputError(f"tets have shape {t.shape}, must be (m, 4) with m >= 1")
        if not np.issubdtype(t.dtype, np.integer):
            raise InputError(f"tets have type {t.dtype}, must be integers")
        _check_indices(t, len(x))
        self.positions: FloatArray = x
        self.tets: IntArray = t.astype(np.int32, order="C")
        self.regions: LongArray | None = None if regions is None else _regions(regions, len(t))
        self.surface: EmbeddedSurface | None = None
        self.report: MeshReport | None = None
        _check_geometry(self)
        self.positions.setflags(write=False)
        self.tets.setflags(write=False)

    @staticmethod
    def box(
        size: tuple[float, float, float] = (1.0, 0.25, 0.25), *, cells: tuple[int, int, int] = (20, 5, 5)
    ) -> TetMesh:
        """A box from the origin to `size` [m], cut in cells of 6 Kuhn tets, mirrored from cell to cell."""
        return TetMesh(*kuhn_box(size, cells))

    @staticmethod
    def read(path: str | Path) -> TetMesh:
        """Read the tetrahedra of a mesh file in any format that meshio knows (gmsh, VTK, Medit, ...).

        Nodes that no tetrahedron uses are dropped. Regions are the first of the whole-numbered cell data "region",
        "gmsh:physical" and "medit:ref" that the file has.

        Raises:
            InputError: the file is missing, unreadable, has no tetrahedra, or fails the checks of `TetMesh`.
        """
        positions, tets, regions = read_tets(Path(path))
        return TetMesh(positions, tets, regions=regions)

    @staticmethod
    def from_surface(
        source: str | Path | tuple[npt.ArrayLike, npt.ArrayLike],
        *,
        edge: float | None = None,
        tets: int | None = None,
        surface: bool = True,
    ) -> TetMesh:
        """Fill a surface with tetrahedra by fTetWild (extra `mesh`), and let the surface follow them.

        Where the surface has holes, crosses itself, is doubled or inside out, the solid is what most of it winds
        around. What was wrong is in `report`, and goes to the logger `qlb` as a warning each. Meshes are kept on disk
        (docs/meshes.md), so that the same surface is filled only once.

        Args:
            source: a file that `qlb.mesh.read_surface` reads, or vertices (q, 3) [m] and triangles (t, 3).
            edge: target length of the edges [m], or
            tets: about how many tets to make, 5000 by default. Both may be missed where the surface needs smaller
                tets: by at most a twentieth of an edge the boundary of the tets is off the surface.
            surface: whether to keep the given surface as what pictures show; without it, that is the tets' boundary.

        Y. Hu, T. Schneider, B. Wang, D. Zorin, D. Panozzo (2020), "Fast tetrahedral meshing in the wild", ACM Trans.
        Graph. 39(4).

        Raises:
            InputError: the surface cannot be read, is flat or encloses nothing, or an argument is out of range.
            MissingExtra: pytetwild is not installed.
        """
        from qlb.mesh.filling import fill, given_surface

        return fill(*given_surface(source), edge=edge, tets=tets, surface=surface)

    @staticmethod
    def load(path: str | Path, *, edge: float | None = None, tets: int | None = None) -> TetMesh:
        """The mesh of a file of tetrahedra (`read`), or of a surface that is filled with them (`from_surface`).

        A file that holds both gives its tetrahedra. `edge` and `tets` matter for surfaces only.

        Raises:
            InputError: see `read` and `from_surface`.
        """
        from qlb.mesh.filling import load

        return load(Path(path), edge=edge, tets=tets)

    def write(self, path: str | Path) -> None:
        """Write nodes and tets, in the format that the suffix of `path` asks for (.msh, .vtu, .vtk, .mesh, ...).

        Regions are kept by .msh, .vtu, .vtk, .mesh, .xdmf and .med files. A surface is not written.

        Raises:
            InputError: a suffix whose format holds no tets, or a file that cannot be written.
        """
        from qlb.mesh.writing import write_tets

        write_tets(self, Path(path))

    @staticmethod
    def union(meshes: Sequence[TetMesh]) -> TetMesh:
        """Nodes and tets of one mesh after the other; the mesh itself where there is one.

        It has regions where all have them, and a surface where one has it.
        """
        if len(meshes) == 1:
            return meshes[0]
        begin = np.cumsum([0, *(len(mesh.positions) for mesh in meshes[:-1])])
        tets = np.concatenate([mesh.tets.astype(np.int64) + k for mesh, k in zip(meshes, begin, strict=True)])
        regions = [mesh.regions for mesh in meshes if mesh.regions is not None]
        union = TetMesh(
            np.concatenate([mesh.positions for mesh in meshes]),
            tets,
            regions=np.concatenate(regions) if len(regions) == len(meshes) else None,
        )
        if any(mesh.surface is not None for mesh in meshes):
            first_tets = np.cumsum([0, *(len(mesh.tets) for mesh in meshes)])[:-1]
            union.surface = EmbeddedSurface.union([mesh.rendered() for mesh in meshes], first_tets, union)
        return union

    def with_surface(self, surface: EmbeddedSurface | None) -> TetMesh:
        """The same mesh, shown as `surface`; self where it is already."""
        if surface is self.surface:
            return self
        mesh = copy(self)
        mesh.surface = surface
        return mesh

    def rendered(self) -> EmbeddedSurface:
        """What is shown of it: its surface where it has one, else its boundary."""
        return EmbeddedSurface.of_boundary(self) if self.surface is None else self.surface

    def with_loose_nodes(self, positions: FloatArray) -> TetMesh:
        """The same tets, and behind their nodes others that belong to none: `positions` (q, 3) [m]; self for q = 0."""
        if len(positions) == 0:
            return self
        mesh = copy(self)
        mesh.positions = np.concatenate([self.positions, positions])
        mesh.positions.setflags(write=False)
        return mesh

    def nodes_where(self, condition: Callable[[FloatArray], BoolArray]) -> IntArray:
        """Indices of the nodes whose rest positions meet `condition`: (n, 3) positions [m] -> (n,) booleans."""
        return np.flatnonzero(condition(self.positions)).astype(np.int32)

    def faces_where(self, condition: Callable[[FloatArray], BoolArray]) -> IntArray:
        """Outward surface triangles (k, 3) whose rest centroids meet `condition`: (f, 3) [m] -> (f,) booleans."""
        faces = self.boundary_triangles()
        return faces[condition(self.positions[faces].mean(axis=1))]

    def centroids(self) -> FloatArray:
        """Rest positions of the centroids of the tets [m], shape (m, 3)."""
        return np.asarray(self.positions[self.tets].mean(axis=1), dtype=np.float64)

    def volumes(self) -> FloatArray:
        """Signed rest volumes [m^3], shape (m,)."""
        return signed_volumes(self.positions, self.tets)

    def boundary_triangles(self) -> IntArray:
        """Faces that belong to one tet only, outward oriented, shape (k, 3)."""
        faces = self.tets[:, [[1, 2, 3], [0, 3, 2], [0, 1, 3], [0, 2, 1]]].reshape(-1, 3)
        _, first, count = np.unique(np.sort(faces, axis=1), axis=0, return_index=True, return_counts=True)
        return np.ascontiguousarray(faces[np.sort(first[count == 1])])

    def edge_lengths(self) -> FloatArray:
        """Lengths [m] of the six edges of each tet, shape (m, 6)."""
        corners = self.positions[self.tets]
        a, b = np.triu_indices(4, k=1)
        return np.asarray(np.linalg.norm(corners[:, a] - corners[:, b], axis=2), dtype=np.float64)


def _array(name: str, values: npt.ArrayLike, dtype: npt.DTypeLike | None = None) -> npt.NDArray[Any]:
    """A C-ordered copy."""
    try:
        return np.array(values, dtype=dtype, order="C")
    except (TypeError, ValueError) as error:
        raise InputError(f"{name} are not an array of numbers: {' '.join(str(error).split())}") from None


def _regions(values: npt.ArrayLike, elements: int) -> LongArray:
    regions = _array("regions", values)
    if not np.issubdtype(regions.dtype, np.integer):
        raise InputError(f"regions have type {regions.dtype}, must be integers")
    if regions.shape != (elements,):
        raise InputError(f"regions have shape {regions.shape}, must be ({elements},), one for each tet")
    regions = regions.astype(np.int64)
    regions.setflags(write=False)
    return regions


def _check_indices(tets: npt.NDArray[np.integer], nodes: int) -> None:
    outside = (tets < 0) | (tets >= nodes)
    if outside.any():
        e, a = np.argwhere(outside)[0]
        raise InputError(f"tet {e} names node {tets[e, a]}, must be in [0, {nodes - 1}]")
    ordered = np.sort(tets, axis=1)
    twice = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
    if twice.any():
        e = int(np.argmax(twice))
        raise InputError(f"tet {e} names a node twice: {tets[e].tolist()}, its four nodes must differ")


def _check_geometry(mesh: TetMesh) -> None:
    bad = ~(np.abs(mesh.positions) < FARTHEST).all(axis=1)
    if bad.any():
        i = int(np.argmax(bad))
        allowed = f"nearer than {FARTHEST:g} m" if np.isfinite(mesh.positions[i]).all() else "finite"
        raise InputError(f"node {i} has position {mesh.positions[i].tolist()}, must be {allowed}")
    volume = mesh.volumes()
    scale = mesh.edge_lengths().max(axis=1) ** 3
    flat = np.abs(volume) <= FLAT * scale
    if flat.any():
        e = int(np.argmax(flat))
        raise InputError(
            f"tet {e} is flat: volume {volume[e]:.3g} m^3, must be > {FLAT:g} of its longest edge cubed"
            f" ({FLAT * scale[e]:.3g} m^3); nodes {mesh.tets[e].tolist()}"
        )
    if (volume < 0).any():
        e = int(np.argmax(volume < 0))
        raise InputError(
            f"tet {e} is inverted: volume {volume[e]:.3g} m^3, must be > 0; nodes {mesh.tets[e].tolist()}"
            f" ({np.count_nonzero(volume < 0)} of {len(volume)} tets are inverted)"
        )
    used = np.zeros(len(mesh.positions), dtype=bool)
    used[mesh.tets] = True
    if not used.all():
        raise InputError(
            f"node {int(np.argmin(used))} belongs to no tet ({np.count_nonzero(~used)} such nodes);"
            " each node must be used"
        )
