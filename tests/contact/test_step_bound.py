"""How far a surface may move: against dense sampling of the path and against IPC Toolkit's collision detection."""

from __future__ import annotations

import ipctk
import numpy as np
import pytest

from tests.contact.soups import Soup, boxes, random_soup, triangles
from tests.support import Array

SEEDS = range(12)
FLAT = [[0, 0, 0], [1, 0, 0], [0, 1, 0]]


def shifted(by: list[float]) -> Array:
    return np.array(FLAT, dtype=float) + by


def bound(soup: Soup, p: Array, slack: float = 0.1, radius: float = 0.0) -> tuple[float, object]:
    candidates = soup.candidates()
    candidates.slack = slack
    candidates.build(soup.x, p, 0.0, radius)
    return candidates.step_bound(soup.x, p), candidates.limiting


def two_triangles(seed: int, speed: float) -> tuple[Soup, Array]:
    """Apart by about 1 and moving towards each other while they turn and stretch."""
    rng = np.random.default_rng(seed)
    a, b = rng.normal(size=(2, 3, 3)) * [1.0, 1.0, 0.1]
    soup = triangles(a, b + np.array([0, 0, 1.2]))
    p = np.where(soup.group[:, None] == 0, 1.0, -1.0) * [0, 0, 0.8] + 0.5 * rng.normal(size=soup.x.shape)
    return soup, speed * p


def distances(soup: Soup, y: Array) -> Array:
    squared = [ipctk.point_triangle_distance(*y[k]) for *_, k in soup.vertex_faces()]
    squared += [ipctk.edge_edge_distance(*y[k]) for *_, k in soup.edge_edges()]
    return np.sqrt(squared)


@pytest.mark.parametrize("seed", SEEDS)
@pytest.mark.parametrize("slack", [0.1, 0.2])
def test_step_is_safe_and_long(seed: int, slack: float) -> None:
    soup, p = two_triangles(seed, 1.0)
    step, _ = bound(soup, p, slack, radius=10.0)
    kept = slack * distances(soup, soup.x)
    times = np.linspace(0, 1, 1001)
    below = [t for t in times if np.any(distances(soup, soup.x + t * p) < kept * (1 - 1e-9))]
    first = min(below, default=1.0)
    assert 0.8 * first <= step
    assert step < first or step == 1.0


def test_step_to_the_kept_distance_in_closed_form() -> None:
    # Time to the kept distance along the normal, known in closed form: a triangle falling flat on another.
    for gap in (1.0, 1e-3, 1e-8, 1e-12):
        soup = triangles(FLAT, shifted([0.2, 0.1, gap]))
        p = np.zeros_like(soup.x)
        p[3:, 2] = -2 * gap
        step, limiting = bound(soup, p)
        assert step == pytest.approx(0.45, rel=1e-3)
        assert limiting is not None


@pytest.mark.parametrize("seed", SEEDS)
def test_no_step_beyond_ipctk_impact(seed: int) -> None:
    soup, p = two_triangles(seed, 1.5)
    step, limiting = bound(soup, p)
    y, exact, additive = soup.x + p, [], []
    for pairs, call in ((soup.vertex_faces(), "point_triangle_ccd"), (soup.edge_edges(), "edge_edge_ccd")):
        for *_, k in pairs:
            exact.append(getattr(ipctk.TightInclusionCCD(), call)(*soup.x[k], *y[k]))
            additive.append(getattr(ipctk.AdditiveCCD(max_iterations=100_000), call)(*soup.x[k], *y[k]))
    assert step >= 0.8 * min((t for hit, t in additive if hit), default=1.0)
    if any(hit for hit, _ in exact):
        assert limiting is not None
        assert step < min(t for hit, t in exact if hit)


@pytest.mark.parametrize("seed", range(4))
def test_step_of_many_bodies(seed: int) -> None:
    rng = np.random.default_rng(seed)
    soup = random_soup(rng, groups=3)
    soup.x *= 4.0 * (1 + soup.group[:, None])  # few overlaps
    x = soup.x
    while len(hits := soup.candidates().intersections(x)):  # move what intersects away
        x = x.copy()
        for edge in np.unique(hits[:, 0]):
            quad = soup.surface.edges[edge][0] // 4
            x[4 * quad : 4 * quad + 4] += 2 * rng.normal(size=3)
    soup.x = x
    p = 2.0 * rng.normal(size=x.shape)
    step, limiting = bound(soup, p)
    mesh = soup.collision_mesh()
    largest = ipctk.compute_collision_free_stepsize(mesh, x, x + p)
    assert 0.3 * largest < step <= largest
    assert largest < 1.0
    assert limiting is not None
    assert not ipctk.has_intersections(mesh, x + step * p)


