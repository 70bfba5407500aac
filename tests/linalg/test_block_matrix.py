"""The block-sparse matrix does what the dense one does."""

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


def test_pattern_knows_which_stencils_it_holds(pattern: _native.BlockPattern, rng: np.random.Generator) -> None:
    rows, columns = node_blocks(pattern)
    there = np.zeros((pattern.nodes, pattern.nodes), dtype=bool)
    there[rows, columns] = there[columns, rows] = True
    stencils = rng.integers(pattern.nodes, size=(300, 4)).astype(np.int32)
    stencils[:100, 2:] = stencils[:100, :1]  # some repeat a node, as those of planes do
    stencils[100:150] = TetMesh.box(cells=(2, 2, 1)).tets[rng.integers(24, size=50)]
    held = np.empty(len(stencils), dtype=np.uint8)
    pattern.holds(stencils, held)
    expected = there[stencils[:, :, None], stencils[:, None, :]].all(axis=(1, 2))
    np.testing.assert_array_equal(held != 0, expected)
    assert 50 < expected.sum() < 250


def test_pattern_refuses_stencils_that_make_no_sense(pattern: _native.BlockPattern) -> None:
    held = np.empty(1, dtype=np.uint8)
    with pytest.raises(ValueError, match=r"node index -1 is outside \[0, 18\)"):
        pattern.holds(np.array([[0, 1, 2, -1]], dtype=np.int32), held)
    with pytest.raises(ValueError, match="out has 1 entries"):
        pattern.holds(np.zeros((2, 4), dtype=np.int32), held)
    with pytest.raises(ValueError, match="four entries"):
        pattern.holds(np.zeros((1, 3), dtype=np.int32), held)


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


def random_matrix(pattern: _native.BlockPattern, rng: np.random.Generator) -> _native.BlockMatrix:
    matrix = _native.BlockMatrix(pattern)
    blocks = rng.normal(size=matrix.values.shape)
    diagonal = np.asarray(pattern.column_begin)[:-1]
    blocks[diagonal] += blocks[diagonal].transpose(0, 2, 1)
    matrix.values[:] = blocks
    return matrix


def test_stencils_add_up_like_dense_matrices(pattern: _native.BlockPattern, rng: np.random.Generator) -> None:
    nodes = rng.integers(0, pattern.nodes, size=(50, 4), dtype=np.int32)
    nodes[::4] = nodes[::4, :1]  # a contact with a plane repeats its node
    nodes[1::4, 3] = nodes[1::4, 0]
    blocks = rng.normal(size=(50, 12, 12))
    blocks += blocks.transpose(0, 2, 1)
    larger = _native.BlockPattern(pattern.nodes, nodes)
    matrix = random_matrix(larger, rng)
    expected = dense(matrix, larger)
    for stencil, block in zip(nodes, blocks, strict=True):
        dofs = (3 * stencil[:, None] + np.arange(3)).ravel()
        np.add.at(expected, np.ix_(dofs, dofs), block)
    matrix.add_stencils(nodes, blocks)
    np.testing.assert_allclose(dense(matrix, larger), expected, rtol=0, atol=1e-13 * np.abs(expected).max())


def test_rank_one_terms_add_up_like_dense_matrices(pattern: _native.BlockPattern, rng: np.random.Generator) -> None:
    nodes = np.array([[0, 5, 2, 7], [3, 3, 1, 3], [8, 2, 0, 5]], dtype=np.int32)
    larger = _native.BlockPattern(pattern.nodes, np.concatenate([TetMesh.box(cells=(2, 2, 1)).tets, nodes]))
    matrix, left_out = random_matrix(larger, rng), np.zeros(pattern.nodes, dtype=np.uint8)
    left_out[[2, 8]] = 1
    vectors, stiffness = rng.normal(size=(3, 4, 3)), np.array([2.0, -0.5, 3.0])
    expected = dense(matrix, larger)
    for stencil, a, k in zip(nodes, vectors, stiffness, strict=True):
        whole = np.zeros((pattern.nodes, 3))
        np.add.at(whole, stencil, a)
        whole[left_out == 1] = 0.0
        expected += k * np.outer(whole, whole)
    matrix.add_rank_one(_native.RankOneTerms(nodes, vectors, stiffness), left_out)
    np.testing.assert_allclose(dense(matrix, larger), expected, rtol=0, atol=1e-13 * np.abs(expected).max())
    with pytest.raises(ValueError, match="left_out has 1 entries"):
        matrix.add_rank_one(_native.RankOneTerms(nodes, vectors, stiffness), left_out[:1])


def test_stencils_that_do_not_fit_are_refused() -> None:
    matrix = _native.BlockMatrix(_native.BlockPattern(4, np.array([[0, 1]], dtype=np.int32)))
    with pytest.raises(IndexError, match=r"block \(2, 0\) is not in the pattern"):
        matrix.add_stencils(np.array([[0, 1, 2, 1]], dtype=np.int32), np.zeros((1, 12, 12)))
    for node in (-1, 4):
        with pytest.raises(IndexError, match=r"stencil 1 has a node outside \[0, 4\)"):
            matrix.add_stencils(np.array([[0, 0, 0, 0], [node] * 4], dtype=np.int32), np.zeros((2, 12, 12)))
    with pytest.raises(ValueError, match="blocks has 144 entries, expected 288"):
        matrix.add_stencils(np.zeros((2, 4), dtype=np.int32), np.zeros((1, 12, 12)))


def test_a_matrix_over_a_smaller_pattern_is_taken_over(pattern: _native.BlockPattern, rng: np.random.Generator) -> None:
    mesh = TetMesh.box(cells=(2, 2, 1))
    extra = rng.integers(0, pattern.nodes, size=(6, 4), dtype=np.int32)
    outer = _native.BlockPattern(pattern.nodes, np.concatenate([mesh.tets, extra]))
    assert outer.blocks > pattern.blocks
    small, large = random_matrix(pattern, rng), random_matrix(outer, rng)
    mapped = _native.PatternMap(pattern, outer)
    for _ in range(2):
        large.set_from(mapped, small)
        np.testing.assert_array_equal(dense(large, outer), dense(small, pattern))
        large.values[:] = np.nan


def test_patterns_that_do_not_fit_are_refused(pattern: _native.BlockPattern) -> None:
    bare = _native.BlockPattern(pattern.nodes, np.zeros((0, 4), dtype=np.int32))
    with pytest.raises(ValueError, match="outer pattern lacks block"):
        _native.PatternMap(pattern, bare)
    with pytest.raises(ValueError, match="have 3 and"):
        _native.PatternMap(_native.BlockPattern(3, np.zeros((0, 4), dtype=np.int32)), pattern)
    with pytest.raises(ValueError, match="other patterns"):
        _native.BlockMatrix(pattern).set_from(_native.PatternMap(bare, pattern), _native.BlockMatrix(pattern))
