"""Edges through faces: against IPC Toolkit, exact rational arithmetic and cases known by construction."""

from __future__ import annotations

from fractions import Fraction

import ipctk
import numpy as np
import pytest

from tests.contact.soups import Soup, boxes, random_soup, triangles
from tests.support import Array

FLAT = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def pairs(soup: Soup, x: Array | None = None) -> set[tuple[int, int]]:
    found = soup.candidates().intersections(soup.x if x is None else x)
    result = {(int(e), int(f)) for e, f in found}
    assert len(result) == len(found)
    return result


@pytest.mark.parametrize("seed", range(10))
@pytest.mark.parametrize("mask", [np.ones((3, 3)), 1 - np.eye(3), [[0, 1, 0], [1, 1, 1], [0, 1, 0]]])
def test_random_soups(seed: int, mask: object) -> None:
    soup = random_soup(np.random.default_rng(seed), allowed=mask, triangles=8)
    expected = set()
    for e, edge in enumerate(soup.surface.edges):
        for f, face in enumerate(soup.faces):
            if soup.may_touch(edge, face) and ipctk.is_edge_intersecting_triangle(*soup.x[edge], *soup.x[face]):
                expected.add((e, f))
    assert expected
    assert pairs(soup) == expected


@pytest.mark.parametrize("seed", range(20))
def test_agrees_with_ipctk_on_whole_meshes(seed: int) -> None:
    rng = np.random.default_rng(seed)
    soup = random_soup(rng, groups=2, triangles=2)
    soup.x *= 1.0 + 2.0 * soup.group[:, None]
    assert bool(pairs(soup)) == ipctk.has_intersections(soup.collision_mesh(), soup.x)


def test_boxes() -> None:
    for offset, meet in [((0.5, 0.4, 0.3), True), ((1.01, 0, 0), False), ((0.99, 0.2, 0.1), True)]:
        soup = boxes([(0, 0, 0), offset])
        assert bool(pairs(soup)) == meet
    soup = boxes([(0, 0, 0), (0.5, 0.4, 0.3)])
    soup = Soup(soup.x, soup.faces, soup.group, np.eye(2, dtype=np.uint8))
    assert not pairs(soup)  # may not touch


TOUCHING = {
    "vertex on face": [[0.25, 0.25, 0], [0.25, 0.25, 1], [0.5, 0.25, 1]],
    "vertex on edge": [[0.5, 0, 0], [0.5, 0, 1], [0.5, -1, 1]],
    "vertex on vertex": [[1, 0, 0], [2, 0, 1], [2, 1, 1]],
    "edge on face": [[0.25, 0.25, 0], [0.5, 0.25, 0], [0.25, 0.25, 1]],
    "edge on edge": [[0.25, 0, 0], [0.5, 0, 0], [0.25, 0, 1]],
    "edge across edge": [[0.5, -0.5, 0], [0.5, 0.125, 0], [0.5, 0, 1]],
    "face in face": [[0.125, 0.125, 0], [0.5, 0.125, 0], [0.125, 0.5, 0]],
    "same face": FLAT,
    "faces side by side": [[0, 0, 0], [1, 0, 0], [0, -1, 0]],
    "flat face through": [[0.25, 0.25, -1], [0.25, 0.25, 1], [0.25, 0.25, 2]],
    "flat face in plane": [[0.25, 0.25, 0], [2, 0.25, 0], [3, 0.25, 0]],
    "point on face": [[0.25, 0.25, 0]] * 3,
}
APART = {
    "above": [[0, 0, 1e-300], [1, 0, 1e-300], [0, 1, 1e-300]],
    "a bit above": [[0.25, 0.25, 5e-17], [0.25, 0.25, 1], [0.5, 0.25, 1]],
    "in plane": [[1, 1, 0], [2, 1, 0], [1, 2, 0]],
    "in plane, a bit off": [[0.5, 0.5 + 2**-52, 0], [1, 0.5 + 2**-52, 0], [0.5, 1, 0]],
    "on one line": [[1 + 2**-52, 0, 0], [2, 0, 0], [3, 0, 0]],
    "point in plane": [[1, 1, 0]] * 3,
}


@pytest.mark.parametrize("turn", range(3))
@pytest.mark.parametrize("kind", [*TOUCHING, *APART])
def test_touching_is_meeting(kind: str, turn: int) -> None:
    other = np.roll(np.array({**TOUCHING, **APART}[kind]), turn, axis=1)
    assert bool(pairs(triangles(np.roll(FLAT, turn, axis=1), other))) == (kind in TOUCHING)


def exact_meeting(x: Array) -> bool:
    """Segment x[:2] and triangle x[2:] in rational arithmetic; they are not in one plane."""
    p, q, a, b, c = [[Fraction(float(v)) for v in row] for row in x]

    def volume(*rows: list[Fraction]) -> int:
        u, v, w = [[s - t for s, t in zip(row, rows[3], strict=True)] for row in rows[:3]]
        d = u[0] * (v[1] * w[2] - v[2] * w[1]) + u[1] * (v[2] * w[0] - v[0] * w[2]) + u[2] * (v[0] * w[1] - v[1] * w[0])
        return (d > 0) - (d < 0)

    sides = {volume(a, b, c, p), volume(a, b, c, q)}
    assert sides != {0}
    around = {volume(p, q, a, b), volume(p, q, b, c), volume(p, q, c, a)}
    return sides not in ({1}, {-1}) and not around >= {1, -1}


@pytest.mark.parametrize("seed", range(200))
def test_near_misses_are_told_exactly(seed: int) -> None:
    # An end of the edge is on the face or one of its edges up to a rounding error, far from the origin.
    rng = np.random.default_rng(seed)
    a, b, c, q = rng.normal(size=(4, 3)) + np.array([100, -30, 7])
    weights = rng.dirichlet([1, 1, 1])
    if seed % 2:
        weights[0], weights[1] = 0.0, weights[0] + weights[1]
    p = weights @ np.array([a, b, c])
    soup = triangles([p, q, q + rng.normal(size=3)], [a, b, c])
    edge = [tuple(e) for e in soup.surface.edges].index((0, 1))
    assert ((edge, 1) in pairs(soup)) == exact_meeting(np.array([p, q, a, b, c]))


def test_lists_of_candidates_stay() -> None:
    soup = boxes([(0, 0, 0), (1.05, 0, 0)])
    candidates = soup.candidates()
    candidates.build(soup.x, 0 * soup.x, 0.01, 0.1)
    before = candidates.vertex_faces
    assert len(candidates.intersections(soup.x - 0.1 * soup.group[:, None]))
    np.testing.assert_array_equal(candidates.vertex_faces, before)
    assert candidates.covers(soup.x, 0 * soup.x)


def test_order_does_not_depend_on_threads(rng: np.random.Generator) -> None:
    soup = random_soup(rng, groups=3, triangles=30)
    found = [soup.candidates(threads).intersections(soup.x).tobytes() for threads in (1, 2, 3, 7)]
    assert len(found[0]) > 100
    assert all(f == found[0] for f in found)


def test_not_finite_is_refused() -> None:
    soup = triangles(FLAT)
    soup.x[1, 1] = np.nan
    with pytest.raises(ValueError, match="x of node 1 is not finite"):
        soup.candidates().intersections(soup.x)
