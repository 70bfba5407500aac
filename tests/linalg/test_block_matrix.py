from __future__ import annotations

import numpy as np
import pytest

from qlb import TetMesh, _native
from tests.support import dense, multiply, node_blocks


@pytest.fixture
def pattern() -> _native.BlockPattern:
    mesh = TetMesh.box(cells=(2, 2, 1))
    return _native.BlockPattern(len(mesh.positions), mesh.tets)


def test_pattern_holds_the_pairs_of_nodes_that_share_a_tet() -> None:
    mesh = TetMesh.box(cells=(2, 2, 1))
    pattern = _native.BlockPattern(len(mesh.positions), mesh.tets)
    expected = {(i, i) for i in range(len(mesh.positions))}
    expected |= {(int(a), int(b)) for tet in mesh.tets for a in tet for b in tet if a > b}
    rows, columns = node_blocks(pattern)
    assert set(zip(rows.tolist(), columns.tolist(), strict=True)) == expected
    assert pattern.blocks == len(expected)


def test_pattern_has_ascending_rows_with_the_diagonal_first(pattern: _native.BlockPattern) -> None:
    begin, rows = np.asarray(pattern.column_begin), np.asarray(pattern.rows)
    for j in range(pattern.nodes):
        column = rows[begin[j] : begin[j + 1]]
        assert column[0] == j
        assert (np.diff(column) > 0).all()


def test_pattern_refuses_a_node_that_is_not_there() -> None:
    with pytest.raises(ValueError, match=r"node index 4 is outside \[0, 4\)"):
        _native.BlockPattern(4, np.array([[0, 1, 2, 4]], dtype=np.int32))


def test_product_is_that_of_the_dense_matrix(pattern: _native.BlockPattern, rng: np.random.Generator) -> None:
    matrix = _native.BlockMatrix(pattern)
    blocks = rng.normal(size=matrix.values.shape)
    diagonal = np.asarray(pattern.column_begin)[:-1]
    blocks[diagonal] += blocks[diagonal].transpose(0, 2, 1)
    matrix.values[:] = blocks
    x = rng.normal(size=(pattern.nodes, 3))
    expected = dense(matrix, pattern) @ x.ravel()
    np.testing.assert_allclose(multiply(matrix, x).ravel(), expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_shift_adds_to_the_diagonal(pattern: _native.BlockPattern) -> None:
    matrix = _native.BlockMatrix(pattern)
    matrix.values[:] = 1.0
    before = dense(matrix, pattern)
    matrix.shift_diagonal(2.5)
    np.testing.assert_array_equal(dense(matrix, pattern) - before, 2.5 * np.eye(3 * pattern.nodes))


def test_set_zero_clears_every_entry(pattern: _native.BlockPattern) -> None:
    matrix = _native.BlockMatrix(pattern)
    np.testing.assert_array_equal(matrix.values, 0.0)
    matrix.values[:] = 1.0
    matrix.set_zero(2)
    np.testing.assert_array_equal(matrix.values, 0.0)


def test_product_refuses_the_wrong_size(pattern: _native.BlockPattern) -> None:
    with pytest.raises(ValueError, match="has 3 entries"):
        multiply(_native.BlockMatrix(pattern), np.zeros(3))
