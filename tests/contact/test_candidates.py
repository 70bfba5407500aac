"""The lists of candidates hold every pair that can come near: against all pairs, one by one."""

from __future__ import annotations

import numpy as np
import pytest

from tests.contact.soups import Soup, boxes, listed, random_soup
from tests.support import Array

FILTERS = {
    "all": np.ones((3, 3)),
    "no self": 1 - np.eye(3),
    "self only": np.eye(3),
    "some": [[0, 1, 0], [1, 1, 1], [0, 1, 0]],
}


def check_complete(soup: Soup, candidates: object, y: Array, radius: float) -> int:
    vertex_faces, edge_edges = listed(candidates)  # type: ignore[arg-type]
    near_faces, near_edges = soup.within(y, radius)
    assert near_faces <= vertex_faces
    assert near_edges <= edge_edges
    return len(near_faces) + len(near_edges)


@pytest.mark.parametrize("allowed", FILTERS.values(), ids=FILTERS.keys())
@pytest.mark.parametrize("threads", [1, 2])
def test_all_pairs_within_the_radius_are_listed(rng: np.random.Generator, allowed: object, threads: int) -> None:
    soup = random_soup(rng, allowed=allowed)
    candidates = soup.candidates(threads)
    for radius in (0.0, 0.02, 0.2):
        candidates.build(soup.x, 0 * soup.x, 0.0, radius)
        found = check_complete(soup, candidates, soup.x, radius)
        assert found > 0 or radius == 0.0


@pytest.mark.parametrize("allowed", FILTERS.values(), ids=FILTERS.keys())
def test_no_pair_is_listed_that_may_not_touch(rng: np.random.Generator, allowed: object) -> None:
    soup = random_soup(rng, allowed=allowed)
    candidates = soup.candidates()
    candidates.build(soup.x, 0 * soup.x, 0.0, 100.0)  # everything is near
    all_faces = {(v, f) for v, f, _ in soup.vertex_faces()}
    all_edges = {(e, f) for e, f, _ in soup.edge_edges()}
    assert listed(candidates) == (all_faces, all_edges)


def test_few_pairs_are_listed_in_vain(rng: np.random.Generator) -> None:
    soup = random_soup(rng, groups=3)
    candidates = soup.candidates()
    candidates.build(soup.x, 0 * soup.x, 0.0, 0.1)
    assert [len(p) for p in listed(candidates)] == [len(p) for p in soup.within(soup.x, 0.1)]  # nothing moves: exact


@pytest.mark.slow
@pytest.mark.parametrize("scale", [0.01, 0.1, 0.5])
@pytest.mark.parametrize("allowed", FILTERS.values(), ids=FILTERS.keys())
def test_lists_stay_complete_along_the_path(rng: np.random.Generator, scale: float, allowed: object) -> None:
    soup = random_soup(rng, allowed=allowed)
    candidates, margin, radius = soup.candidates(), 0.05, 0.05
    p = scale * rng.normal(size=soup.x.shape)
    candidates.build(soup.x, p, margin, radius)
    for t in (0.0, 0.3, 0.7, 1.0):
        # half the margin: within a group the mean of the shifts is taken off
        y = soup.x + t * p + 0.5 * margin * rng.uniform(-1, 1, size=p.shape)
        assert candidates.covers(y, 0 * p)
        assert check_complete(soup, candidates, y, radius) > 0


def test_what_is_covered_is_complete(rng: np.random.Generator) -> None:
    # Positions anywhere in the boxes, not near the path; fast groups, so that the relative boxes differ.
    soup = random_soup(rng)
    candidates, radius = soup.candidates(), 0.05
    p = np.array([0.5, -1.0, 0.3])[soup.group][:, None] + 0.3 * rng.normal(size=soup.x.shape)
    candidates.build(soup.x, p, 0.1, radius)
    covered = 0
    for _ in range(20):
        t = rng.uniform() + 0.1 * rng.uniform(-1, 1, size=(len(p), 3))
        y = soup.x + t * p
        if candidates.covers(y, 0 * y):
            covered += 1
            check_complete(soup, candidates, y, radius)
    assert covered >= 5


@pytest.mark.parametrize("place", [1e3, 1e7, -1e10])
def test_far_from_the_origin(rng: np.random.Generator, place: float) -> None:
    # Boxes are floats in the trees: what they round must only add work.
    soup = random_soup(rng)
    soup = Soup(soup.x + place, soup.faces, soup.group, soup.allowed)
    p = 0.1 * rng.normal(size=soup.x.shape)
    candidates = soup.candidates()
    candidates.build(soup.x, p, 0.01, 0.05)
    for t in (0.0, 1.0):
        assert check_complete(soup, candidates, soup.x + t * p, 0.05) > 0


def test_groups_without_faces(rng: np.random.Generator) -> None:
    soup = random_soup(rng, groups=2)
    none = np.zeros((0, 3), dtype=np.int32)
    for faces in (soup.faces[:16], none):  # of the first group; of none
        bare = Soup(soup.x, faces, soup.group, soup.allowed)
        candidates = bare.candidates()
        candidates.build(soup.x, soup.x, 0.1, 0.1)
        assert candidates.covers(soup.x, soup.x)
        assert bool(len(candidates.vertex_faces)) == bool(len(faces))
        assert len(candidates.intersections(soup.x)) == 0 or len(faces)
    assert candidates.vertex_faces.shape == candidates.edge_edges.shape == (0, 2)
    assert candidates.step_bound(soup.x, soup.x) == 1.0
    assert candidates.limiting is None
    assert candidates.minimum_distance(soup.x) == np.inf


