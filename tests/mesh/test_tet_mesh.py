"""A mesh is checked when it is made; its lengths, volumes and boundary are those of geometry."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import InputError, TetMesh
from tests.support import jittered

CORNERS = [[0.0, 0.0, 0.0], [1.0, 0.0, 0.0], [0.0, 1.0, 0.0], [0.0, 0.0, 1.0]]
TWO = [*CORNERS, [1.0, 1.0, 1.0]]


def with_node(index: int, position: list[float]) -> list[list[float]]:
    positions = [list(p) for p in TWO]
    positions[index] = position
    return positions


NAN, INF = float("nan"), float("inf")
BOTH = [[0, 1, 2, 3], [1, 2, 3, 4]]
WRONG = {
    "inverted": (
        TWO,
        [[0, 1, 2, 3], [2, 1, 3, 4]],
        ["tet 1 is inverted: volume -0.333 m^3, must be > 0", "nodes [2, 1, 3, 4]", "1 of 2"],
    ),
    "flat": (
        with_node(4, [0.5, 0.5, 0.0]),
        BOTH,
        ["tet 1 is flat: volume 0 m^3", "must be > 1e-10", "nodes [1, 2, 3, 4]"],
    ),
    "nearly flat": (with_node(4, [0.3, 0.3, 0.4 + 1e-12]), BOTH, ["tet 1 is flat"]),
    "node twice": (
        TWO,
        [[0, 1, 2, 3], [4, 2, 3, 4]],
        ["tet 1 names a node twice: [4, 2, 3, 4]", "four nodes must differ"],
    ),
    "index too large": (TWO, [[0, 1, 2, 3], [1, 2, 3, 5]], ["tet 1 names node 5, must be in [0, 4]"]),
    "index negative": (TWO, [[0, 1, 2, 3], [1, -2, 3, 4]], ["tet 1 names node -2, must be in [0, 4]"]),
    "nan": (with_node(2, [0.0, NAN, 0.0]), BOTH, ["node 2 has position [0.0, nan, 0.0], must be finite"]),
    "infinite": (with_node(3, [0.0, 0.0, INF]), BOTH, ["node 3 has position [0.0, 0.0, inf], must be finite"]),
    "unused node": (TWO, [[0, 1, 2, 3]], ["node 4 belongs to no tet (1 such nodes); each node must be used"]),
    "plane positions": ([[0.0, 0.0]] * 4, [[0, 1, 2, 3]], ["positions have shape (4, 2), must be (n, 3)"]),
    "flat list of positions": ([0.0] * 12, [[0, 1, 2, 3]], ["positions have shape (12,), must be (n, 3)"]),
    "triangles": (CORNERS, [[0, 1, 2]], ["tets have shape (1, 3), must be (m, 4) with m >= 1"]),
    "flat list of tets": (CORNERS, [0, 1, 2, 3], ["tets have shape (4,), must be (m, 4) with m >= 1"]),
    "no tets": (CORNERS, np.zeros((0, 4), int), ["tets have shape (0, 4), must be (m, 4) with m >= 1"]),
    "nothing at all": ([], [], ["positions have shape (0,), must be (n, 3)"]),
    "float tets": (CORNERS, [[0.0, 1.0, 2.0, 3.0]], ["tets have type float64, must be integers"]),
    "text positions": ([["a", "b", "c"]] * 4, [[0, 1, 2, 3]], ["positions"]),
    "ragged positions": ([[0.0, 0.0, 0.0], [1.0]], [[0, 1, 2, 3]], ["positions"]),
}


@pytest.mark.parametrize(("positions", "tets", "parts"), WRONG.values(), ids=WRONG)
def test_a_wrong_mesh_is_refused_with_what_is_wrong(positions: object, tets: object, parts: list[str]) -> None:
    with pytest.raises(InputError) as caught:
        TetMesh(positions, tets)  # type: ignore[arg-type]
    message = str(caught.value)
    assert "\n" not in message
    for part in parts:
        assert part in message


def test_the_first_of_several_wrong_tets_is_named() -> None:
    mesh = TetMesh.box(cells=(2, 2, 2))
    tets = mesh.tets.copy()
    tets[[5, 9, 30]] = tets[[5, 9, 30]][:, [1, 0, 2, 3]]
    with pytest.raises(InputError, match=r"tet 5 is inverted.*\(3 of 48 tets are inverted\)"):
        TetMesh(mesh.positions, tets)


def test_a_small_tet_is_not_flat() -> None:
    mesh = TetMesh(1e-6 * np.array(CORNERS), [[0, 1, 2, 3]])
    assert mesh.volumes()[0] == pytest.approx(1e-18 / 6)


def test_a_slender_tet_is_not_flat() -> None:
    assert TetMesh(np.array(CORNERS) * [1.0, 1e-3, 1e-3], [[0, 1, 2, 3]]).volumes()[0] > 0


@pytest.mark.parametrize("kind", [np.int16, np.int64, np.uint32])
def test_any_integers_name_the_nodes(kind: type[np.integer]) -> None:
    assert TetMesh(TWO, np.array(BOTH, dtype=kind)).tets.dtype == np.int32


def test_a_mesh_does_not_change() -> None:
    mesh = TetMesh(CORNERS, [[0, 1, 2, 3]])
    with pytest.raises(ValueError, match="read-only"):
        mesh.positions[0] = 1.0
    with pytest.raises(ValueError, match="read-only"):
        mesh.tets[0] = 1


def test_arrays_that_a_mesh_is_made_from_stay_their_owners() -> None:
    positions, tets = np.array(CORNERS), np.array([[0, 1, 2, 3]], dtype=np.int32)
    mesh = TetMesh(positions, tets)
    positions[0] = 5.0
    tets[0] = [3, 2, 1, 0]
    np.testing.assert_array_equal(mesh.positions, CORNERS)
    np.testing.assert_array_equal(mesh.tets, [[0, 1, 2, 3]])


def test_edge_lengths_of_the_corner_tet() -> None:
    lengths = TetMesh(CORNERS, [[0, 1, 2, 3]]).edge_lengths()
    np.testing.assert_allclose(np.sort(lengths), [[1, 1, 1, *3 * [np.sqrt(2)]]])


def test_nodes_where_selects_by_rest_position() -> None:
    mesh = TetMesh.box((1.0, 0.5, 0.5), cells=(2, 1, 1))
    nodes = mesh.nodes_where(lambda x: x[:, 0] > 0.9)
    assert nodes.dtype == np.int32
    np.testing.assert_array_equal(mesh.positions[nodes, 0], 1.0)
    assert len(nodes) == 4
    assert len(mesh.nodes_where(lambda x: x[:, 0] > 2)) == 0


def test_boundary_is_closed(rng: np.random.Generator) -> None:
    # Each edge of a closed, consistently oriented surface is run through once in each direction.
    triangles = jittered(TetMesh.box(cells=(3, 4, 3)), rng, 0.2).boundary_triangles()
    edges = np.concatenate([triangles[:, [0, 1]], triangles[:, [1, 2]], triangles[:, [2, 0]]])
    forward = {tuple(edge) for edge in edges.tolist()}
    assert len(forward) == len(edges)
    assert {(b, a) for a, b in forward} == forward


def test_boundary_faces_outward(rng: np.random.Generator) -> None:
    # The divergence theorem: the integral of x.n/3 over the boundary is the volume, positive if n points outward.
    mesh = jittered(TetMesh.box((1.0, 0.6, 0.4), cells=(3, 4, 3)), rng, 0.2)
    a, b, c = np.moveaxis(mesh.positions[mesh.boundary_triangles()], 1, 0)
    assert np.einsum("ij,ij->", a, np.cross(b, c)) / 6 == pytest.approx(0.24, rel=1e-12)
    normals, centres = np.cross(b - a, c - a), (a + b + c) / 3
    outward = centres - np.array([0.5, 0.3, 0.2])
    assert (np.einsum("ij,ij->i", normals, outward) > 0).all()


def test_boundary_of_one_tet_is_its_four_faces() -> None:
    triangles = TetMesh(CORNERS, [[0, 1, 2, 3]]).boundary_triangles()
    assert {frozenset(t) for t in triangles.tolist()} == {
        frozenset(f) for f in [(0, 1, 2), (0, 1, 3), (0, 2, 3), (1, 2, 3)]
    }


def test_volumes_add_up(rng: np.random.Generator) -> None:
    mesh = jittered(TetMesh.box((1.0, 0.6, 0.4), cells=(4, 4, 4)), rng, 0.3)
    assert mesh.volumes().min() > 0
    assert mesh.volumes().sum() == pytest.approx(0.24, rel=1e-13)
