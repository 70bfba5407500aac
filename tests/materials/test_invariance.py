"""Energy, stress and stiffness turn with the frame and, without fibres, with the material."""

from __future__ import annotations

import numpy as np
import pytest

from qlb.materials import Material
from tests.support import Array, random_rotation

pytestmark = pytest.mark.objective


def kronecker(A: Array, B: Array) -> Array:
    """The 9x9 matrix of G -> A G B^T with G flattened row by row."""
    return np.kron(A, B)


def test_energy_is_objective(material: Material, level: str, F: Array, rng: np.random.Generator) -> None:
    R = random_rotation(rng)
    psi = material.evaluate(F, simd_level=level)[0]
    turned = material.evaluate(R @ F, simd_level=level)[0]
    np.testing.assert_allclose(turned, psi, rtol=0, atol=1e-12 * (np.abs(psi).max() + np.max(material.modulus())))


def test_energy_is_isotropic(material: Material, level: str, F: Array, rng: np.random.Generator) -> None:
    R = random_rotation(rng)
    psi = material.evaluate(F, simd_level=level)[0]
    turned = material.evaluate(F @ R, simd_level=level)[0]
    np.testing.assert_allclose(turned, psi, rtol=0, atol=1e-12 * (np.abs(psi).max() + np.max(material.modulus())))


def test_stress_turns_with_the_frame_and_the_material(
    material: Material, level: str, F: Array, rng: np.random.Generator
) -> None:
    R, S = random_rotation(rng), random_rotation(rng)
    P = material.evaluate(F, simd_level=level)[1]
    turned = material.evaluate(R @ F @ S, simd_level=level)[1]
    scale = np.abs(P).max() + np.max(material.modulus())
    np.testing.assert_allclose(turned, R @ P @ S, rtol=0, atol=1e-12 * scale)


def test_stiffness_turns_with_the_frame_and_the_material(
    material: Material, level: str, F: Array, rng: np.random.Generator
) -> None:
    R, S = random_rotation(rng), random_rotation(rng)
    T = kronecker(R, S.T)
    C = material.evaluate(F, simd_level=level)[2]
    turned = material.evaluate(R @ F @ S, simd_level=level)[2]
    np.testing.assert_allclose(turned, T @ C @ T.T, rtol=0, atol=1e-11 * (np.abs(C).max() + 1.0))


def test_true_stress_is_symmetric(material: Material, level: str, F: Array) -> None:
    # P F^T = J sigma: objectivity is the balance of angular momentum.
    P = material.evaluate(F, simd_level=level)[1]
    kirchhoff = P @ F.transpose(0, 2, 1)
    skew = kirchhoff - kirchhoff.transpose(0, 2, 1)
    scale = (np.abs(P).max() + np.max(material.modulus())) * np.abs(F).max()
    np.testing.assert_allclose(skew, 0.0, atol=1e-13 * scale)
