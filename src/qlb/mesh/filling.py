"""Tets that fill a surface, by fTetWild."""

from __future__ import annotations

import json
import logging
import tempfile
from dataclasses import dataclass
from importlib.metadata import version
from importlib.util import find_spec
from math import log
from pathlib import Path

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray, whole_number
from qlb.errors import InputError, MissingExtra
from qlb.mesh import cache
from qlb.mesh.child import ChildRefused, ask
from qlb.mesh.closest import embed
from qlb.mesh.embedded_surface import EmbeddedSurface
from qlb.mesh.files import MeshFile, read_surface
from qlb.mesh.geometry import tet_components
from qlb.mesh.surface import SurfaceReport, diagonal, merge_coincident, repair
from qlb.mesh.tet_mesh import TetMesh

FEWEST, MOST, DEFAULT = 100, 2_000_000, 5000
CLOSE, ALLOWED = 0.12, 0.25
"""The search ends at a number of tets that is missed by less than the first share; one missed by more than the second
is said aloud."""
RUNS = 5
FIRST_SHARE, FIRST_POWER = 0.09, 1.6
"""The edge, in diagonals, that makes `DEFAULT` tets, and the power of 1 / edge that their number goes with: a first
guess, then it is measured."""
SHARES = (1e-3, 0.5)
"""Of a target edge in the diagonal."""
ENVELOPE = 0.05
"""How far the boundary of the tets may be from the surface, in edges: less asks for more tets than the edge does, more
shows, where the fine surface is not drawn."""
SECONDS = 1800.0
"""One run of fTetWild may take so long."""
FORMAT = 1
"""Of what the cache holds; changes with anything here that changes a mesh."""

_log = logging.getLogger(__name__)


@dataclass(frozen=True)
class MeshReport:
    """How a mesh was made from a surface."""

    name: str
    """of the surface"""
    found: SurfaceReport
    wanted: int | None
    """tets that were asked for, if any"""
    tets: int
    components: int
    """of the tets"""
    edge: float
    """target edge length [m]"""
    envelope: float
    """how far the boundary of the tets was to be from the surface at most, as a share of its diagonal"""
    deviation: float
    """largest distance of a vertex of the surface from that boundary, as a share of its diagonal"""

    def notes(self) -> list[str]:
        """What a user should know, one line each."""
        notes = self.found.notes()
        if self.wanted is not None and abs(self.tets - self.wanted) > ALLOWED * self.wanted:
            notes.append(f"{self.tets} tets, as near to {self.wanted} as a few tries came")
        if self.components > 1:
            notes.append(f"the tets are {self.components} parts that are not joined")
        if self.deviation > 2 * self.envelope:
            notes.append(
                f"parts of the surface are not filled, such as sheets and small gaps; they lie up to"
                f" {100 * self.deviation:.2g} % of the diagonal away from the tets"
            )
        return [f"{self.name}: {note}" for note in notes]

    def rows(self) -> list[tuple[str, str]]:
        """What was found and made, and its value, to be printed."""
        return [
            *self.found.rows(),
            ("target edge", f"{self.edge:.3g} m"),
            ("off the tets' boundary", f"at most {100 * self.deviation:.2g} % of the diagonal"),
        ]


def load(path: Path, *, edge: float | None, tets: int | None) -> TetMesh:
    """The tets of a file, or those that fill its surface; see `TetMesh.load`."""
    file = MeshFile.read(path)
    if len(file.tets):
        positions, cells, regions = file.used_tets()
        return TetMesh(positions, cells, regions=regions)
    return fill(path.name, *file.surface(), edge=edge, tets=tets)