def test_boxes_that_pass_each_other() -> None:
    soup = boxes([(0, 0, 0), (1.05, 0.3, 0.1), (3, 0, 0)])
    p = np.array([0.5, -0.5, 0.0])[soup.group][:, None] * [1.0, 0.0, 0.0]
    candidates = soup.candidates()
    candidates.build(soup.x, p, 0.01, 0.1)
    for t in (0.0, 0.5, 1.0):
        assert check_complete(soup, candidates, soup.x + t * p, 0.1) > 0


def test_a_body_that_flies_as_a_whole_meets_not_itself() -> None:
    soup = boxes([(0, 0, 0)], cells=(3, 3, 3))
    candidates = soup.candidates()
    candidates.build(soup.x, 0 * soup.x, 0.01, 0.01)
    at_rest = listed(candidates)
    p = np.full_like(soup.x, 3.0)
    assert candidates.covers(soup.x + 5, p)  # wherever it is
    candidates.build(soup.x, p, 0.01, 0.01)
    assert listed(candidates) == at_rest


@pytest.mark.parametrize("allowed", ["self", "others"])
def test_leaving_a_box_is_noticed(rng: np.random.Generator, allowed: str) -> None:
    soup = random_soup(rng, groups=2, allowed=np.eye(2) if allowed == "self" else 1 - np.eye(2))
    candidates, margin = soup.candidates(), 0.1
    p = 0.2 * rng.normal(size=soup.x.shape)
    zero = 0 * p
    assert not candidates.covers(soup.x, p)  # nothing is built
    candidates.build(soup.x, p, margin, 0.1)
    assert candidates.covers(soup.x, p)
    assert candidates.covers(soup.x + 0.5 * p, -0.5 * p)
    share = 1 / 32 if allowed == "self" else 0.0  # of its own motion that the mean takes off a vertex
    for node in rng.choice(len(p), size=8, replace=False):
        for axis in range(3):
            # away from its box, whose end is x + p: in the frame of its group, if alone there
            way = p[node, axis] - p[soup.group == soup.group[node], axis].mean() * (allowed == "self")
            out = zero.copy()
            out[node, axis] = np.copysign(margin / (1 - share), way)
            assert candidates.covers(soup.x + p, 0.99 * out)
            assert not candidates.covers(soup.x + p, 1.01 * out)
            assert not candidates.covers(soup.x + p + 1.01 * out, zero)
    broken = p.copy()
    broken[3, 1] = np.nan
    assert not candidates.covers(soup.x, broken)
    assert not candidates.covers(broken, zero)


def test_order_of_pairs_does_not_depend_on_threads(rng: np.random.Generator) -> None:
    soup = random_soup(rng, groups=4, triangles=40)
    p = 0.05 * rng.normal(size=soup.x.shape)
    results = []
    for threads in (1, 2, 3, 7):
        candidates = soup.candidates(threads)
        candidates.build(0.9 * soup.x, -p, 0.1, 0.1)  # nothing of the past is left
        candidates.build(soup.x, p, 0.02, 0.02)
        distance = candidates.minimum_distance(soup.x)
        results.append(
            (
                candidates.vertex_faces.tobytes(),
                candidates.edge_edges.tobytes(),
                distance,
                candidates.step_bound(soup.x, p),
            )
        )
    assert len(candidates.edge_edges) > 1000
    assert all(r == results[0] for r in results)


def test_least_distance(rng: np.random.Generator) -> None:
    soup = random_soup(rng, groups=2, triangles=3, allowed=1 - np.eye(2))
    candidates = soup.candidates()
    assert candidates.minimum_distance(soup.x) == np.inf
    candidates.build(soup.x, 0 * soup.x, 0.0, 1.0)
    d = candidates.minimum_distance(soup.x)
    assert d > 0
    assert not any(soup.within(soup.x, d * (1 - 1e-9)))
    assert any(soup.within(soup.x, d * (1 + 1e-9)))


def test_listed_pairs_that_are_near(rng: np.random.Generator) -> None:
    soup = random_soup(rng)
    candidates = soup.candidates()
    assert candidates.near(soup.x, 1.0).shape == (0, 4)
    candidates.build(soup.x, 0 * soup.x, 0.0, 0.4)
    faces, edges = soup.within(soup.x, 0.25)
    expected = [(v, *soup.faces[f]) for v, f in faces]
    expected += [(*soup.surface.edges[e], *soup.surface.edges[f]) for e, f in edges]
    found = candidates.near(soup.x, 0.25)
    assert sorted(map(tuple, found.tolist())) == sorted(tuple(int(n) for n in nodes) for nodes in expected)
    assert 0 < len(found) < len(candidates.vertex_faces) + len(candidates.edge_edges)


def test_bad_input_is_refused(rng: np.random.Generator) -> None:
    soup = random_soup(rng, groups=1)
    candidates, zero = soup.candidates(), 0 * soup.x
    with pytest.raises(ValueError, match=r"margin is -0\.1"):
        candidates.build(soup.x, zero, -0.1, 0.1)
    with pytest.raises(ValueError, match="radius is nan"):
        candidates.build(soup.x, zero, 0.1, np.nan)
    with pytest.raises(ValueError, match="x has 3 entries"):
        candidates.build(soup.x[:1], zero, 0.1, 0.1)
    broken = zero.copy()
    broken[5] = np.inf
    with pytest.raises(ValueError, match="p of node 5 is not finite"):
        candidates.build(soup.x, broken, 0.1, 0.1)
    with pytest.raises(ValueError, match="p of node 5 is not finite"):
        candidates.step_bound(soup.x, broken)
    for slack in (0.0, 1.0, np.nan):
        with pytest.raises(ValueError, match="slack"):
            candidates.slack = slack
