"""Every Cholesky factor solves as NumPy and SciPy do, leaves out held degrees of freedom, and names a bad pivot."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest
import scipy.sparse
import scipy.sparse.linalg
from numpy.typing import NDArray

from qlb import TetMesh, _native
from tests.support import Array, dense, elastic_hessian, jittered, make_system, node_blocks

Analyse = Callable[[_native.BlockPattern, NDArray[np.uint8], int], _native.Cholesky]


def supernodal(pattern: _native.BlockPattern, fixed: NDArray[np.uint8], threads: int) -> _native.SupernodalCholesky:
    return _native.SupernodalCholesky(pattern, fixed, threads, "float64")


KINDS: dict[str, Analyse] = {"cholmod": _native.CholmodCholesky, "supernodal": supernodal}
SELECTIONS = ["none", "one end", "single axes", "all but one", "all"]


@pytest.fixture(params=list(KINDS))
def analyse(request: pytest.FixtureRequest) -> Analyse:
    """The kind of factor under test."""
    return KINDS[request.param]


@pytest.fixture(scope="module")
def mesh() -> TetMesh:
    return jittered(TetMesh.box((1.0, 0.8, 0.7), cells=(4, 3, 3)), np.random.default_rng(5), 0.2)


@pytest.fixture(scope="module")
def matrix(mesh: TetMesh) -> _native.BlockMatrix:
    """A positive definite Hessian: elasticity of a bent body and some mass."""
    system = make_system(mesh, mass="consistent")
    x = mesh.positions + 0.02 * np.random.default_rng(6).normal(size=mesh.positions.shape)
    result = elastic_hessian(system, x, project=True)
    system.inertia.add_hessian(10.0, result)
    return result


@pytest.fixture(params=SELECTIONS)
def fixed(request: pytest.FixtureRequest, mesh: TetMesh) -> NDArray[np.uint8]:
    mask = np.zeros(mesh.positions.shape, dtype=np.uint8)
    mask[mesh.positions[:, 0] < 1e-9] = {"none": (0, 0, 0), "single axes": (1, 0, 0)}.get(request.param, (1, 1, 1))
    if request.param == "single axes":
        mask[mesh.positions[:, 1] < 1e-9, 1] = 1
        mask[5] = (0, 1, 1)
    if request.param in ("all but one", "all"):
        mask[:] = 1
    if request.param == "all but one":
        mask[17] = (1, 0, 1)
    return mask


def pattern_of(mesh: TetMesh) -> _native.BlockPattern:
    return _native.BlockPattern(len(mesh.positions), mesh.tets)


def copied(matrix: _native.BlockMatrix, pattern: _native.BlockPattern) -> _native.BlockMatrix:
    result = _native.BlockMatrix(pattern)
    result.values[:] = matrix.values
    return result


def solve(cholesky: _native.Cholesky, b: Array) -> Array:
    x = np.full_like(b, np.nan)
    cholesky.apply(b, x)
    return x


@pytest.mark.parametrize("threads", [1, 2])
def test_solution_is_that_of_numpy(
    analyse: Analyse,
    mesh: TetMesh,
    matrix: _native.BlockMatrix,
    fixed: NDArray[np.uint8],
    threads: int,
    rng: np.random.Generator,
) -> None:
    pattern = pattern_of(mesh)
    cholesky = analyse(pattern, fixed, threads)
    A = copied(matrix, pattern)
    assert cholesky.factorise(A) == -1
    b = rng.normal(size=mesh.positions.shape)
    x = solve(cholesky, b)
    free = fixed.ravel() == 0
    expected = np.zeros(b.size)
    expected[free] = np.linalg.solve(dense(A, pattern)[np.ix_(free, free)], b.ravel()[free])
    np.testing.assert_allclose(x.ravel(), expected, rtol=0, atol=1e-11 * np.abs(expected).max(initial=1e-300))


def test_solution_is_that_of_scipy_on_a_larger_mesh(analyse: Analyse, rng: np.random.Generator) -> None:
    mesh = TetMesh.box((1.0, 0.5, 0.5), cells=(12, 6, 6))
    system = make_system(mesh)
    A = elastic_hessian(system, mesh.positions, project=True)
    system.inertia.add_hessian(1.0, A)
    rows, columns = node_blocks(system.pattern)
    lower = rows != columns
    i, j = np.concatenate([rows, columns[lower]]), np.concatenate([columns, rows[lower]])
    blocks = np.concatenate([A.values, A.values[lower].transpose(0, 2, 1)])
    row = np.broadcast_to(3 * i[:, None, None] + np.arange(3)[:, None], blocks.shape)
    column = np.broadcast_to(3 * j[:, None, None] + np.arange(3), blocks.shape)
    sparse = scipy.sparse.csc_matrix((blocks.ravel(), (row.ravel(), column.ravel())))
    cholesky = analyse(system.pattern, np.zeros(mesh.positions.shape, dtype=np.uint8), 1)
    assert cholesky.factorise(A) == -1
    b = rng.normal(size=mesh.positions.shape)
    expected = scipy.sparse.linalg.spsolve(sparse, b.ravel())
    np.testing.assert_allclose(solve(cholesky, b).ravel(), expected, rtol=0, atol=1e-10 * np.abs(expected).max())


def test_held_degrees_of_freedom_are_zero_and_do_not_count(
    analyse: Analyse, mesh: TetMesh, matrix: _native.BlockMatrix, fixed: NDArray[np.uint8], rng: np.random.Generator
) -> None:
    pattern = pattern_of(mesh)
    cholesky = analyse(pattern, fixed, 1)
    cholesky.factorise(copied(matrix, pattern))
    b = rng.normal(size=mesh.positions.shape)
    x = solve(cholesky, b)
    np.testing.assert_array_equal(x[fixed == 1], 0.0)
    np.testing.assert_array_equal(solve(cholesky, np.where(fixed == 1, 1e9, b)), x)


def test_solve_before_a_factor_is_refused(analyse: Analyse, mesh: TetMesh) -> None:
    cholesky = analyse(pattern_of(mesh), np.zeros_like(mesh.positions, dtype=np.uint8), 1)
    with pytest.raises(RuntimeError, match="factorise first"):
        solve(cholesky, np.ones_like(mesh.positions))


def test_factor_of_another_pattern_is_refused(analyse: Analyse, mesh: TetMesh, matrix: _native.BlockMatrix) -> None:
    cholesky = analyse(pattern_of(mesh), np.zeros_like(mesh.positions, dtype=np.uint8), 1)
    with pytest.raises(ValueError, match="another pattern"):
        cholesky.factorise(matrix)


def test_wrong_sizes_are_refused(analyse: Analyse, mesh: TetMesh, matrix: _native.BlockMatrix) -> None:
    pattern = pattern_of(mesh)
    with pytest.raises(ValueError, match="one entry per degree of freedom"):
        analyse(pattern, np.zeros(7, dtype=np.uint8), 1)
    cholesky = analyse(pattern, np.zeros_like(mesh.positions, dtype=np.uint8), 1)
    cholesky.factorise(copied(matrix, pattern))
    with pytest.raises(ValueError, match="has 3 entries, expected 240"):
        solve(cholesky, np.ones((1, 3)))


def test_the_same_object_factorises_again(
    analyse: Analyse, mesh: TetMesh, matrix: _native.BlockMatrix, rng: np.random.Generator
) -> None:
    pattern = pattern_of(mesh)
    cholesky = analyse(pattern, np.zeros_like(mesh.positions, dtype=np.uint8), 1)
    A, b = copied(matrix, pattern), rng.normal(size=mesh.positions.shape)
    cholesky.factorise(A)
    first = solve(cholesky, b)
    A.values[:] *= 4
    np.testing.assert_array_equal(solve(cholesky, b), first)
    cholesky.factorise(A)
    np.testing.assert_allclose(solve(cholesky, b), first / 4, rtol=1e-12)
    A.values[:] /= 4
    cholesky.factorise(A)
    np.testing.assert_array_equal(solve(cholesky, b), first)


def islands(values: Array) -> tuple[_native.BlockPattern, _native.BlockMatrix]:
    """One 3x3 block per node and no coupling."""
    pattern = _native.BlockPattern(len(values), np.zeros((0, 4), dtype=np.int32))
    matrix = _native.BlockMatrix(pattern)
    matrix.values[:] = values
    return pattern, matrix


@pytest.mark.parametrize("bad", [(0, 0), (3, 1), (9, 2)])
def test_a_negative_pivot_is_named(analyse: Analyse, bad: tuple[int, int]) -> None:
    node, axis = bad
    blocks = np.tile(2.0 * np.eye(3), (10, 1, 1))
    blocks[node, axis, axis] = -1.0
    pattern, matrix = islands(blocks)
    cholesky = analyse(pattern, np.zeros((10, 3), dtype=np.uint8), 1)
    assert cholesky.factorise(matrix) == 3 * node + axis


def test_a_zero_pivot_is_named(analyse: Analyse) -> None:
    blocks = np.tile(2.0 * np.eye(3), (4, 1, 1))
    blocks[2, 0, 0] = 0.0
    pattern, matrix = islands(blocks)
    assert analyse(pattern, np.zeros((4, 3), dtype=np.uint8), 1).factorise(matrix) == 6


@pytest.mark.parametrize("node", [0, 11, 40, 79])
def test_a_negative_pivot_of_a_whole_mesh_is_at_the_node_that_is_wrong(
    analyse: Analyse, mesh: TetMesh, matrix: _native.BlockMatrix, node: int
) -> None:
    pattern = pattern_of(mesh)
    A = copied(matrix, pattern)
    diagonal = np.asarray(pattern.column_begin)[node]
    A.values[diagonal, 1, 1] -= 1e3 * np.abs(A.values).max()
    cholesky = analyse(pattern, np.zeros_like(mesh.positions, dtype=np.uint8), 1)
    assert cholesky.factorise(A) == 3 * node + 1


@pytest.mark.parametrize("fixed", SELECTIONS[:-1], indirect=True)
def test_a_pivot_among_held_nodes_is_named_by_its_place_in_the_mesh(
    analyse: Analyse, mesh: TetMesh, matrix: _native.BlockMatrix, fixed: NDArray[np.uint8]
) -> None:
    free = np.flatnonzero(fixed.ravel() == 0)
    dof = int(free[len(free) // 2])
    pattern = pattern_of(mesh)
    A = copied(matrix, pattern)
    A.values[np.asarray(pattern.column_begin)[dof // 3], dof % 3, dof % 3] -= 1e3 * np.abs(A.values).max()
    assert analyse(pattern, fixed, 1).factorise(A) == dof


def test_an_indefinite_held_part_does_not_matter(analyse: Analyse, mesh: TetMesh, matrix: _native.BlockMatrix) -> None:
    pattern = pattern_of(mesh)
    A = copied(matrix, pattern)
    A.values[np.asarray(pattern.column_begin)[7], 2, 2] = -1e9
    mask = np.zeros_like(mesh.positions, dtype=np.uint8)
    mask[7, 2] = 1
    assert analyse(pattern, mask, 1).factorise(A) == -1


def test_a_failed_factor_cannot_solve_until_it_succeeds(
    analyse: Analyse, mesh: TetMesh, matrix: _native.BlockMatrix
) -> None:
    pattern = pattern_of(mesh)
    A = copied(matrix, pattern)
    cholesky = analyse(pattern, np.zeros_like(mesh.positions, dtype=np.uint8), 1)
    b = np.ones_like(mesh.positions)
    assert cholesky.factorise(A) == -1
    good = solve(cholesky, b)
    A.values[:] *= -1
    assert cholesky.factorise(A) >= 0
    with pytest.raises(RuntimeError, match="factorise first"):
        solve(cholesky, b)
    A.values[:] *= -1
    assert cholesky.factorise(A) == -1
    np.testing.assert_array_equal(solve(cholesky, b), good)


def test_a_matrix_that_is_not_finite_is_not_positive_definite(
    analyse: Analyse, mesh: TetMesh, matrix: _native.BlockMatrix
) -> None:
    pattern = pattern_of(mesh)
    A = copied(matrix, pattern)
    A.values[3, 0, 0] = np.nan
    cholesky = analyse(pattern, np.zeros_like(mesh.positions, dtype=np.uint8), 1)
    assert cholesky.factorise(A) >= 0


def test_factor_sizes_are_plausible(analyse: Analyse, mesh: TetMesh) -> None:
    n = mesh.positions.size
    cholesky = analyse(pattern_of(mesh), np.zeros_like(mesh.positions, dtype=np.uint8), 1)
    pattern = pattern_of(mesh)
    entries = 9 * (pattern.blocks - pattern.nodes) + 6 * pattern.nodes
    assert entries <= cholesky.factor_nonzeros <= n * (n + 1) // 2
    assert cholesky.factor_flops >= cholesky.factor_nonzeros
