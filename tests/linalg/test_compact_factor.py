"""The compact factor: float32, with a copy in 16 bits that solves for one vector read."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import TetMesh, _native
from tests.linalg.test_supernodal_cholesky import hessian, nothing_held, residual, solve, some_held

BLOCK = TetMesh.box((1.2, 1.0, 1.0), cells=(18, 15, 15))


@pytest.mark.slow
def test_bits_of_a_large_compact_factor_do_not_depend_on_threads_either(rng: np.random.Generator) -> None:
    mesh = TetMesh.box((1.0, 1.0, 1.0), cells=(26, 26, 26))
    pattern, matrix = hessian(mesh)
    b, found = rng.normal(size=mesh.positions.shape), []
    for threads in (1, 2):
        cholesky = _native.SupernodalCholesky(pattern, nothing_held(mesh), threads, "compact")
        assert cholesky.factor_nonzeros > 2e7  # smaller ones are solved by one thread
        assert cholesky.factorise(matrix) == -1
        found.append(solve(cholesky, b))
    np.testing.assert_array_equal(found[1], found[0])
    assert residual(matrix, nothing_held(mesh), found[0], b) < 1e-3


def test_solves_of_a_compact_factor_read_half_of_it() -> None:
    pattern, _ = hessian(BLOCK)
    single, compact = (_native.SupernodalCholesky(pattern, nothing_held(BLOCK), 1, p) for p in ("float32", "compact"))
    assert compact.precision == "compact"
    assert compact.solve_bytes < 0.6 * single.solve_bytes
    assert compact.bytes == single.bytes + compact.solve_bytes // 2


@pytest.mark.parametrize("power", [-40, 40])
def test_entries_in_16_bits_go_by_their_size_in_their_column(power: int, rng: np.random.Generator) -> None:
    """So the factor of 4^k A is 2^k times that of A, to the bit."""
    pattern, matrix = hessian(BLOCK)
    b = rng.normal(size=BLOCK.positions.shape)
    cholesky = _native.SupernodalCholesky(pattern, some_held(BLOCK), 1, "compact")
    cholesky.factorise(matrix)
    x = solve(cholesky, b)
    matrix.values[...] *= 2.0**power
    assert cholesky.factorise(matrix) == -1
    np.testing.assert_array_equal(solve(cholesky, b) * 2.0**power, x)