def fill(
    name: str,
    vertices: FloatArray,
    triangles: IntArray,
    *,
    edge: float | None = None,
    tets: int | None = None,
    surface: bool = True,
) -> TetMesh:
    """Tets that fill a surface as `read_surface` gives it; `name` is what messages call it. See `TetMesh.from_surface`.

    Raises:
        InputError: the surface is flat or encloses nothing, or an argument is out of range.
        MissingExtra: pytetwild is not installed.
    """
    if edge is not None and tets is not None:
        raise InputError("give either tets or edge, not both")
    size = diagonal(vertices)
    outward, found = repair(vertices, triangles)
    if not (np.ptp(vertices, axis=0) > 1e-9 * size).all() or len(outward) < 3:
        raise InputError(f"{name} encloses no volume: it is flat")
    wanted = None if edge is not None else whole_number("tets", DEFAULT if tets is None else tets, FEWEST, MOST)
    task = _Task(name, vertices, outward, size, wanted, None if edge is None else _share(edge, size))
    mesh, numbers = task.made()
    report = MeshReport(name, found, wanted, len(mesh.tets), tet_components(mesh.tets), **numbers)
    for note in report.notes():
        _log.warning("%s", note)
    mesh = mesh if surface else mesh.with_surface(None)
    mesh.report = report
    return mesh


@dataclass(frozen=True)
class _Task:
    """A surface to fill, and what errors call it."""

    name: str
    vertices: FloatArray
    triangles: IntArray
    size: float
    """the diagonal [m]"""
    wanted: int | None
    """tets, or:"""
    share: float | None
    """target edge in diagonals"""

    def made(self) -> tuple[TetMesh, dict[str, float]]:
        """The mesh with the surface in it, and numbers of the report; from the cache where it is there."""
        settings = {"edge": self.share, "tets": self.wanted, "envelope": ENVELOPE, "format": FORMAT, "by": _version()}
        key = cache.key(settings, {"vertices": self.vertices, "triangles": self.triangles})
        kept = _from_cache(key, self.triangles)
        if kept is not None:
            return kept
        _log.info("%s: filling %d triangles with tets, which may take a minute", self.name, len(self.triangles))
        share, mesh = self.search(self.wanted or DEFAULT) if self.share is None else (self.share, self.run(self.share))
        embedding = embed(mesh, self.vertices, self.triangles)
        mesh, deviation = mesh.with_surface(embedding.surface), float(embedding.distances.max()) / self.size
        numbers = {"edge": share * self.size, "envelope": ENVELOPE * share, "deviation": deviation}
        _to_cache(key, mesh, numbers)
        return mesh, numbers

    def run(self, share: float) -> TetMesh:
        """Tets of a target edge that is a share of the diagonal."""
        centre = 0.5 * (self.vertices.min(axis=0) + self.vertices.max(axis=0))
        vertices = (self.vertices - centre) / self.size
        arrays = {"vertices": vertices, "triangles": in_space(vertices, self.triangles)}
        with tempfile.TemporaryDirectory(prefix="qlb-") as folder:
            request = {"task": "fill", "edge": share, "epsilon": ENVELOPE * share, "folder": folder}
            try:
                _, made = ask(request, arrays, seconds=SECONDS)
            except ChildRefused as error:
                raise InputError(f"{self.name} cannot be filled with tets: {error}") from None
        if len(made["tets"]) == 0:
            raise InputError(f"{self.name} encloses no volume: nothing of space is within it")
        used, tets = np.unique(made["tets"], return_inverse=True)
        return TetMesh(made["positions"][used] * self.size + centre, tets.reshape(-1, 4))

    def search(self, wanted: int) -> tuple[float, TetMesh]:
        """About `wanted` tets, and the share; the nearest of a few runs. The number goes about with a power of it."""
        share, power = FIRST_SHARE * (wanted / DEFAULT) ** (-1 / FIRST_POWER), FIRST_POWER
        tried: list[tuple[float, float, TetMesh, float]] = []  # miss, log of the number, mesh, share
        for _ in range(RUNS):
            mesh = self.run(share)
            number = log(len(mesh.tets))
            _log.debug("%s: %d tets at edges of %.3g diagonals", self.name, len(mesh.tets), share)
            tried.append((abs(number - log(wanted)), number, mesh, share))
            if tried[-1][0] < CLOSE:
                break
            if len(tried) > 1 and (step := log(share / tried[-2][3])) != 0:
                power = float(np.clip((tried[-2][1] - number) / step, 0.8, 3.0))
            share = float(np.clip(share * np.exp((number - log(wanted)) / power), *SHARES))
            if any(abs(log(share / before[3])) < 1e-3 for before in tried):
                break
        _, _, mesh, share = min(tried, key=lambda t: t[0])
        return share, mesh


