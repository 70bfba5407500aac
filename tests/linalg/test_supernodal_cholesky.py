"""What the supernodal factor offers beyond the interface that test_cholesky.py tests."""

from __future__ import annotations

import numpy as np
import pytest
from numpy.typing import NDArray

from qlb import TetMesh, _native
from tests.support import Array, dense, elastic_hessian, jittered, make_system

Mask = NDArray[np.uint8]
PRECISIONS = ["float64", "float32", "compact"]


def hessian(mesh: TetMesh, mass: float = 1e4) -> tuple[_native.BlockPattern, _native.BlockMatrix]:
    """A positive definite Hessian of the mesh, somewhat deformed, for a step of 1e-2 s."""
    system = make_system(mesh, mass="consistent")
    x = mesh.positions + 0.01 * np.random.default_rng(6).normal(size=mesh.positions.shape)
    matrix = elastic_hessian(system, x, project=True)
    system.inertia.add_hessian(mass, matrix)
    return system.pattern, matrix


def two_bodies() -> TetMesh:
    body = TetMesh.box((1.0, 0.6, 0.6), cells=(5, 3, 3))
    count = len(body.positions)
    return TetMesh(
        np.concatenate([body.positions, body.positions + 3.0]), np.concatenate([body.tets, body.tets + count])
    )


MESHES = {
    "one tet": lambda: TetMesh(np.vstack([np.zeros(3), np.eye(3)]), np.array([[0, 1, 2, 3]])),
    "slender": lambda: TetMesh.box((4.0, 0.2, 0.2), cells=(40, 2, 2)),
    "compact": lambda: jittered(TetMesh.box((1.0, 1.0, 1.0), cells=(9, 9, 9)), np.random.default_rng(2), 0.2),
    "two bodies": two_bodies,
}


@pytest.fixture(scope="module", params=list(MESHES))
def mesh(request: pytest.FixtureRequest) -> TetMesh:
    return MESHES[request.param]()


@pytest.fixture(scope="module")
def block() -> TetMesh:
    """Large enough that panels are cut up and that threads share fronts."""
    return TetMesh.box((1.2, 1.0, 1.0), cells=(18, 15, 15))


def nothing_held(mesh: TetMesh) -> Mask:
    return np.zeros(mesh.positions.shape, dtype=np.uint8)


def some_held(mesh: TetMesh) -> Mask:
    """Whole nodes and single axes, by chance."""
    rng = np.random.default_rng(3)
    mask = (rng.random(mesh.positions.shape) < 0.1).astype(np.uint8)
    mask[rng.random(len(mask)) < 0.1] = 1
    return mask


def solve(cholesky: _native.Cholesky, b: Array) -> Array:
    x = np.full_like(b, np.nan)
    cholesky.apply(b, x)
    return x


def residual(matrix: _native.BlockMatrix, mask: Mask, x: Array, b: Array) -> float:
    """|A x - b| / |b| over the free degrees of freedom."""
    product = np.zeros_like(x)
    matrix.multiply(x, product)
    free = mask == 0
    return float(np.linalg.norm((product - b)[free]) / np.linalg.norm(b[free]))


@pytest.mark.parametrize("simd", _native.simd_levels())
@pytest.mark.parametrize("held", [nothing_held, some_held])
def test_solution_is_that_of_cholmod(mesh: TetMesh, held: object, simd: str, rng: np.random.Generator) -> None:
    pattern, matrix = hessian(mesh)
    mask = held(mesh)  # type: ignore[operator]
    reference = _native.CholmodCholesky(pattern, mask, 1)
    b = rng.normal(size=mesh.positions.shape)
    assert reference.factorise(matrix) == -1
    expected = solve(reference, b)
    for precision, tolerance in (("float64", 1e-11), ("float32", 1e-3), ("compact", 1e-2)):
        cholesky = _native.SupernodalCholesky(pattern, mask, 1, precision, simd)
        assert cholesky.factorise(matrix) == -1
        x = solve(cholesky, b)
        np.testing.assert_allclose(x, expected, rtol=0, atol=tolerance * np.abs(expected).max())
        assert residual(matrix, mask, x, b) < {"float64": 1e-12, "float32": 1e-5, "compact": 1e-3}[precision]


