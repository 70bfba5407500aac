"""The kept factor with rank-one terms against dense inverses, by numpy."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import replace

import numpy as np
import pytest

from qlb import TetMesh, _native
from tests.linalg.low_rank import PRECISIONS, Body, Terms, apply, assert_close, dense_inverse, random_terms
from tests.support import Array, dense, elastic_hessian, make_system


@pytest.fixture(params=PRECISIONS)
def precision(request: pytest.FixtureRequest) -> str:
    return str(request.param)


@pytest.mark.parametrize("carried", [False, True])
@pytest.mark.parametrize("count", [0, 1, 7, 300])
def test_inverse_is_that_of_the_dense_sum(precision: str, count: int, carried: bool) -> None:
    body = Body(precision)
    if carried:
        body.carry()
    terms = body.terms(count)
    assert body.inverse.set_terms(terms.native)
    assert body.inverse.terms == count
    assert_close(dense_inverse(body), body.expected(terms), precision)


def test_terms_in_the_frame_of_the_factor_are_those_that_were_brought_there(precision: str) -> None:
    body = Body(precision)
    body.carry()
    terms = body.terms(40)
    vectors = terms.gamma[:, :, None] * terms.axis[:, None, :]
    framed = np.full_like(vectors, np.nan)
    body.inverse.pull_back(terms.nodes, vectors, framed)
    assert np.abs(framed - vectors).max() > 0.1
    vectors[25:] = framed[25:]
    assert body.inverse.set_terms(_native.RankOneTerms(terms.nodes, vectors, terms.stiffness), framed=15)
    assert_close(dense_inverse(body), body.expected(terms), precision)


def test_terms_and_nodes_that_do_not_exist_are_refused() -> None:
    body = Body("float64")
    with pytest.raises(ValueError, match="framed is 31"):
        body.inverse.set_terms(body.terms(30).native, framed=31)
    with pytest.raises(ValueError, match="node -1"):
        body.inverse.pull_back(np.full((1, 4), -1, dtype=np.int32), np.ones((1, 4, 3)), np.empty((1, 4, 3)))


@pytest.mark.parametrize("simd", _native.simd_levels())
def test_every_simd_level_gives_the_inverse(precision: str, simd: str) -> None:
    body = Body(precision, simd=simd)
    body.carry()
    terms = body.terms(200)
    assert body.inverse.set_terms(terms.native)
    assert_close(dense_inverse(body), body.expected(terms), precision)


def test_without_terms_it_is_the_carried_inverse(precision: str, rng: np.random.Generator) -> None:
    body = Body(precision)
    carried = _native.CarriedInverse(body.factor, body.system.blocks, body.fixed, 1)
    b = rng.normal(size=(1, 3 * body.count))
    np.testing.assert_array_equal(apply(body.inverse, b), apply(carried, b))
    body.carry()
    carried.carry(body.x, body.reference, 0.3)
    np.testing.assert_array_equal(apply(body.inverse, b), apply(carried, b))
    body.inverse.reset()
    np.testing.assert_array_equal(apply(body.inverse, b), apply(body.factor, b))


@pytest.mark.parametrize("negative", [1, 20, 150])
def test_terms_that_are_in_the_factor_are_taken_away(precision: str, negative: int) -> None:
    # A + C K C^T as the factor's own matrix, less C K C^T, plus others.
    body = Body("float64")
    pattern = _native.BlockPattern(body.count, np.arange(body.count, dtype=np.int32)[None])
    taken, added = body.terms(negative, seed=1), body.terms(200, seed=2)
    elastic, matrix = body.matrix, _native.BlockMatrix(pattern)
    matrix.set_from(_native.PatternMap(body.system.pattern, pattern), elastic)
    matrix.add_stencils(taken.nodes, stencils(taken))
    factor = _native.SupernodalCholesky(pattern, body.fixed, 1, precision)
    assert factor.factorise(matrix) == -1
    inverse = _native.WoodburyInverse(factor, body.system.blocks, body.fixed, 1)
    both = join(replace(taken, stiffness=-taken.stiffness), added)
    shuffled = np.random.default_rng(3).permutation(len(both.nodes))
    both = Terms(*(np.ascontiguousarray(part[shuffled]) for part in vars(both).values()))
    assert inverse.set_terms(both.native)
    assert_close(apply(inverse, np.eye(3 * body.count)).T, body.expected(added), precision)


def test_taking_away_too_much_is_told_and_leaves_no_terms(precision: str, rng: np.random.Generator) -> None:
    body = Body(precision)
    b = rng.normal(size=(1, 3 * body.count))
    before = apply(body.inverse, b)
    assert body.inverse.set_terms(body.terms(30).native)
    terms = body.terms(30)
    terms.stiffness[17] *= -1e3
    assert not body.inverse.set_terms(terms.native)
    assert body.inverse.terms == 0
    np.testing.assert_array_equal(apply(body.inverse, b), before)


@pytest.mark.parametrize("factor", [1e-12, 1e12])
def test_tiny_and_huge_stiffness(precision: str, factor: float) -> None:
    body = Body(precision)
    body.carry()
    scale = np.ones(60)
    scale[::2] = factor
    terms = body.terms(60, scale)
    assert body.inverse.set_terms(terms.native)
    found, expected = dense_inverse(body), body.expected(body.terms(60, np.minimum(scale, 1e7)))
    np.testing.assert_allclose(
        found, expected, rtol=0, atol=(1e-6 if precision == "float64" else 1e-3) * expected.max()
    )


def test_equal_terms_count_twice(precision: str) -> None:
    body = Body(precision)
    terms = body.terms(40, 1e6)
    assert body.inverse.set_terms(join(terms, terms).native)
    twice = dense_inverse(body)
    assert body.inverse.set_terms(replace(terms, stiffness=2 * terms.stiffness).native)
    assert_close(twice, dense_inverse(body), precision)


def test_where_single_precision_is_too_coarse_for_equal_stiff_terms_double_is_taken(precision: str) -> None:
    body = Body(precision)
    terms = body.terms(4, 1e8)
    assert body.inverse.set_terms(join(terms, terms, terms, terms).native)
    many = dense_inverse(body)
    assert body.inverse.set_terms(replace(terms, stiffness=4 * terms.stiffness).native)
    assert_close(many, dense_inverse(body), precision)


def test_terms_at_held_nodes_are_passed_over(precision: str, rng: np.random.Generator) -> None:
    body = Body(precision)
    held = np.flatnonzero(body.fixed.all(axis=1)).astype(np.int32)
    assert len(held) > 4
    terms = random_terms(rng, held, 20, body.stiffness())
    assert body.inverse.set_terms(terms.native)
    assert (body.inverse.terms, body.inverse.active_terms, body.inverse.columns) == (20, 0, 0)
    some = join(terms, body.terms(10))
    assert body.inverse.set_terms(some.native)
    assert body.inverse.active_terms <= 10
    assert_close(dense_inverse(body), body.expected(some), precision)


def test_columns_are_kept_and_make_no_difference(precision: str) -> None:
    body, fresh = Body(precision), Body(precision)
    for seed, count in ((1, 5), (2, 300), (3, 2), (4, 40)):
        terms = body.terms(count, seed=seed)
        assert body.inverse.set_terms(terms.native)
    assert body.inverse.columns > fresh.inverse.columns == 0
    assert fresh.inverse.set_terms(terms.native)
    np.testing.assert_array_equal(dense_inverse(body), dense_inverse(fresh))
    columns, size = body.inverse.columns, body.inverse.bytes
    assert body.inverse.set_terms(terms.native)
    assert (body.inverse.columns, body.inverse.bytes) == (columns, size)


def test_carrying_on_keeps_the_terms(precision: str) -> None:
    body = Body(precision)
    terms = body.terms(50)
    assert body.inverse.set_terms(terms.native)
    body.carry()
    assert_close(dense_inverse(body), body.expected(terms), precision)
    body.inverse.reset()
    body.carried = False
    assert_close(dense_inverse(body), body.expected(terms), precision)


def test_a_new_factor_is_not_taken_for_the_old_one(precision: str) -> None:
    body = Body(precision)
    terms = body.terms(50)
    assert body.inverse.set_terms(terms.native)
    body.factorise(3e5)
    with pytest.raises(RuntimeError, match="factor was made anew"):
        dense_inverse(body)
    body.inverse.forget()
    assert (body.inverse.columns, body.inverse.terms, body.inverse.bytes) == (0, 0, 0)
    assert_close(dense_inverse(body), body.expected(body.terms(0)), precision)
    assert body.inverse.set_terms(terms.native)
    assert_close(dense_inverse(body), body.expected(terms), precision)
    body.factorise(1e4)
    assert body.inverse.set_terms(terms.native)  # forgets by itself
    assert_close(dense_inverse(body), body.expected(terms), precision)


def test_precision_may_change(rng: np.random.Generator) -> None:
    body = Body("float32")
    terms = body.terms(50)
    assert body.inverse.set_terms(terms.native)
    body.factor.set_precision("float64")
    body.factorise(1e4)
    assert body.inverse.set_terms(terms.native)
    assert_close(dense_inverse(body), body.expected(terms), "float64")


def test_bits_do_not_depend_on_the_number_of_threads(precision: str, rng: np.random.Generator) -> None:
    found = []
    for threads in (1, 2, 3, 8):
        body = Body(precision, cells=(12, 8, 8), threads=threads)
        body.carry()
        assert body.inverse.set_terms(body.terms(500).native)
        b = np.random.default_rng(1).normal(size=(1, 3 * body.count))
        found.append(apply(body.inverse, b))
    for x in found[1:]:
        np.testing.assert_array_equal(x, found[0])


def test_several_hundred_terms_of_both_signs(rng: np.random.Generator) -> None:
    # More than one panel of the small matrix of each sign; what is added once is taken away again.
    body = Body("float64", cells=(8, 4, 4))
    kept, passing = body.terms(150, seed=1), body.terms(400, seed=2)
    gone = replace(passing, stiffness=-passing.stiffness)
    assert body.inverse.set_terms(join(join(gone, kept), passing).native)
    assert_close(dense_inverse(body), body.expected(kept), "float64")


def test_separate_bodies_do_not_meet(precision: str) -> None:
    # Terms that couple two bodies whose factors share no supernode.
    mesh = TetMesh.box((1.0, 0.5, 0.5), cells=(3, 2, 2))
    count = len(mesh.positions)
    two = TetMesh(np.concatenate([mesh.positions, mesh.positions + 2]), np.concatenate([mesh.tets, mesh.tets + count]))
    system = make_system(two, mass="consistent")
    matrix = elastic_hessian(system, two.positions, project=True)
    system.inertia.add_hessian(1e4, matrix)
    fixed = np.zeros((2 * count, 3), dtype=np.uint8)
    factor = _native.SupernodalCholesky(system.pattern, fixed, 1, precision)
    assert factor.factorise(matrix) == -1
    inverse = _native.WoodburyInverse(factor, system.blocks, fixed, 1)
    full = dense(matrix, system.pattern)
    terms = random_terms(np.random.default_rng(2), np.arange(2 * count, dtype=np.int32), 80, full.trace() / len(full))
    assert inverse.set_terms(terms.native)
    expected = np.linalg.inv(full + terms.dense(2 * count))
    assert_close(apply(inverse, np.eye(len(full))).T, expected, precision)


def stencils(terms: Terms) -> Array:
    """The terms as matrices between their four slots, shape (k, 12, 12)."""
    a = (terms.gamma[:, :, None] * terms.axis[:, None, :]).reshape(-1, 12)
    return terms.stiffness[:, None, None] * a[:, :, None] * a[:, None, :]


def join(*some: Terms) -> Terms:
    return Terms(*(np.concatenate(parts) for parts in zip(*(vars(terms).values() for terms in some), strict=True)))


def test_product_with_terms_is_that_of_the_dense_matrix(rng: np.random.Generator) -> None:
    terms = random_terms(rng, np.arange(9, dtype=np.int32), 30, rng.normal(size=30))
    v, out = rng.normal(size=(2, 9, 3))
    expected = out.ravel() - 0.7 * terms.dense(9) @ v.ravel()
    native = terms.native
    assert native.size == len(native) == 30
    np.testing.assert_array_equal(native.nodes, terms.nodes)
    np.testing.assert_array_equal(native.vectors, terms.gamma[:, :, None] * terms.axis[:, None, :])
    np.testing.assert_array_equal(native.stiffness, terms.stiffness)
    same = _native.RankOneTerms(native.nodes, native.vectors, native.stiffness)
    np.testing.assert_array_equal(same.vectors, native.vectors)
    native.add_product(v, out, -0.7)
    np.testing.assert_allclose(out.ravel(), expected, rtol=0, atol=1e-12)


def broken(name: str, value: object) -> Callable[[Terms], Terms]:
    def change(terms: Terms) -> Terms:
        part = getattr(terms, name).copy()
        part[2] = value
        return replace(terms, **{name: part})

    return change


@pytest.mark.parametrize(
    ("change", "message"),
    [
        (broken("nodes", -1), "term 2 has node -1, expected at least 0"),
        (broken("gamma", np.nan), "gamma of term 2 is nan"),
        (broken("axis", np.inf), "axis of term 2 is inf"),
        (broken("stiffness", np.nan), "stiffness of term 2 is nan"),
        (lambda t: replace(t, axis=t.axis[:-1]), "axis has 12 entries, expected 15"),
    ],
)
def test_terms_that_make_no_sense_are_refused(
    change: Callable[[Terms], Terms], message: str, rng: np.random.Generator
) -> None:
    with pytest.raises(ValueError, match=message):
        _ = change(random_terms(rng, np.arange(9, dtype=np.int32), 5, 1.0)).native


def test_what_does_not_fit_is_refused() -> None:
    body = Body("float32", cells=(2, 1, 1))
    far = random_terms(np.random.default_rng(0), np.array([body.count], dtype=np.int32), 1, 1.0)
    with pytest.raises(ValueError, match=rf"node {body.count}, outside \[0, {body.count}\)"):
        body.inverse.set_terms(far.native)
    with pytest.raises(ValueError, match=f"node {body.count}"):
        far.native.add_product(np.zeros((body.count, 3)), np.zeros((body.count, 3)), 1.0)
    cholmod = _native.CholmodCholesky(body.system.pattern, body.fixed, 1)
    with pytest.raises(ValueError, match="half-solves, which only SupernodalCholesky has"):
        _native.WoodburyInverse(cholmod, body.system.blocks, body.fixed, 1)
    unready = _native.SupernodalCholesky(body.system.pattern, body.fixed, 1, "float32")
    with pytest.raises(RuntimeError, match="factorise first"):
        _native.WoodburyInverse(unready, body.system.blocks, body.fixed, 1).set_terms(body.terms(1).native)