def in_space(vertices: FloatArray, triangles: IntArray) -> IntArray:
    """The triangles in the order of a balanced tree in space.

    fTetWild searches them in a tree that halves their order. Where neighbours in that are far apart in space, its boxes
    overlap so much that a surface of 70 000 triangles takes hours.
    """
    from scipy.spatial import cKDTree

    order = cKDTree(vertices[triangles].mean(axis=1), leafsize=1).indices
    return np.ascontiguousarray(triangles[order])


def given_surface(source: str | Path | tuple[npt.ArrayLike, npt.ArrayLike]) -> tuple[str, FloatArray, IntArray]:
    """What messages call a surface, its vertices (q, 3) and triangles (t, 3), checked, coincident vertices merged."""
    if isinstance(source, str | Path):
        return Path(source).name, *read_surface(source)
    try:
        vertices, triangles = (np.asarray(part) for part in source)
        vertices = vertices.astype(np.float64)
    except (TypeError, ValueError):
        raise InputError(f"surface = {source!r} must be a path, or vertices (q, 3) and triangles (t, 3)") from None
    if vertices.ndim != 2 or vertices.shape[1] != 3 or triangles.ndim != 2 or triangles.shape[1] != 3:
        raise InputError(f"vertices {vertices.shape} and triangles {triangles.shape} must be (q, 3) and (t, 3)")
    if triangles.dtype.kind not in "iu" or len(triangles) == 0:
        raise InputError(f"triangles of a surface have type {triangles.dtype}, must be integers, at least one triangle")
    if triangles.min() < 0 or triangles.max() >= len(vertices):
        raise InputError(f"triangles of a surface are out of range: must be in [0, {len(vertices) - 1}]")
    if not np.isfinite(vertices).all():
        i = int(np.argmin(np.isfinite(vertices).all(axis=1)))
        raise InputError(f"vertex {i} of a surface has position {vertices[i].tolist()}, must be finite")
    return "surface", *merge_coincident(vertices, triangles)


def _share(edge: float, size: float) -> float:
    low, high = (bound * size for bound in SHARES)
    if not low <= edge <= high:
        raise InputError(f"edge {edge!r} is out of range: {low:.3g} to {high:.3g} m, from the size of the surface")
    return float(edge) / size


def _version() -> str:
    """Of fTetWild's wrapper. Raises `MissingExtra` where it is not installed."""
    if find_spec("pytetwild") is None:
        raise MissingExtra('filling a surface with tets needs pytetwild: pip install "qlb[mesh]"')
    return version("pytetwild")


def _to_cache(key: str, mesh: TetMesh, numbers: dict[str, float]) -> None:
    surface = mesh.rendered()
    arrays: cache.Arrays = {"positions": mesh.positions, "tets": mesh.tets, "numbers": np.array(json.dumps(numbers))}
    cache.store(key, arrays | {"owners": surface.tets, "weights": surface.weights})


def _from_cache(key: str, triangles: IntArray) -> tuple[TetMesh, dict[str, float]] | None:
    arrays = cache.load(key)
    if arrays is None:
        return None
    try:
        mesh = TetMesh(arrays["positions"], arrays["tets"])
        surface = EmbeddedSurface.on(mesh, triangles, arrays["owners"], arrays["weights"])
        return mesh.with_surface(surface), json.loads(str(arrays["numbers"]))
    except (InputError, KeyError, ValueError):  # another program's file
        return None
