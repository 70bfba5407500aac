"""The projected stiffness is that of NumPy's eigenvalues, clamped at zero."""

from __future__ import annotations

import numpy as np
import pytest

from qlb.materials import Material
from tests.materials.deformations import KINDS, PROJECTION_ACCURACY
from tests.support import Array


def clamped(stiffness: Array) -> Array:
    values, vectors = np.linalg.eigh(stiffness)
    return np.einsum("kip,kp,kjp->kij", vectors, np.maximum(values, 0.0), vectors)


def test_projection_clamps_the_eigenvalues_at_zero(
    material: Material, level: str, kind: str, rng: np.random.Generator
) -> None:
    F = KINDS[kind](rng)
    exact = material.evaluate(F, simd_level=level)[2]
    projected = material.evaluate(F, project=True, simd_level=level)[2]
    scale = np.abs(exact).max(axis=(1, 2), keepdims=True) + np.finfo(float).tiny
    error = np.abs(projected - clamped(exact)) / scale
    assert error.max() <= PROJECTION_ACCURACY.get(kind, 1e-13)


def test_projected_stiffness_is_positive_semidefinite(material: Material, level: str, F: Array) -> None:
    projected = material.evaluate(F, project=True, simd_level=level)[2]
    values = np.linalg.eigvalsh(projected)
    assert (values[:, 0] >= -1e-14 * values[:, -1]).all()


@pytest.mark.objective
def test_projection_leaves_a_positive_stiffness_alone(material: Material, level: str, rng: np.random.Generator) -> None:
    # Rotated and expanded a little: the tension makes turning cost energy, and every eigenvalue is positive.
    F = 1.002 * KINDS["rotated"](rng)
    exact = material.evaluate(F, simd_level=level)[2]
    assert np.linalg.eigvalsh(exact).min() > 0
    projected = material.evaluate(F, project=True, simd_level=level)[2]
    np.testing.assert_allclose(projected, exact, rtol=0, atol=1e-12 * np.abs(exact).max())


@pytest.mark.objective
def test_projection_changes_an_indefinite_stiffness(material: Material, level: str) -> None:
    F = np.diag([0.6, 0.6, 0.6])[None]
    exact = material.evaluate(F, simd_level=level)[2]
    assert np.linalg.eigvalsh(exact)[0, 0] < 0
    values = np.linalg.eigvalsh(material.evaluate(F, project=True, simd_level=level)[2])
    assert values[0, 0] >= -1e-14 * values[0, -1]


def test_energy_and_stress_do_not_depend_on_the_projection(material: Material, F: Array) -> None:
    exact, projected = material.evaluate(F), material.evaluate(F, project=True)
    np.testing.assert_array_equal(exact[0], projected[0])
    np.testing.assert_array_equal(exact[1], projected[1])
