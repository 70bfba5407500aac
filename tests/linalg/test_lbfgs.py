"""The two-loop recursion against the dense BFGS update of the inverse Hessian, by numpy."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import TetMesh, _native
from tests.support import Array, dense, elastic_hessian, make_system

WINDOW = 4
Pair = tuple[Array, Array]


@pytest.fixture(scope="module")
def inner() -> tuple[_native.Cholesky, Array]:
    """A factor, and its dense inverse with zero rows at the held degrees of freedom."""
    mesh = TetMesh.box(cells=(2, 1, 1))
    system = make_system(mesh)
    matrix = elastic_hessian(system, mesh.positions, project=True)
    system.inertia.add_hessian(100.0, matrix)
    fixed = np.zeros(mesh.positions.shape, dtype=np.uint8)
    fixed[0], fixed[1, 2] = 1, 1
    cholesky = _native.CholmodCholesky(system.pattern, fixed, 1)
    assert cholesky.factorise(matrix) == -1
    free = fixed.ravel() == 0
    inverse = np.zeros((fixed.size, fixed.size))
    inverse[np.ix_(free, free)] = np.linalg.inv(dense(matrix, system.pattern)[np.ix_(free, free)])
    return cholesky, inverse


def pairs(rng: np.random.Generator, size: int, count: int) -> list[Pair]:
    """Steps s and changes y = A s of the gradient of a convex quadratic."""
    A = rng.normal(size=(size, size))
    A = A @ A.T + size * np.eye(size)
    return [(s, A @ s) for s in rng.normal(size=(count, size))]


def push(history: _native.Lbfgs, pair: Pair, rng: np.random.Generator) -> bool:
    s, y = pair
    x, g = rng.normal(size=(2, s.size))
    return history.push(x, x + s, g, g + y)


def bfgs(inverse: Array, remembered: list[Pair]) -> Array:
    """H <- (I - rho s y^T) H (I - rho y s^T) + rho s s^T, rho = 1/(s.y), oldest pair first."""
    H = inverse
    for s, y in remembered:
        rho = 1 / (s @ y)
        V = np.eye(s.size) - rho * np.outer(s, y)
        H = V @ H @ V.T + rho * np.outer(s, s)
    return H


def direction(history: _native.Lbfgs, cholesky: _native.Cholesky, g: Array) -> tuple[Array, float]:
    p = np.full_like(g, np.nan)
    slope = history.direction(g, cholesky, p)
    return p, slope


def check(history: _native.Lbfgs, inner: tuple[_native.Cholesky, Array], remembered: list[Pair], g: Array) -> None:
    cholesky, inverse = inner
    assert history.pairs == len(remembered)
    expected = -bfgs(inverse, remembered) @ g
    p, slope = direction(history, cholesky, g)
    np.testing.assert_allclose(p, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
    assert slope == pytest.approx(g @ expected, rel=1e-10)


@pytest.mark.parametrize("count", [0, 1, 2, 3, 4, 5, 7, 8, 9, 13], ids=lambda n: f"{n} pairs")
def test_direction_is_that_of_a_dense_update(
    inner: tuple[_native.Cholesky, Array], count: int, rng: np.random.Generator
) -> None:
    size = len(inner[1])
    history, all_pairs = _native.Lbfgs(size, WINDOW, 1), pairs(rng, size, count)
    for pair in all_pairs:
        assert push(history, pair, rng)
    check(history, inner, all_pairs[-WINDOW:] if count else [], rng.normal(size=size))


def test_newest_pair_satisfies_the_secant_equation(
    inner: tuple[_native.Cholesky, Array], rng: np.random.Generator
) -> None:
    # H y = s for the last pair
    size = len(inner[1])
    history, all_pairs = _native.Lbfgs(size, WINDOW, 1), pairs(rng, size, 6)
    for pair in all_pairs:
        push(history, pair, rng)
    s, y = all_pairs[-1]
    np.testing.assert_allclose(direction(history, inner[0], y)[0], -s, rtol=0, atol=1e-11 * np.abs(s).max())


def test_a_window_of_one_keeps_the_last_pair(inner: tuple[_native.Cholesky, Array], rng: np.random.Generator) -> None:
    size = len(inner[1])
    history, all_pairs = _native.Lbfgs(size, 1, 1), pairs(rng, size, 3)
    for pair in all_pairs:
        push(history, pair, rng)
    check(history, inner, all_pairs[-1:], rng.normal(size=size))


def bad_pairs(pair: Pair) -> dict[str, Pair]:
    s, y = pair
    orthogonal = y - (y @ s) / (s @ s) * s
    return {
        "negative": (s, -y),
        "no step": (0 * s, y),
        "no change": (s, 0 * y),
        "orthogonal": (s, orthogonal + 1e-13 * np.linalg.norm(y) / np.linalg.norm(s) * s),
        "nan": (s, np.full_like(y, np.nan)),
    }


@pytest.mark.parametrize("kind", ["negative", "no step", "no change", "orthogonal", "nan"])
@pytest.mark.parametrize("count", [0, 2, 4, 6], ids=lambda n: f"after {n} pairs")
def test_a_pair_without_curvature_is_skipped(
    inner: tuple[_native.Cholesky, Array], count: int, kind: str, rng: np.random.Generator
) -> None:
    size = len(inner[1])
    history, all_pairs = _native.Lbfgs(size, WINDOW, 1), pairs(rng, size, count + 1)
    for pair in all_pairs[:-1]:
        push(history, pair, rng)
    assert not push(history, bad_pairs(all_pairs[-1])[kind], rng)
    check(history, inner, all_pairs[:-1][-WINDOW:], rng.normal(size=size))


def test_pairs_after_a_skipped_one_are_stored(inner: tuple[_native.Cholesky, Array], rng: np.random.Generator) -> None:
    size = len(inner[1])
    history, all_pairs = _native.Lbfgs(size, WINDOW, 1), pairs(rng, size, 3)
    push(history, all_pairs[0], rng)
    s, y = all_pairs[1]
    push(history, (s, -y), rng)
    push(history, all_pairs[2], rng)
    check(history, inner, [all_pairs[0], all_pairs[2]], rng.normal(size=size))


@pytest.mark.parametrize("count", [3, 6])
def test_clear_forgets_every_pair(inner: tuple[_native.Cholesky, Array], count: int, rng: np.random.Generator) -> None:
    size = len(inner[1])
    history, all_pairs = _native.Lbfgs(size, WINDOW, 1), pairs(rng, size, count + 5)
    for pair in all_pairs[:count]:
        push(history, pair, rng)
    history.clear()
    check(history, inner, [], rng.normal(size=size))
    for pair in all_pairs[count:]:
        push(history, pair, rng)
    check(history, inner, all_pairs[-WINDOW:], rng.normal(size=size))


def test_held_degrees_of_freedom_do_not_move(inner: tuple[_native.Cholesky, Array], rng: np.random.Generator) -> None:
    cholesky, inverse = inner
    held = ~inverse.any(axis=1)
    assert held.sum() == 4
    history = _native.Lbfgs(len(inverse), WINDOW, 1)
    for s, y in pairs(rng, len(inverse), 3):
        push(history, (np.where(held, 0, s), np.where(held, 0, y)), rng)
    g = np.where(held, 0, rng.normal(size=len(inverse)))
    np.testing.assert_array_equal(direction(history, cholesky, g)[0][held], 0.0)


class Diagonal:
    """A mesh of single nodes: the factor of a multiple of the identity, of any size."""

    def __init__(self, nodes: int, value: float) -> None:
        pattern = _native.BlockPattern(nodes, np.zeros((0, 4), dtype=np.int32))
        matrix = _native.BlockMatrix(pattern)
        matrix.values[:] = value * np.eye(3)
        self.cholesky = _native.CholmodCholesky(pattern, np.zeros((nodes, 3), dtype=np.uint8), 1)
        self.cholesky.factorise(matrix)


@pytest.mark.parametrize("threads", [2, 3])
def test_direction_does_not_depend_on_threads(threads: int, rng: np.random.Generator) -> None:
    # 60 000 entries are above the sizes at which sums (32 768) and updates (32 768) go parallel.
    nodes = 20_000
    inner, g = Diagonal(nodes, 2.0), rng.normal(size=3 * nodes)
    steps = rng.normal(size=(3, 2, 3 * nodes))
    results = []
    for count in (1, threads):
        history = _native.Lbfgs(3 * nodes, 5, count)
        for s, noise in steps:
            assert history.push(np.zeros_like(s), s, np.zeros_like(s), 3 * s + 0.1 * noise)
        results.append(direction(history, inner.cholesky, g))
    np.testing.assert_array_equal(results[0][0], results[1][0])
    assert results[0][1] == results[1][1]


def test_wrong_sizes_are_refused(inner: tuple[_native.Cholesky, Array]) -> None:
    history = _native.Lbfgs(6, 3, 1)
    with pytest.raises(ValueError, match="another size"):
        direction(history, inner[0], np.zeros(6))
    with pytest.raises(ValueError, match="x has 3 entries, expected 6"):
        history.push(np.zeros(6), np.zeros(3), np.zeros(6), np.zeros(6))


def random_terms(rng: np.random.Generator, nodes: int, count: int) -> tuple[_native.RankOneTerms, Array]:
    """Terms of four nodes, some repeated, and their dense sum Kc."""
    stencil = rng.integers(0, nodes, size=(count, 4), dtype=np.int32)
    stencil[::3] = stencil[::3, :1]
    gamma, axis, stiffness = rng.normal(size=(count, 4)), rng.normal(size=(count, 3)), rng.uniform(0, 1e3, size=count)
    Kc = np.zeros((nodes, 3, nodes, 3))
    for j in range(count):
        a = np.zeros((nodes, 3))
        np.add.at(a, stencil[j], gamma[j, :, None] * axis[j])
        Kc += stiffness[j] * a[:, :, None, None] * a
    return _native.RankOneTerms(stencil, gamma, axis, stiffness), Kc.reshape(3 * nodes, 3 * nodes)


@pytest.mark.parametrize("terms", [0, 1, 40])
@pytest.mark.parametrize("count", [0, 1, 3, 7], ids=lambda n: f"{n} pairs")
def test_terms_are_added_to_every_pair(
    inner: tuple[_native.Cholesky, Array], count: int, terms: int, rng: np.random.Generator
) -> None:
    cholesky, inverse = inner
    size = len(inverse)
    native, Kc = random_terms(rng, size // 3, terms)
    history, all_pairs = _native.Lbfgs(size, WINDOW, 1), pairs(rng, size, count)
    for pair in all_pairs:
        assert push(history, pair, rng)
    g, p = rng.normal(size=size), np.full(size, np.nan)
    with_terms = [(s, y + Kc @ s) for s, y in all_pairs[-WINDOW:]]
    expected = -bfgs(inverse, with_terms) @ g
    for _ in range(2):  # the pairs themselves stay as they are
        slope = history.direction_with(g, cholesky, native, p)
        np.testing.assert_allclose(p, expected, rtol=0, atol=1e-10 * np.abs(expected).max())
        assert slope == pytest.approx(g @ expected, rel=1e-10)
    check(history, inner, all_pairs[-WINDOW:], g)


def test_terms_that_do_not_fit_pairs_are_refused(inner: tuple[_native.Cholesky, Array]) -> None:
    size = len(inner[1])
    history, g = _native.Lbfgs(size, WINDOW, 1), np.zeros(size)

    def term(node: int, stiffness: float) -> _native.RankOneTerms:
        nodes = np.full((1, 4), node, dtype=np.int32)
        return _native.RankOneTerms(nodes, np.ones((1, 4)), np.ones((1, 3)), np.array([stiffness]))

    with pytest.raises(ValueError, match=r"stiffness of term 0 is -1\.0+, expected at least 0"):
        history.direction_with(g, inner[0], term(0, -1.0), g.copy())
    with pytest.raises(ValueError, match=rf"node {size // 3}, outside \[0, {size // 3}\)"):
        history.direction_with(g, inner[0], term(size // 3, 1.0), g.copy())
