"""Near the rest shape each material is linear elasticity with its Young's modulus and Poisson's ratio."""

from __future__ import annotations

import numpy as np
import pytest

from qlb.materials import Material, SymbolicMaterial
from tests.support import random_rotation


def lame(material: Material) -> tuple[float, float]:
    if isinstance(material, SymbolicMaterial):
        return material.parameters["mu"], material.parameters["lam"]  # type: ignore[return-value]
    E, nu = float(material.young), float(getattr(material, "poisson", 0.0))
    return E / (2 * (1 + nu)), E * nu / ((1 + nu) * (1 - 2 * nu))


def test_rest_has_no_energy_and_no_stress(material: Material, level: str) -> None:
    psi, P, _ = material.evaluate(np.eye(3)[None], simd_level=level)
    modulus = np.max(material.modulus())
    assert abs(psi[0]) <= 1e-13 * modulus
    np.testing.assert_allclose(P[0], 0.0, atol=1e-13 * modulus)


@pytest.mark.objective
def test_every_rotation_of_rest_is_stress_free(material: Material, level: str, rng: np.random.Generator) -> None:
    R = np.stack([random_rotation(rng) for _ in range(10)])
    psi, P, _ = material.evaluate(R, simd_level=level)
    modulus = np.max(material.modulus())
    np.testing.assert_allclose(psi, 0.0, atol=1e-12 * modulus)
    np.testing.assert_allclose(P, 0.0, atol=1e-12 * modulus)


def test_stiffness_at_rest_is_that_of_linear_elasticity(material: Material, level: str) -> None:
    # C_ijkl = lambda d_ij d_kl + mu (d_ik d_jl + d_il d_jk)
    mu, lam = lame(material)
    d = np.eye(3)
    linear = lam * np.einsum("ij,kl->ijkl", d, d)
    linear += mu * (np.einsum("ik,jl->ijkl", d, d) + np.einsum("il,jk->ijkl", d, d))
    C = material.evaluate(np.eye(3)[None], simd_level=level)[2][0].reshape(3, 3, 3, 3)
    np.testing.assert_allclose(C, linear, rtol=0, atol=1e-12 * np.abs(linear).max())


def test_small_strains_store_the_energy_of_linear_elasticity(
    material: Material, level: str, rng: np.random.Generator
) -> None:
    mu, lam = lame(material)
    strain = rng.normal(size=(3, 3))
    strain = 1e-4 * (strain + strain.T)
    linear = mu * np.sum(strain**2) + 0.5 * lam * np.trace(strain) ** 2
    psi = material.evaluate((np.eye(3) + strain)[None], simd_level=level)[0][0]
    # The cubic term is of order |strain| relative to the quadratic one.
    assert abs(psi / linear - 1) <= 30 * np.abs(strain).max()


def test_energy_is_positive_away_from_rest(material: Material, level: str, rng: np.random.Generator) -> None:
    for size in (1e-3, 1e-2, 1e-1):
        S = rng.normal(size=(50, 3, 3))
        F = np.eye(3) + size * (S + S.transpose(0, 2, 1))
        assert (material.evaluate(F, simd_level=level)[0] > 0).all()