def test_avx2_and_avx512_give_the_same_bits(block: TetMesh, rng: np.random.Generator) -> None:
    levels = [level for level in _native.simd_levels() if level.startswith("avx")]
    pattern, matrix = hessian(block)
    b, found = rng.normal(size=block.positions.shape), []
    for level in levels:
        cholesky = _native.SupernodalCholesky(pattern, some_held(block), 1, "float64", level)
        cholesky.factorise(matrix)
        y = np.empty(cholesky.rows)
        cholesky.forward(b, y)
        found.append(y)
    for y in found[1:]:
        np.testing.assert_array_equal(y, found[0])


@pytest.mark.parametrize("precision", PRECISIONS)
def test_bits_do_not_depend_on_the_number_of_threads(block: TetMesh, precision: str, rng: np.random.Generator) -> None:
    pattern, matrix = hessian(block)
    b = rng.normal(size=(11, *block.positions.shape))
    found = []
    for threads in (1, 2, 3, 8):
        cholesky = _native.SupernodalCholesky(pattern, some_held(block), threads, precision)
        assert cholesky.factorise(matrix) == -1
        x = np.empty_like(b)
        cholesky.solve(b, x)
        found.append((solve(cholesky, b[0]), x))
    for one, many in found[1:]:
        np.testing.assert_array_equal(one, found[0][0])
        np.testing.assert_array_equal(many, found[0][1])


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("precision", PRECISIONS)
def test_several_right_hand_sides_are_solved_like_one(
    mesh: TetMesh, precision: str, threads: int, rng: np.random.Generator
) -> None:
    pattern, matrix = hessian(mesh)
    cholesky = _native.SupernodalCholesky(pattern, some_held(mesh), threads, precision)
    cholesky.factorise(matrix)
    tolerance = 1e-12 if precision == "float64" else 1e-3
    for count in (1, 2, 8, 9, 19):
        b = rng.normal(size=(count, *mesh.positions.shape))
        x = np.full_like(b, np.nan)
        cholesky.solve(b, x)
        each = np.stack([solve(cholesky, side) for side in b])
        np.testing.assert_allclose(x, each, rtol=0, atol=tolerance * np.abs(each).max())


@pytest.mark.parametrize("precision", PRECISIONS)
def test_half_solves_make_a_whole(mesh: TetMesh, precision: str, rng: np.random.Generator) -> None:
    pattern, matrix = hessian(mesh)
    cholesky = _native.SupernodalCholesky(pattern, some_held(mesh), 1, precision)
    cholesky.factorise(matrix)
    b = rng.normal(size=mesh.positions.shape)
    y, x = np.full(cholesky.rows, np.nan), np.full_like(b, np.nan)
    cholesky.forward(b, y)
    cholesky.backward(y, x)
    np.testing.assert_array_equal(x, solve(cholesky, b))
    # |L^-1 P b|^2 = b.A^-1 b
    assert y @ y == pytest.approx(float((b * x).sum()), rel=1e-12 if precision == "float64" else 1e-4)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_half_solve_inverts_the_factor_of_the_permuted_matrix(precision: str, rng: np.random.Generator) -> None:
    mesh = TetMesh.box(cells=(4, 3, 2))
    pattern, matrix = hessian(mesh)
    cholesky = _native.SupernodalCholesky(pattern, some_held(mesh), 1, precision)
    cholesky.factorise(matrix)
    order = cholesky.order
    np.testing.assert_array_equal(np.sort(order), np.flatnonzero(some_held(mesh).ravel() == 0))
    L = np.linalg.cholesky(dense(matrix, pattern)[np.ix_(order, order)])
    b, y = rng.normal(size=mesh.positions.shape), np.empty(cholesky.rows)
    cholesky.forward(b, y)
    expected = np.linalg.solve(L, b.ravel()[order])
    tolerance = 1e-12 if precision == "float64" else 1e-4
    np.testing.assert_allclose(y, expected, rtol=0, atol=tolerance * np.abs(expected).max())


