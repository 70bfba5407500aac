"""The density of Kelvin-Voigt viscosity, psi = k |E - E_b|^2, and its projection, which has no closed form."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from qlb import _native
from tests.materials.deformations import KINDS
from tests.materials.test_projection import clamped
from tests.support import Array, difference, random_rotation

LEVELS = _native.simd_levels()
UNITS = np.eye(9).reshape(9, 3, 3)
STEP = 1e-3
VOIGT = ((0, 0), (1, 1), (2, 2), (1, 2), (2, 0), (0, 1))


def evaluate(F: Array, table: Array, *, project: bool = False, level: str = "") -> tuple[Array, Array, Array]:
    """psi (k,), P (k, 3, 3) and d2psi/dF2 (k, 9, 9) with the parameters (k, 7): k; E_b as xx, yy, zz, yz, zx, xy."""
    energy, stress, stiffness = np.empty(len(F)), np.empty((len(F), 3, 3)), np.empty((len(F), 9, 9))
    F, table = np.ascontiguousarray(F), np.ascontiguousarray(table)
    _native.evaluate_density("viscous", F, table, project, energy, stress, stiffness, level)
    return energy, stress, stiffness


def green(F: Array) -> Array:
    return 0.5 * (F.transpose(0, 2, 1) @ F - np.eye(3))


def tensor(table: Array) -> Array:
    """E_b (k, 3, 3)."""
    base = np.empty((len(table), 3, 3))
    for m, (i, j) in enumerate(VOIGT):
        base[:, i, j] = base[:, j, i] = table[:, 1 + m]
    return base


def parameters(rng: np.random.Generator, count: int, size: float = 0.5) -> Array:
    return np.hstack([rng.uniform(0.1, 30.0, (count, 1)), size * rng.normal(size=(count, 6))])


def before(F: Array, change: float, rng: np.random.Generator) -> Array:
    """Parameters with E - E_b of the size `change`, as a time step has."""
    strain = green(F) - change * (lambda A: A + A.transpose(0, 2, 1))(rng.normal(size=F.shape))
    return np.hstack([rng.uniform(0.1, 30.0, (len(F), 1)), np.stack([strain[:, i, j] for i, j in VOIGT], axis=1)])


BASES = {
    "any E_b": lambda F, rng: parameters(rng, len(F)),
    "E_b near E": lambda F, rng: before(F, 1e-3, rng),
    "E_b = E": lambda F, rng: before(F, 0.0, rng),
    "E_b far above E": lambda F, rng: parameters(rng, len(F), 0.01) + np.array([0, 40, 30, 50, 0, 0, 0]),
}


@cache
def _case(kind: str, base: str) -> tuple[Array, Array]:
    rng = np.random.default_rng(20211110)
    F = KINDS[kind](rng)
    return F, BASES[base](F, rng)


@pytest.fixture(params=BASES)
def base(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(params=KINDS)
def case(request: pytest.FixtureRequest, base: str) -> tuple[Array, Array]:
    return _case(request.param, base)


@pytest.fixture(params=LEVELS)
def level(request: pytest.FixtureRequest) -> str:
    return request.param


def scale_of(table: Array, F: Array) -> float:
    """A stress of the size of these deformations [Pa]."""
    return float(table[:, 0].max() * (1 + np.abs(F).max() ** 3 + np.abs(table[:, 1:]).max()))


def test_energy_and_stress_are_those_of_the_formula(case: tuple[Array, Array], level: str) -> None:
    F, table = case
    energy, stress, _ = evaluate(F, table, level=level)
    change = green(F) - tensor(table)
    k = table[:, 0]
    scale = scale_of(table, F)
    np.testing.assert_allclose(energy, k * np.sum(change**2, axis=(1, 2)), rtol=1e-12, atol=1e-13 * scale)
    np.testing.assert_allclose(stress, 2 * k[:, None, None] * F @ change, rtol=0, atol=1e-13 * scale)


def test_stress_is_the_derivative_of_the_energy(case: tuple[Array, Array], level: str) -> None:
    F, table = case
    stress = evaluate(F, table, level=level)[1]
    measured = np.stack([difference(lambda G: evaluate(G, table, level=level)[0], F, d, STEP) for d in UNITS], axis=1)
    np.testing.assert_allclose(measured, stress.reshape(-1, 9), rtol=0, atol=1e-10 * scale_of(table, F))


def test_stiffness_is_the_derivative_of_the_stress(case: tuple[Array, Array], level: str) -> None:
    F, table = case
    stiffness = evaluate(F, table, level=level)[2]

    def stress(G: Array) -> Array:
        return evaluate(G, table, level=level)[1].reshape(-1, 9)

    measured = np.stack([difference(stress, F, d, STEP) for d in UNITS], axis=2)
    np.testing.assert_allclose(measured, stiffness, rtol=0, atol=1e-10 * scale_of(table, F))
    np.testing.assert_array_equal(stiffness, stiffness.transpose(0, 2, 1))


def test_projection_gives_the_nearest_positive_semidefinite_matrix(case: tuple[Array, Array], level: str) -> None:
    F, table = case
    exact = evaluate(F, table, level=level)[2]
    projected = evaluate(F, table, project=True, level=level)[2]
    scale = np.abs(exact).max(axis=(1, 2), keepdims=True) + np.finfo(float).tiny
    assert (np.abs(projected - clamped(exact)) / scale).max() <= 5e-13
    values = np.linalg.eigvalsh(projected)
    assert (values[:, 0] >= -5e-13 * scale[:, 0, 0]).all()
    np.testing.assert_array_equal(projected, projected.transpose(0, 2, 1))


def test_the_cases_are_of_both_kinds() -> None:
    definite = indefinite = 0
    for kind in KINDS:
        for base in BASES:
            values = np.linalg.eigvalsh(evaluate(*_case(kind, base))[2])
            negative = values[:, 0] < -1e-6 * np.abs(values).max(axis=1)
            definite, indefinite = definite + int((~negative).sum()), indefinite + int(negative.sum())
    assert min(definite, indefinite) > 300


def test_projection_leaves_positive_matrices_alone_beside_others(level: str, rng: np.random.Generator) -> None:
    # E above E_b in every direction: the stiffness is positive. E far below: it is not.
    F = np.eye(3) + 0.1 * rng.normal(size=(64, 3, 3))
    table = np.hstack([np.full((64, 1), 3.0), np.zeros((64, 6))])
    table[:, 1:4] = np.where(rng.random((64, 1)) < 0.5, -1.0, 1.0)
    exact, projected = (evaluate(F, table, project=project, level=level)[2] for project in (False, True))
    positive = np.linalg.eigvalsh(exact)[:, 0] > 0
    assert 16 < positive.sum() < 48
    np.testing.assert_allclose(projected[positive], exact[positive], rtol=0, atol=1e-14 * np.abs(exact).max())
    assert (np.abs(projected - exact).max(axis=(1, 2))[~positive] > 0.01).all()
    alone = evaluate(F[positive], table[positive], project=True, level=level)[2]
    np.testing.assert_allclose(alone, exact[positive], rtol=0, atol=1e-15 * np.abs(exact).max())


def test_no_viscosity_is_no_stiffness_beside_others(level: str, rng: np.random.Generator) -> None:
    F, table = KINDS["random"](rng)[:16], parameters(rng, 16)
    table[::3, 0] = 0.0
    for project in (False, True):
        energy, stress, stiffness = evaluate(F, table, project=project, level=level)
        for result in (energy, stress, stiffness):
            np.testing.assert_array_equal(result[::3], 0.0)
            assert np.abs(result[1::3]).max() > 0


@pytest.mark.parametrize("size", [1e-60, 1e-20, 1e20, 1e60])
def test_projection_does_not_depend_on_units(size: float, level: str, rng: np.random.Generator) -> None:
    F, table = KINDS["random"](rng), parameters(rng, 21)
    expected = evaluate(F, table, project=True, level=level)[2]
    table[:, 0] *= size
    found = evaluate(F, table, project=True, level=level)[2] / size
    np.testing.assert_allclose(found, expected, rtol=0, atol=1e-12 * np.abs(expected).max())


def test_levels_agree(case: tuple[Array, Array]) -> None:
    for project in (False, True):
        reference = evaluate(*case, project=project, level=LEVELS[0])
        for level in LEVELS[1:]:
            for result, expected in zip(evaluate(*case, project=project, level=level), reference, strict=True):
                scale = np.abs(expected).max() + scale_of(case[1], case[0])
                np.testing.assert_allclose(result, expected, rtol=0, atol=1e-12 * scale)


def test_it_is_objective(case: tuple[Array, Array], level: str, rng: np.random.Generator) -> None:
    F, table = case
    R = random_rotation(rng)
    T, scale = np.kron(R, np.eye(3)), scale_of(table, F)
    for project in (False, True):
        energy, stress, stiffness = evaluate(F, table, project=project, level=level)
        turned = evaluate(R @ F, table, project=project, level=level)
        np.testing.assert_allclose(turned[0], energy, rtol=1e-12, atol=1e-12 * scale)
        np.testing.assert_allclose(turned[1], R @ stress, rtol=0, atol=1e-12 * scale)
        np.testing.assert_allclose(turned[2], T @ stiffness @ T.T, rtol=0, atol=1e-12 * scale)


@pytest.mark.parametrize("bad", [np.nan, np.inf, -np.inf, 1e200])
def test_what_is_not_finite_stays_so_and_in_its_lane(bad: float, level: str, rng: np.random.Generator) -> None:
    F, table = KINDS["random"](rng)[:11], parameters(rng, 11)
    expected = evaluate(F, table, project=True, level=level)
    F[3, 1, 2] = bad
    others = np.arange(11) != 3
    for project in (False, True):
        results = evaluate(F, table, project=project, level=level)
        for result in results:
            assert not np.isfinite(result[3]).all()
            assert np.isfinite(result[others]).all()
    for result, clean in zip(results, expected, strict=True):
        np.testing.assert_allclose(result[others], clean[others], rtol=0, atol=1e-13 * np.abs(clean[others]).max())
