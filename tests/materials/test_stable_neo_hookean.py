"""Closed forms of Stable Neo-Hookean (Smith, de Goes, Kim 2018), written down again from the paper."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import StableNeoHookean

YOUNG = 3e4
STRETCHES = [0.2, 0.5, 0.9, 1.0, 1.1, 2.0, 4.0]


@pytest.fixture(params=[0.0, 0.3, 0.49])
def nu(request: pytest.FixtureRequest) -> float:
    return request.param


def constants(nu: float) -> tuple[float, float, float]:
    """mu, lambda and alpha of eq. 14, from Lame's constants by section 3.4."""
    mu_lame = YOUNG / (2 * (1 + nu))
    lambda_lame = YOUNG * nu / ((1 + nu) * (1 - 2 * nu))
    mu, lam = 4 / 3 * mu_lame, lambda_lame + 5 / 6 * mu_lame
    return mu, lam, 1 + mu / lam - mu / (4 * lam)


def density(F: np.ndarray, nu: float) -> float:
    mu, lam, alpha = constants(nu)

    def psi(G: np.ndarray) -> float:
        invariant, J = np.sum(G * G), np.linalg.det(G)
        return mu / 2 * (invariant - 3) + lam / 2 * (J - alpha) ** 2 - mu / 2 * np.log(invariant + 1)

    return float(psi(F) - psi(np.eye(3)))


def evaluate(F: np.ndarray, nu: float) -> tuple[float, np.ndarray]:
    psi, P, _ = StableNeoHookean(young=YOUNG, poisson=nu).evaluate(F[None])
    return float(psi[0]), P[0]


def test_energy_is_that_of_the_paper_less_its_value_at_rest(nu: float, rng: np.random.Generator) -> None:
    for F in np.eye(3) + rng.normal(size=(20, 3, 3)):
        assert evaluate(F, nu)[0] == pytest.approx(density(F, nu), rel=1e-12, abs=1e-12 * YOUNG)


@pytest.mark.parametrize("s", STRETCHES)
def test_stress_of_a_confined_stretch(s: float, nu: float) -> None:
    # F = diag(s, 1, 1), a = mu (1 - 1/(s^2 + 3)): P11 = a s + lambda (s - alpha), P22 = a + lambda (s - alpha) s
    mu, lam, alpha = constants(nu)
    a = mu * (1 - 1 / (s**2 + 3))
    P = evaluate(np.diag([s, 1.0, 1.0]), nu)[1]
    expected = np.diag([a * s + lam * (s - alpha), a + lam * (s - alpha) * s, a + lam * (s - alpha) * s])
    np.testing.assert_allclose(P, expected, rtol=1e-12, atol=1e-11 * YOUNG)


@pytest.mark.parametrize("shear", [-2.0, -0.1, 0.0, 0.3, 1.0, 5.0])
def test_stress_of_simple_shear(shear: float, nu: float) -> None:
    # F = I + g e1 e2^T has J = 1, I_C = 3 + g^2 and the cofactor I - g e2 e1^T.
    mu, lam, alpha = constants(nu)
    a, b = mu * (1 - 1 / (4 + shear**2)), lam * (1 - alpha)
    F = np.eye(3)
    F[0, 1] = shear
    expected = np.array([[a + b, a * shear, 0], [-b * shear, a + b, 0], [0, 0, a + b]])
    np.testing.assert_allclose(evaluate(F, nu)[1], expected, rtol=1e-12, atol=1e-11 * YOUNG)


@pytest.mark.parametrize("s", STRETCHES)
def test_stress_of_uniform_expansion(s: float, nu: float) -> None:
    # F = s I: P = [mu s (1 - 1/(3 s^2 + 1)) + lambda (s^3 - alpha) s^2] I
    mu, lam, alpha = constants(nu)
    expected = mu * s * (1 - 1 / (3 * s**2 + 1)) + lam * (s**3 - alpha) * s**2
    np.testing.assert_allclose(evaluate(s * np.eye(3), nu)[1], expected * np.eye(3), rtol=1e-12, atol=1e-11 * YOUNG)


def test_a_collapsed_element_has_finite_energy_and_no_force(nu: float) -> None:
    mu, lam, alpha = constants(nu)
    psi, P = evaluate(np.zeros((3, 3)), nu)
    assert psi == pytest.approx(-1.5 * mu + mu / 2 * np.log(4) + lam / 2 * (alpha**2 - (1 - alpha) ** 2), rel=1e-12)
    np.testing.assert_array_equal(P, 0.0)


def test_volume_is_kept_near_the_incompressible_limit() -> None:
    # A stretch that is free at the sides keeps its volume to (1 - 2 nu) (s - 1), the linear estimate, in order of size.
    nu, s = 0.4999, 1.5
    low, high = 0.5, 1.2
    for _ in range(80):
        side = 0.5 * (low + high)
        low, high = (side, high) if evaluate(np.diag([s, side, side]), nu)[1][1, 1] < 0 else (low, side)
    assert abs(s * side**2 - 1) <= 2 * (1 - 2 * nu) * (s - 1)