@pytest.mark.parametrize("threads", [1, 2])
@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_sparse_half_solve_is_the_dense_one(
    mesh: TetMesh, precision: str, threads: int, rng: np.random.Generator
) -> None:
    pattern, matrix = hessian(mesh)
    mask = some_held(mesh)
    cholesky = _native.SupernodalCholesky(pattern, mask, threads, precision)
    cholesky.factorise(matrix)
    size = mesh.positions.size
    for count in (0, 1, 3, size):
        dofs = rng.integers(0, size, count)  # some held, some twice
        values = rng.normal(size=count)
        b, y = np.zeros(size), np.empty(cholesky.rows)
        np.add.at(b, dofs, values.astype("float64" if precision == "float64" else "float32"))
        cholesky.forward(b, y)
        rows, found = cholesky.forward_sparse(dofs, values)
        assert np.all(np.diff(rows) > 0)
        scattered = np.zeros(cholesky.rows)
        scattered[rows] = found
        np.testing.assert_allclose(scattered, y, rtol=0, atol=1e-6 * np.abs(y).max(initial=1.0))
        if count == 1:
            np.testing.assert_array_equal(scattered, y)


def test_a_sparse_half_solve_stays_on_the_path_to_the_root() -> None:
    pattern, matrix = hessian(two_bodies())
    count = pattern.nodes // 2
    cholesky = _native.SupernodalCholesky(pattern, np.zeros((2 * count, 3), dtype=np.uint8), 1, "float64")
    cholesky.factorise(matrix)
    rows, _ = cholesky.forward_sparse(np.array([5]), np.array([1.0]))
    assert 0 < len(rows) < cholesky.rows
    assert np.all(cholesky.order[rows] < 3 * count)


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("threads", [1, 2])
def test_the_first_pivot_that_fails_is_named(precision: str, threads: int, rng: np.random.Generator) -> None:
    mesh = TetMesh.box(cells=(12, 7, 7))
    pattern, matrix = hessian(mesh)
    diagonal = np.asarray(pattern.column_begin)[:-1]
    for node in rng.integers(0, len(diagonal), 4):  # several are wrong: the first in elimination order counts
        matrix.values[diagonal[node], 1, 1] -= 2.0 * np.abs(matrix.values).max()
    cholesky = _native.SupernodalCholesky(pattern, some_held(mesh), threads, precision)
    dof = cholesky.factorise(matrix)
    order = list(cholesky.order)
    place = order.index(dof)
    A = dense(matrix, pattern)
    before, through = order[:place], order[: place + 1]
    np.linalg.cholesky(A[np.ix_(before, before)])
    with pytest.raises(np.linalg.LinAlgError):
        np.linalg.cholesky(A[np.ix_(through, through)])


@pytest.mark.parametrize("precision", PRECISIONS)
@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf])
def test_what_is_not_finite_is_reported_wherever_it_stands(mesh: TetMesh, precision: str, bad: float) -> None:
    pattern, matrix = hessian(mesh)
    cholesky = _native.SupernodalCholesky(pattern, nothing_held(mesh), 2, precision)
    values = matrix.values.copy()
    for block in np.random.default_rng(0).integers(0, pattern.blocks, 12):
        for a, b in ((0, 0), (2, 1)):
            matrix.values[block, a, b] = matrix.values[block, b, a] = bad
            assert cholesky.factorise(matrix) >= 0
            matrix.values[:] = values
    assert cholesky.factorise(matrix) == -1


def test_what_overflows_in_float_is_reported() -> None:
    pattern, matrix = hessian(TetMesh.box(cells=(2, 2, 2)))
    matrix.values[:] *= 1e60
    mask = np.zeros((pattern.nodes, 3), dtype=np.uint8)
    assert _native.SupernodalCholesky(pattern, mask, 1, "float64").factorise(matrix) == -1
    assert _native.SupernodalCholesky(pattern, mask, 1, "float32").factorise(matrix) >= 0


