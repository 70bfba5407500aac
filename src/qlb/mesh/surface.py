"""Surfaces of triangles as they come from files: coincident vertices, holes, orientation."""

from __future__ import annotations

from dataclasses import dataclass
from itertools import product

import numpy as np
import numpy.typing as npt

from qlb.arrays import BoolArray, FloatArray, IntArray, LongArray
from qlb.mesh.geometry import SLIVER, longest_edges, parts, triangle_areas

COINCIDENT = 1e-7
"""Vertices nearer than this share of the diagonal of the bounding box are one: about the rounding of float32.

Some that are up to four times as far apart are, too."""


@dataclass(frozen=True)
class SurfaceReport:
    """What a surface looks like, and what was done about it."""

    vertices: int
    triangles: int
    components: int
    """parts that hang together through edges of two triangles"""
    boundary_edges: int
    """edges of one triangle only"""
    holes: int
    """chains of boundary edges that hang together"""
    branching_edges: int
    """edges of more than two triangles"""
    degenerate: int
    """triangles without area, which were dropped"""
    duplicate: int
    """triangles with the same vertices as another, which were dropped"""
    turned: int
    """triangles that were turned over, so that neighbours agree and the outside is outside"""
    one_sided: int
    """components without an inside and an outside, such as a Moebius strip"""

    def notes(self) -> list[str]:
        """What a user should know, one line each; nothing where the surface is closed and sound."""
        notes = []
        if self.degenerate or self.duplicate:
            notes.append(f"dropped {self.degenerate} triangles without area and {self.duplicate} that are there twice")
        if self.boundary_edges:
            notes.append(
                f"the surface is open: {_count(self.boundary_edges, 'boundary edge')} around"
                f" {_count(self.holes, 'hole')}; filling closes them"
            )
        if self.branching_edges:
            notes.append(f"{_count(self.branching_edges, 'edge')} with more than two triangles; the outside was kept")
        if self.turned:
            notes.append(f"{_count(self.turned, 'triangle')} turned over, inside out before")
        if self.one_sided:
            notes.append(f"{_count(self.one_sided, 'component')} without inside and outside (one-sided)")
        if self.components > 1:
            notes.append(f"the surface has {self.components} components")
        return notes

    def rows(self) -> list[tuple[str, str]]:
        """What it is, and its value, to be printed; what a sound surface has none of is left out."""
        rows = [
            ("vertices, triangles", f"{self.vertices}, {self.triangles}"),
            ("components", f"{self.components}"),
            ("boundary edges, holes", f"{self.boundary_edges}, {self.holes}"),
        ]
        defects = {
            "edges of 3 or more triangles": self.branching_edges,
            "triangles without area, dropped": self.degenerate,
            "doubled triangles, dropped": self.duplicate,
            "triangles turned over": self.turned,
            "one-sided components": self.one_sided,
        }
        return rows + [(name, f"{value}") for name, value in defects.items() if value]


def _count(number: int, what: str) -> str:
    return f"{number} {what}{'' if number == 1 else 's'}"


def merge_coincident(vertices: FloatArray, triangles: npt.NDArray[np.integer]) -> tuple[FloatArray, IntArray]:
    """The same triangles, with vertices (q, 3) nearer than `COINCIDENT` of the diagonal merged.

    Each set of coincident vertices becomes the first of them.
    """
    same = _coincident(vertices, COINCIDENT * diagonal(vertices))
    _, first, renumbered = np.unique(same, return_index=True, return_inverse=True)
    order = np.argsort(first)  # vertices stay in the order of the file
    rank = np.empty_like(order)
    rank[order] = np.arange(len(order))
    return vertices[first[order]], rank[renumbered][triangles].astype(np.int32)


def _coincident(vertices: FloatArray, tolerance: float) -> IntArray:
    """A label of each vertex, which those within `tolerance` [m] of each other share, shape (q,)."""
    # Two that are so near share a cell in one of eight grids, shifted by half a cell along each axis. Pairs of near
    # vertices would be too many where one vertex far away makes all others near.
    low, cell = vertices.min(axis=0), 2 * tolerance
    joined = []
    for shift in product((0.0, 0.5), repeat=3):
        cells = np.floor((vertices - low) / cell + shift) if cell > 0 else vertices
        joined.append(np.unique(cells, axis=0, return_index=True, return_inverse=True)[1:])
    first = np.concatenate([first[of_vertex.reshape(-1)] for first, of_vertex in joined])
    return parts(len(vertices), np.tile(np.arange(len(vertices)), len(joined)), first)


def diagonal(vertices: FloatArray) -> float:
    """Of the bounding box [m]."""
    return float(np.linalg.norm(np.ptp(vertices, axis=0)))


