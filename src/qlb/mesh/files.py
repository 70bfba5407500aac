"""Reading mesh files: tetrahedra through meshio, surfaces through trimesh, OpenUSD and meshio."""

from __future__ import annotations

from dataclasses import dataclass
from importlib.util import find_spec
from pathlib import Path

import numpy as np

from qlb.arrays import FloatArray, IntArray, LongArray
from qlb.errors import InputError, MissingExtra
from qlb.mesh import worker
from qlb.mesh.child import ChildRefused, ask
from qlb.mesh.surface import merge_coincident

SECONDS_TO_START, SECONDS, SECONDS_PER_MEGABYTE = 300.0, 60.0, 10.0
"""What reads may take so long to start, reading then so long, and so much longer for each megabyte of the file."""
LARGEST = 1e100
"""Coordinate [m]: the squares of larger ones are near the end of the range of numbers."""


@dataclass(frozen=True)
class MeshFile:
    """What a file holds. Indices are within the points."""

    path: Path
    points: FloatArray
    """[m], shape (n, 3); some may belong to nothing"""
    tets: LongArray
    """shape (m, 4)"""
    triangles: LongArray
    """those of the file (t, 3), quads cut in two; not the boundary of the tets"""
    regions: LongArray | None
    """of each tet, shape (m,), or None"""
    kinds: tuple[str, ...]
    """of cells, as the format calls them"""

    @staticmethod
    def read(path: str | Path) -> MeshFile:
        """Read a file in any format.

        Raises:
            InputError: the file is missing, empty or cannot be read; an index is out of range.
            MissingExtra: a USD file, and usd-core is not installed.
        """
        path = Path(path)
        if not path.is_file():
            raise InputError(f"mesh file {path} does not exist")
        size = path.stat().st_size
        if size == 0:
            raise InputError(f"mesh file {path} is empty")
        if path.suffix.lower() in worker.USD and find_spec("pxr") is None:
            raise MissingExtra(f'{path} needs usd-core: pip install "qlb[usd]"')
        try:
            request = {"path": str(path.absolute())}
            ask(request | {"task": "prepare"}, {}, seconds=SECONDS_TO_START)
            seconds = SECONDS + SECONDS_PER_MEGABYTE * 1e-6 * size
            header, arrays = ask(request | {"task": "read"}, {}, seconds=seconds)
        except ChildRefused as error:
            raise InputError(f"mesh file {path} cannot be read: {error}") from None
        if arrays["points"].ndim != 2 or arrays["points"].shape[1] != 3:
            raise InputError(f"mesh file {path} has points of shape {arrays['points'].shape}, must be (n, 3)")
        tets, triangles = (_indices(path, arrays[name], len(arrays["points"])) for name in ("tets", "triangles"))
        regions = arrays.get("regions")
        return MeshFile(path, arrays["points"], tets, triangles, regions, tuple(header["kinds"]))

    def used_tets(self) -> tuple[FloatArray, IntArray, LongArray | None]:
        """Positions of the nodes that tets use, the tets, regions. Raises `InputError` where there are none."""
        positions, tets = self._used(self.tets, "tetrahedra")
        return positions, tets, self.regions

    def surface(self) -> tuple[FloatArray, IntArray]:
        """Vertices that triangles use, coincident ones merged, and the triangles; see `read_surface`."""
        return merge_coincident(*self._used(self.triangles, "triangles"))

    def _used(self, cells: LongArray, what: str) -> tuple[FloatArray, IntArray]:
        if len(cells) == 0:
            found = (
                f"only {', '.join(self.kinds)}" if self.kinds else "nor anything else, or is not what its suffix says"
            )
            raise InputError(f"mesh file {self.path} has no {what}, {found}")
        used, renumbered = np.unique(cells, return_inverse=True)
        positions = self.points[used]
        bad = ~(np.abs(positions) < LARGEST).all(axis=1)
        if bad.any():
            first = int(np.argmax(bad))
            raise InputError(
                f"mesh file {self.path}: node {used[first]} has position {positions[first].tolist()}, must be finite"
                f" and below {LARGEST:g} m"
            )
        return positions, renumbered.reshape(cells.shape).astype(np.int32)


def read_tets(path: Path) -> tuple[FloatArray, IntArray, LongArray | None]:
    """Positions [m] (n, 3), tets (m, 4) without unused nodes, and regions (m,) of a mesh file; see `TetMesh.read`."""
    return MeshFile.read(path).used_tets()


def read_surface(path: str | Path) -> tuple[FloatArray, IntArray]:
    """Vertices [m] (q, 3) and triangles (t, 3) of a surface file.

    OBJ, STL, PLY, OFF, glTF and GLB are read by trimesh; USD, USDA, USDC and USDZ by OpenUSD (extra `usd`); the
    triangles and quads of any other format by meshio. Polygons are cut into triangles. Lengths are taken as metres,
    except in USD files, where `metersPerUnit` is heeded and a stage with z up is turned to y up. Objects of a scene
    stand where its transforms put them, as one surface.

    Vertices nearer to each other than 1e-7 of the diagonal of the bounding box are merged (texture seams, STL files),
    and those that no triangle uses dropped.

    Raises:
        InputError: the file is missing, unreadable or has no triangles, a vertex is not finite.
        MissingExtra: a USD file, and usd-core is not installed.
    """
    return MeshFile.read(path).surface()


def _indices(path: Path, cells: np.ndarray, points: int) -> LongArray:
    if cells.dtype.kind not in "iu":
        raise InputError(f"mesh file {path} has node indices of type {cells.dtype}, must be integers")
    if cells.size and (cells.min() < 0 or cells.max() >= points):
        bad = cells.min() if cells.min() < 0 else cells.max()
        raise InputError(f"mesh file {path}: node index {bad} is outside its {points} nodes")
    return cells.astype(np.int64)