@pytest.mark.parametrize("precision", PRECISIONS)
def test_it_factorises_again_after_a_failure(block: TetMesh, precision: str) -> None:
    pattern, matrix = hessian(block)
    cholesky = _native.SupernodalCholesky(pattern, some_held(block), 2, precision)
    b = np.ones_like(block.positions)
    cholesky.factorise(matrix)
    good = solve(cholesky, b)
    for spoiled in (np.nan, -1.0):
        values = matrix.values.copy()
        matrix.values[:] *= spoiled
        assert cholesky.factorise(matrix) >= 0
        with pytest.raises(RuntimeError, match="factorise first"):
            cholesky.forward(b, np.empty(cholesky.rows))
        matrix.values[:] = values
        assert cholesky.factorise(matrix) == -1
        np.testing.assert_array_equal(solve(cholesky, b), good)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_nothing_free_and_one_node_free(precision: str) -> None:
    mesh = TetMesh.box(cells=(2, 2, 2))
    pattern, matrix = hessian(mesh)
    mask = np.ones(mesh.positions.shape, dtype=np.uint8)
    b = np.ones_like(mesh.positions)
    empty = _native.SupernodalCholesky(pattern, mask, 2, precision)
    assert empty.factorise(matrix) == -1
    np.testing.assert_array_equal(solve(empty, b), 0.0)
    assert empty.rows == empty.factor_nonzeros == 0
    mask[3] = 0
    single = _native.SupernodalCholesky(pattern, mask, 2, precision)
    assert single.factorise(matrix) == -1
    block = dense(matrix, pattern)[9:12, 9:12]
    np.testing.assert_allclose(solve(single, b)[3], np.linalg.solve(block, np.ones(3)), rtol=1e-5)


@pytest.mark.parametrize("precision", PRECISIONS)
def test_a_pattern_without_couplings(precision: str, rng: np.random.Generator) -> None:
    pattern = _native.BlockPattern(50, np.zeros((0, 4), dtype=np.int32))
    matrix = _native.BlockMatrix(pattern)
    matrix.values[:] = np.eye(3) * rng.uniform(1, 2, size=(50, 1, 1))
    cholesky = _native.SupernodalCholesky(pattern, np.zeros((50, 3), dtype=np.uint8), 2, precision)
    assert cholesky.factorise(matrix) == -1
    b = rng.normal(size=(50, 3))
    np.testing.assert_allclose(solve(cholesky, b), b / matrix.values[:, 0, :1], rtol=1e-6)


def test_misuse_is_refused(mesh: TetMesh) -> None:
    pattern, matrix = hessian(mesh)
    mask = nothing_held(mesh)
    with pytest.raises(ValueError, match="precision is 'compact', 'float32' or 'float64', not 'half'"):
        _native.SupernodalCholesky(pattern, mask, 1, "half")
    with pytest.raises(ValueError, match="SIMD level 'mmx' is not available"):
        _native.SupernodalCholesky(pattern, mask, 1, "float32", "mmx")
    cholesky = _native.SupernodalCholesky(pattern, mask, 1, "float64")
    dofs, values = np.array([0]), np.array([1.0])
    with pytest.raises(RuntimeError, match="factorise first"):
        cholesky.forward_sparse(dofs, values)
    cholesky.factorise(matrix)
    with pytest.raises(ValueError, match="y has 1 entries"):
        cholesky.forward(np.ones_like(mesh.positions), np.empty(1))
    with pytest.raises(ValueError, match="whole right-hand sides"):
        cholesky.solve(np.ones(4), np.empty(4))
    with pytest.raises(ValueError, match="one value per degree of freedom"):
        cholesky.forward_sparse(dofs, np.ones(2))
    for dof in (-1, mesh.positions.size):
        with pytest.raises(IndexError, match="does not exist"):
            cholesky.forward_sparse(np.array([dof]), values)


def test_sizes_of_the_factor_add_up(mesh: TetMesh) -> None:
    pattern, _ = hessian(mesh)
    single, double = (_native.SupernodalCholesky(pattern, nothing_held(mesh), 1, p) for p in ("float32", "float64"))
    reference = _native.CholmodCholesky(pattern, nothing_held(mesh), 1)
    assert single.factor_nonzeros == double.factor_nonzeros
    assert reference.factor_nonzeros <= 1.1 * single.factor_nonzeros
    assert double.solve_bytes == 2 * single.solve_bytes == 16 * double.factor_nonzeros
    assert double.bytes == pytest.approx(2 * single.bytes, rel=0.01)
    assert double.bytes > 8 * double.factor_nonzeros