def repair(vertices: FloatArray, triangles: IntArray) -> tuple[IntArray, SurfaceReport]:
    """Triangles (t, 3) that agree with their neighbours on what is outside, without degenerate and duplicate ones."""
    sound = sound_triangles(vertices, triangles)
    kept = triangles[sound]
    _, first = np.unique(np.sort(kept, axis=1), axis=0, return_index=True)
    unique = kept[np.sort(first)]
    edges = _Edges.of(unique)
    turned, one_sided, component = _orientation(edges, len(unique))
    turned ^= _inside_out(vertices, np.where(turned[:, None], unique[:, ::-1], unique), component)
    outward = np.where(turned[:, None], unique[:, ::-1], unique).astype(np.int32)
    boundary = edges.ends[edges.count == 1]
    report = SurfaceReport(
        vertices=len(np.unique(triangles)),
        triangles=len(triangles),
        components=int(component.max(initial=-1)) + 1,
        boundary_edges=len(boundary),
        holes=_chains(boundary),
        branching_edges=int(np.count_nonzero(edges.count > 2)),
        degenerate=int(np.count_nonzero(~sound)),
        duplicate=len(kept) - len(unique),
        turned=int(np.count_nonzero(turned)),
        one_sided=one_sided,
    )
    return outward, report


def sound_triangles(vertices: FloatArray, triangles: IntArray) -> BoolArray:
    """Which triangles have an area, shape (t,)."""
    return np.asarray(triangle_areas(vertices, triangles) > SLIVER * longest_edges(vertices, triangles) ** 2)


@dataclass(frozen=True)
class _Edges:
    """Edges of triangles: between which vertices, of how many, and the two triangles where there are two."""

    ends: LongArray
    """lower vertex first, shape (e, 2)"""
    count: LongArray
    """of triangles, shape (e,)"""
    pairs: LongArray
    """the two triangles of the edges that have two, shape (p, 2)"""
    agree: BoolArray
    """whether those two run along their edge in opposite directions, as they should, shape (p,)"""

    @staticmethod
    def of(triangles: IntArray) -> _Edges:
        start, end = triangles.astype(np.int64).ravel(), np.roll(triangles, -1, axis=1).astype(np.int64).ravel()
        directed = np.stack([start, end], axis=1)
        ends, of_side, count = np.unique(np.sort(directed, axis=1), axis=0, return_inverse=True, return_counts=True)
        order = np.argsort(of_side.reshape(-1), kind="stable")
        first = (np.cumsum(count) - count)[count == 2]
        a, b = order[first], order[first + 1]
        return _Edges(ends, count, np.stack([a // 3, b // 3], axis=1), start[a] != start[b])


def _orientation(edges: _Edges, triangles: int) -> tuple[BoolArray, int, IntArray]:
    """Which triangles to turn so that neighbours agree, the number of components that have no such choice, components.

    A graph has two nodes for each triangle, as it is and turned over, and joins those of neighbours that agree. Its
    components come in two, one of which is taken; a one-sided surface has but one.
    """
    a, b = edges.pairs[edges.agree].T
    c, d = edges.pairs[~edges.agree].T
    rows = np.concatenate([a, a + triangles, c, c + triangles])
    columns = np.concatenate([b, b + triangles, d + triangles, d])
    cover = parts(2 * triangles, rows, columns)
    component = parts(triangles, edges.pairs[:, 0], edges.pairs[:, 1])
    as_it_is, over = cover[:triangles], cover[triangles:]
    # Of the two choices in each component, that which turns fewer triangles.
    choice = np.minimum(as_it_is, over)
    turned = as_it_is != choice
    size = np.bincount(component)
    many = np.bincount(component, weights=turned) > 0.5 * size
    one_sided = as_it_is == over
    turned ^= many[component] & ~one_sided
    return turned, len(np.unique(component[one_sided])), component


def _inside_out(vertices: FloatArray, triangles: IntArray, component: IntArray) -> BoolArray:
    """Which triangles belong to components whose inside is outside, shape (t,).

    All are turned where the whole encloses a negative volume. Then a component of negative volume is a cavity where it
    lies in others, and else inside out.
    """
    corners = vertices[triangles] - vertices.mean(axis=0)
    volume = np.einsum("ij,ij->i", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])) / 6
    whole = bool(volume.sum() < 0)
    of_component = np.bincount(component, weights=-volume if whole else volume)
    negative = np.flatnonzero(of_component < 0)[:MOST_CAVITIES]
    wrong = np.full(len(triangles), whole)
    for c in negative:
        mine = component == c
        others = vertices[triangles[~mine]]
        winding = winding_number(vertices[triangles[mine][0, 0]], others) * (-1 if whole else 1)
        if winding < 0.5:
            wrong[mine] = not whole
    return wrong


MOST_CAVITIES = 100
"""Components that are looked at one by one; a surface of more is not repaired by turning them."""


def winding_number(point: FloatArray, corners: FloatArray) -> float:
    """How often triangles (t, 3, 3) wind around a point (3,): their solid angle over 4 pi.

    A. Van Oosterom, J. Strackee (1983), "The solid angle of a plane triangle", IEEE Trans. Biomed. Eng. 30(2).
    """
    r = corners - point
    n = np.linalg.norm(r, axis=2)
    a, b, c = r.transpose(1, 0, 2)
    above = np.einsum("ij,ij->i", a, np.cross(b, c))
    below = n.prod(axis=1) + sum(np.einsum("ij,ij->i", p, q) * n[:, k] for p, q, k in ((a, b, 2), (b, c, 0), (c, a, 1)))
    return float(np.arctan2(above, below).sum() / (2 * np.pi))


def _chains(edges: LongArray) -> int:
    """Number of sets of edges (e, 2) that hang together."""
    nodes, renumbered = np.unique(edges, return_inverse=True)
    a, b = renumbered.reshape(-1, 2).T
    return int(parts(len(nodes), a, b).max(initial=-1)) + 1
