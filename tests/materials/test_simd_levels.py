"""Kernels of every SIMD level agree, and no lane disturbs another."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import TetMesh, _native
from qlb.materials import Material
from tests.materials.deformations import KINDS, PROJECTION_ACCURACY
from tests.support import Array

LEVELS = _native.simd_levels()


@pytest.mark.parametrize("project", [False, True], ids=["exact", "projected"])
@pytest.mark.parametrize("other", LEVELS[1:])
def test_levels_agree_on_the_density(
    material: Material, kind: str, other: str, project: bool, rng: np.random.Generator
) -> None:
    F = KINDS[kind](rng)
    accuracy = PROJECTION_ACCURACY.get(kind, 1e-12) if project else 1e-12
    reference = material.evaluate(F, project=project, simd_level=LEVELS[0])
    results = material.evaluate(F, project=project, simd_level=other)
    for result, expected in zip(results, reference, strict=True):
        scale = np.abs(expected).max() + np.max(material.modulus())
        np.testing.assert_allclose(result, expected, rtol=0, atol=accuracy * scale)


def test_the_best_level_is_the_default(material: Material, F: Array) -> None:
    for result, expected in zip(material.evaluate(F), material.evaluate(F, simd_level=LEVELS[-1]), strict=True):
        np.testing.assert_array_equal(result, expected)


def test_an_unknown_level_is_refused(material: Material) -> None:
    with pytest.raises(ValueError, match="mmx"):
        material.evaluate(np.eye(3)[None], simd_level="mmx")


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("count", [1, 2, 3, 4, 5, 7, 8, 9, 16, 17])
def test_lanes_do_not_disturb_each_other(material: Material, level: str, count: int, rng: np.random.Generator) -> None:
    F = np.eye(3) + rng.normal(size=(count, 3, 3))
    together = material.evaluate(F, project=True, simd_level=level)
    for k in range(count):
        alone = material.evaluate(F[k : k + 1], project=True, simd_level=level)
        for whole, single in zip(together, alone, strict=True):
            # Jacobi sweeps go on until every lane is done: one sweep more changes rounding only.
            np.testing.assert_allclose(
                whole[k], single[0], rtol=0, atol=1e-13 * (np.abs(single).max() + np.max(material.modulus()))
            )


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("cells", [(1, 1, 1), (3, 1, 1), (5, 3, 3)], ids=str)
def test_levels_agree_on_a_mesh(
    material: Material, level: str, cells: tuple[int, int, int], rng: np.random.Generator
) -> None:
    mesh = TetMesh.box(cells=cells)
    pattern = _native.BlockPattern(len(mesh.positions), mesh.tets)
    blocks = _native.TetBlocks(mesh.positions, mesh.tets, pattern)
    x = mesh.positions + 0.01 * rng.normal(size=mesh.positions.shape)

    def evaluate(at: str) -> list[Array]:
        table = material.parameter_table(len(mesh.tets))
        energy = _native.ElasticEnergy(blocks, material.kernels, table, 1, at, material.program())
        gradient = np.zeros_like(x)
        value = energy.add_value_gradient(x, 1.0, gradient)
        results = [np.array([value]), gradient]
        for project in (False, True):
            matrix = _native.BlockMatrix(pattern)
            energy.add_hessian(x, 1.0, project, matrix)
            results.append(matrix.values.copy())
        return results

    for result, expected in zip(evaluate(level), evaluate(LEVELS[0]), strict=True):
        np.testing.assert_allclose(result, expected, rtol=0, atol=1e-12 * np.abs(expected).max())