def test_a_long_series_of_steps_never_meets() -> None:
    soup = boxes([(0, 0, 0), (0.1, 0.2, 1.3)])
    p = np.where(soup.group[:, None] == 0, 0.0, -1.0) * [0.0, 0.0, 1.0]
    candidates, x = soup.candidates(), soup.x
    for k in range(12):
        candidates.build(x, p, 0.0, 0.0)
        x = x + candidates.step_bound(x, p) * p
        assert not len(candidates.intersections(x))
        gap = x[soup.group == 1, 2].min() - 1.0
        assert gap == pytest.approx(0.3 * 0.1 ** (k + 1), rel=0.1)


def test_sliding_costs_nothing() -> None:
    # Where distances stay as they are the whole step is free, however long: at a gap of 1e-6, past many edges.
    soup = boxes([(0, 0, 0), (0.13, 0.17, 1 + 1e-6)], cells=(3, 3, 3))
    soup.allowed[:] = 1 - np.eye(2)
    soup = Soup(soup.x, soup.faces, soup.group, soup.allowed)
    p = np.where(soup.group[:, None] == 0, 0.0, 1.0) * [0.7, 0.3, 0.0]
    assert bound(soup, p) == (1.0, None)


DEGENERATE = {
    "parallel faces": shifted([0, 0, 0.5]),
    "faces in one plane": shifted([2, 0, 0]),
    "edges on one line": np.array([[1.5, 0, 0], [2.5, 0, 0], [2, -1, 0]]),
    "vertex over vertex": np.array([[0, 0, 0.5], [1, 0, 1.5], [0, 1, 1.5]]),
    "no area": np.array([[0, 0, 0.5], [1, 0, 0.5], [2, 0, 0.5]]),
    "a point": np.array([[0.2, 0.2, 0.5]] * 3),
}


@pytest.mark.parametrize("towards", [-0.3, -1.0, -1e3, -1e9])
@pytest.mark.parametrize("other", DEGENERATE.values(), ids=DEGENERATE.keys())
def test_degenerate_primitives(other: Array, towards: float) -> None:
    soup = triangles(FLAT, other)
    direction = np.array([1.0, 0, 0]) if other[0, 2] == 0 else np.array([0, 0, 1.0])
    p = np.where(soup.group[:, None] == 0, 0.0, towards) * direction
    step, limiting = bound(soup, p)
    gap = 0.5 if other[0, 2] else other[:, 0].min() - 1.0
    assert step == pytest.approx(min(1.0, 0.9 * gap / -towards), rel=0.02)
    assert (limiting is None) == (step == 1.0)
    assert bound(soup, 0 * p, radius=10.0) == (1.0, None)
    assert bound(soup, -p, radius=10.0) == (1.0, None)
    assert bound(soup, np.tile(p[-1], (6, 1)), radius=10.0) == (1.0, None)  # together


def test_touching_at_the_start_leaves_no_step() -> None:
    soup = triangles(FLAT, np.array([[0.25, 0.25, 0], [1, 0, 1], [0, 1, 1]]))
    p = np.zeros_like(soup.x)
    assert bound(soup, p) == (1.0, None)
    p[3:, 2] = -1.0
    step, limiting = bound(soup, p)
    assert step == 0.0
    assert list(limiting) == [3, 0, 1, 2]  # type: ignore[call-overload]


def test_the_limiting_pair_is_named() -> None:
    soup = triangles(FLAT, np.array([[0.2, 0.2, 0.5], [1, 0, 2], [0, 1, 2]]))
    p = np.zeros_like(soup.x)
    p[3, 2] = -1.0
    step, limiting = bound(soup, p, radius=10.0)
    assert step == pytest.approx(0.45)
    assert list(limiting) == [3, 0, 1, 2]  # type: ignore[call-overload]


@pytest.mark.parametrize("speed", [1e-300, 1e-12, 1.0, 1e3, 1e12])
def test_bound_is_the_same_for_any_threads(rng: np.random.Generator, speed: float) -> None:
    soup = random_soup(rng, groups=4, triangles=20)
    p = speed * rng.normal(size=soup.x.shape)
    steps = []
    for threads in (1, 2, 3, 7):
        candidates = soup.candidates(threads)
        candidates.build(soup.x, 0 * p, 0.0, 0.3)
        steps.append(
            (candidates.step_bound(soup.x, p), None if candidates.limiting is None else tuple(candidates.limiting))
        )
    assert len(candidates.edge_edges) > 1024
    assert all(s == steps[0] for s in steps)
    assert (steps[0][0] == 1.0) == (speed < 1e-9)