def test_another_precision_can_be_taken_up(block: TetMesh, rng: np.random.Generator) -> None:
    pattern, matrix = hessian(block)
    mask, b = some_held(block), rng.normal(size=block.positions.shape)
    fresh = _native.SupernodalCholesky(pattern, mask, 1, "float64")
    changed = _native.SupernodalCholesky(pattern, mask, 1, "float32")
    changed.factorise(matrix)
    changed.set_precision("float64")
    with pytest.raises(RuntimeError, match="factorise first"):
        solve(changed, b)
    assert fresh.factorise(matrix) == changed.factorise(matrix) == -1
    np.testing.assert_array_equal(solve(fresh, b), solve(changed, b))


@pytest.mark.parametrize("scale", [1e-60, 1e60])
def test_right_hand_sides_beyond_the_range_of_float_are_solved_as_well(
    block: TetMesh, scale: float, rng: np.random.Generator
) -> None:
    pattern, matrix = hessian(block)
    b = rng.normal(size=block.positions.shape)
    cholesky = _native.SupernodalCholesky(pattern, some_held(block), 1, "compact")
    cholesky.factorise(matrix)
    x = solve(cholesky, b)
    np.testing.assert_allclose(solve(cholesky, scale * b) / scale, x, rtol=0, atol=1e-5 * np.abs(x).max())


@pytest.mark.parametrize("held", [nothing_held, some_held])
def test_a_given_order_solves_the_same(mesh: TetMesh, held: object, rng: np.random.Generator) -> None:
    pattern, matrix = hessian(mesh)
    mask = held(mesh)  # type: ignore[operator]
    own = _native.SupernodalCholesky(pattern, mask, 1, "float64")
    np.testing.assert_array_equal(np.sort(own.node_order), np.arange(pattern.nodes))
    again = _native.SupernodalCholesky(pattern, mask, 1, "float64", order=own.node_order)
    other = rng.permutation(pattern.nodes).astype(np.int32)
    shuffled = _native.SupernodalCholesky(pattern, mask, 1, "float64", order=other)
    b, found = rng.normal(size=mesh.positions.shape), []
    for cholesky in (own, again, shuffled):
        assert cholesky.factorise(matrix) == -1
        found.append(solve(cholesky, b))
    np.testing.assert_array_equal(found[1], found[0])
    np.testing.assert_array_equal(again.node_order, own.node_order)
    np.testing.assert_array_equal(shuffled.node_order, other)
    np.testing.assert_allclose(found[2], found[0], rtol=0, atol=1e-11 * np.abs(found[0]).max())


def test_an_extended_pattern_reuses_the_order(rng: np.random.Generator) -> None:
    mesh = MESHES["compact"]()
    pattern, matrix = hessian(mesh)
    own = _native.SupernodalCholesky(pattern, some_held(mesh), 1, "float64")
    extra = rng.integers(0, pattern.nodes, size=(5, 4), dtype=np.int32)
    outer = _native.BlockPattern(pattern.nodes, np.concatenate([mesh.tets, extra]))
    larger = _native.BlockMatrix(outer)
    larger.set_from(_native.PatternMap(pattern, outer), matrix)
    a = rng.normal(size=(5, 12))
    larger.add_stencils(extra, 1e3 * a[:, :, None] * a[:, None, :])
    cholesky = _native.SupernodalCholesky(outer, some_held(mesh), 1, "float64", order=own.node_order)
    assert cholesky.factorise(larger) == -1
    b = rng.normal(size=mesh.positions.shape)
    assert residual(larger, some_held(mesh), solve(cholesky, b), b) < 1e-12
    assert own.factor_nonzeros <= cholesky.factor_nonzeros < 2 * own.factor_nonzeros


@pytest.mark.parametrize("order", [[0, 1, 2], [0, 1, 2, 2], [0, 1, 2, 4], [-1, 0, 1, 2]])
def test_an_order_that_is_none_is_refused(order: list[int]) -> None:
    pattern, _ = hessian(MESHES["one tet"]())
    message = "order has 3 nodes, expected all 4" if len(order) == 3 else r"order holds node -?\d twice or outside"
    given = np.array(order, dtype=np.int32)
    with pytest.raises(ValueError, match=message):
        _native.SupernodalCholesky(pattern, np.zeros((4, 3), dtype=np.uint8), 1, "float64", order=given)
