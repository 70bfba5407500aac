"""Stress and stiffness of each material are the derivatives of its energy density, by finite differences."""

from __future__ import annotations

import numpy as np

from qlb.materials import Material
from tests.support import Array, difference

UNITS = np.eye(9).reshape(9, 3, 3)
# An order 4 difference errs by step^4 times a fifth derivative and by 1e-16/step: both near 1e-12 of the scale.
STEP = 1e-3


def test_stress_is_the_derivative_of_the_energy(material: Material, level: str, F: Array) -> None:
    def energy(G: Array) -> Array:
        return material.evaluate(G, simd_level=level)[0]

    stress = material.evaluate(F, simd_level=level)[1]
    measured = np.stack([difference(energy, F, unit, STEP) for unit in UNITS], axis=1)
    scale = np.abs(stress).max() + 1e-2 * np.max(material.modulus())
    np.testing.assert_allclose(measured, stress.reshape(-1, 9), rtol=0, atol=1e-8 * scale)


def test_stiffness_is_the_derivative_of_the_stress(material: Material, level: str, F: Array) -> None:
    def stress(G: Array) -> Array:
        return material.evaluate(G, simd_level=level)[1]

    stiffness = material.evaluate(F, simd_level=level)[2]
    measured = np.stack([difference(stress, F, unit, STEP).reshape(-1, 9) for unit in UNITS], axis=2)
    scale = np.abs(stiffness).max() + 1e-2 * np.max(material.modulus())
    np.testing.assert_allclose(measured, stiffness, rtol=0, atol=1e-8 * scale)


def test_stiffness_is_symmetric(material: Material, level: str, F: Array) -> None:
    for project in (False, True):
        stiffness = material.evaluate(F, project=project, simd_level=level)[2]
        np.testing.assert_allclose(
            stiffness, stiffness.transpose(0, 2, 1), rtol=0, atol=1e-15 * np.abs(stiffness).max()
        )
