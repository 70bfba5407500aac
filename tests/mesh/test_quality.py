"""Angles and aspect ratios of tets whose shape is known, and of random ones by another formula."""

from __future__ import annotations

import numpy as np
import pytest

import qlb
from qlb.mesh import MeshQuality
from qlb.mesh.quality import aspect_ratios, dihedral_angles
from tests.shapes import surfaces

REGULAR = np.array([[1, 1, 1], [1, -1, -1], [-1, 1, -1], [-1, -1, 1.0]]) / np.sqrt(8)
"""Of edge 1."""
CORNER = np.vstack([np.zeros(3), np.eye(3)])


def test_a_regular_tet_has_equal_angles_and_aspect_one() -> None:
    quality = MeshQuality.of(
        qlb.TetMesh(REGULAR, [[0, 2, 1, 3]] if np.linalg.det(REGULAR[1:] - REGULAR[0]) < 0 else [[0, 1, 2, 3]])
    )
    assert quality.dihedral == pytest.approx((np.degrees(np.arccos(1 / 3)),) * 2)
    assert quality.aspect == pytest.approx((1, 1))
    assert quality.edges == pytest.approx((1, 1, 1))
    assert quality.volume == pytest.approx(1 / (6 * np.sqrt(2)))


def test_the_corner_of_a_cube() -> None:
    quality = MeshQuality.of(qlb.TetMesh(CORNER, [[0, 1, 2, 3]]))
    assert quality.dihedral == pytest.approx((np.degrees(np.arctan(np.sqrt(2))), 90))
    # Radius of the inscribed sphere 3 V / A = 0.5 / (1.5 + sqrt(3) / 2).
    assert quality.aspect[1] == pytest.approx(np.sqrt(2) * (1.5 + np.sqrt(3) / 2) / 0.5 / (2 * np.sqrt(6)))
    assert quality.aspect[1] > 1


def test_angles_of_random_tets_by_another_formula(rng: np.random.Generator) -> None:
    positions = rng.normal(size=(400, 3))
    tets = np.arange(400, dtype=np.int32).reshape(-1, 4)
    negative = np.linalg.det(positions[tets[:, 1:]] - positions[tets[:, :1]]) < 0
    tets[negative] = tets[negative][:, [1, 0, 2, 3]]
    mesh = qlb.TetMesh(positions, tets)
    found = np.sort(dihedral_angles(mesh.positions, mesh.tets), axis=1)
    np.testing.assert_allclose(found, np.sort(surfaces.dihedral_angles(mesh), axis=1), atol=1e-5)
    assert (aspect_ratios(mesh.positions, mesh.tets) >= 1).all()


def test_components_and_rows() -> None:
    box = qlb.TetMesh.box((1, 1, 1), cells=(1, 1, 1))
    two = qlb.TetMesh.union([box, qlb.TetMesh(box.positions + 5, box.tets)])
    quality = MeshQuality.of(two)
    assert (quality.nodes, quality.tets, quality.components) == (16, 12, 2)
    rows = dict(quality.rows())
    assert rows["nodes, tets"] == "16, 12"
    assert rows["size"] == "6 x 6 x 6 m"
    assert rows["volume"] == "2 m^3"
