"""How far a step may go towards planes: what NumPy finds; never through, and as far as the share allows."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import _native

SHARE = 0.9


def test_the_bound_is_the_least_over_all_vertices_and_planes(rng):
    bounded = 0
    for _ in range(50):
        normals = rng.normal(size=(3, 3))
        normals /= np.linalg.norm(normals, axis=1)[:, None]
        x, p = rng.normal(size=(40, 3)), rng.normal(size=(40, 3)) * rng.choice([0.003, 1.0])
        vertices = rng.permutation(40)[:25].astype(np.int32)
        offsets = (x[vertices] @ normals.T).min(axis=0) - rng.uniform(0.01, 0.2, size=3)
        near, motion = (rng.random((25, 3)) < 0.8).astype(np.uint8), rng.normal(scale=0.003, size=3)
        gaps, closing = x[vertices] @ normals.T - offsets, motion - p[vertices] @ normals.T
        parts = np.where((near != 0) & (closing > SHARE * gaps), SHARE * gaps / closing, 1.0)
        part, node, plane = _native.plane_bound(vertices, normals, offsets, near, x, p, motion, SHARE)
        assert part == pytest.approx(parts.min(), rel=1e-12)
        if part == 1:
            assert (node, plane) == (-1, -1)
            continue
        bounded += 1
        before = x[node] @ normals[plane] - offsets[plane]
        after = (x[node] + part * p[node]) @ normals[plane] - (offsets[plane] + part * motion[plane])
        assert after == pytest.approx((1 - SHARE) * before, rel=1e-9)
    assert 5 < bounded < 45


def test_a_node_behind_a_plane_may_leave_it_but_not_go_on():
    vertices, near, still = np.zeros(1, dtype=np.int32), np.ones((1, 1), dtype=np.uint8), np.zeros(1)
    up, x = np.array([[0.0, 1.0, 0.0]]), np.array([[0.0, -1.0, 0.0]])
    for step, expected in ((2.0, (1.0, -1, -1)), (-2.0, (0.0, 0, 0))):
        p = np.array([[0.0, step, 0.0]])
        assert _native.plane_bound(vertices, up, still, near, x, p, still, SHARE) == expected


def test_a_vertex_that_is_no_node_is_refused():
    one, x, near = np.ones(1, dtype=np.int32), np.zeros((1, 3)), np.ones((1, 1), dtype=np.uint8)
    with pytest.raises(ValueError, match="vertices name node 1"):
        _native.plane_bound(one, np.eye(3)[:1], np.zeros(1), near, x, x, np.zeros(1), SHARE)
