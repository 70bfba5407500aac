"""Stress under stretch and shear, from each material's textbook formula, written down again in F^-T and strains."""

from __future__ import annotations

from collections.abc import Callable

import numpy as np
import pytest

from qlb.materials import MATERIALS
from tests.support import Array

YOUNG, POISSON = 3e4, 0.35
MU = YOUNG / (2 * (1 + POISSON))
LAMBDA = YOUNG * POISSON / ((1 + POISSON) * (1 - 2 * POISSON))
SHARE = 0.4


def st_venant_kirchhoff(F: Array) -> Array:
    E = 0.5 * (F.T @ F - np.eye(3))
    return F @ (2 * MU * E + LAMBDA * np.trace(E) * np.eye(3))


def compressible_neo_hookean(F: Array) -> Array:
    inverse = np.linalg.inv(F).T
    return MU * (F - inverse) + LAMBDA * np.log(np.linalg.det(F)) * inverse


def mooney_rivlin(F: Array) -> Array:
    c1, c2, kappa = 0.5 * MU * (1 - SHARE), 0.5 * MU * SHARE, LAMBDA + 2 / 3 * MU
    J, inverse, C = np.linalg.det(F), np.linalg.inv(F).T, F.T @ F
    I1 = np.trace(C)
    I2 = 0.5 * (I1**2 - np.trace(C @ C))
    first = 2 * c1 * J ** (-2 / 3) * (F - I1 / 3 * inverse)
    second = 2 * c2 * J ** (-4 / 3) * (I1 * F - F @ C - 2 / 3 * I2 * inverse)
    return first + second + kappa * (J - 1) * J * inverse


def rotation_of_shear(F: Array) -> Array:
    """R of a stretch along the axes (none) or of F = 1 + g e1 e2^T: turned by atan(g/2)."""
    g = F[0, 1]
    c, s = 2 / np.sqrt(4 + g * g), g / np.sqrt(4 + g * g)
    return np.array([[c, s, 0], [-s, c, 0], [0, 0, 1]])


def corotational(F: Array) -> Array:
    J = np.linalg.det(F)
    return 2 * MU * (F - rotation_of_shear(F)) + LAMBDA * (J - 1) * J * np.linalg.inv(F).T


def arap(F: Array) -> Array:
    return YOUNG * (F - rotation_of_shear(F))


def linear(F: Array) -> Array:
    strain = 0.5 * (F + F.T) - np.eye(3)
    return 2 * MU * strain + LAMBDA * np.trace(strain) * np.eye(3)


STRESS: dict[str, Callable[[Array], Array]] = {
    "StVK": st_venant_kirchhoff,
    "CNH": compressible_neo_hookean,
    "MR": mooney_rivlin,
    "corotational": corotational,
    "ARAP": arap,
    "linear": linear,
}
STATES = {
    **{f"uniaxial {s}": np.diag([s, 1.0, 1.0]) for s in (0.3, 0.9, 1.0, 1.2, 3.0)},
    **{f"equal volume {s}": np.diag([s, s**-0.5, s**-0.5]) for s in (0.5, 2.0)},
    **{f"shear {g}": np.eye(3) + g * np.outer([1, 0, 0], [0, 1, 0]) for g in (-2.0, 0.1, 1.0, 4.0)},
}


def test_every_material_has_its_closed_form() -> None:
    assert set(STRESS) | {"SNH"} == set(MATERIALS)  # SNH: test_stable_neo_hookean.py


@pytest.mark.parametrize("state", STATES)
@pytest.mark.parametrize("name", STRESS)
def test_stress(name: str, state: str) -> None:
    arguments = {"young": YOUNG} | ({} if name == "ARAP" else {"poisson": POISSON})
    arguments |= {"second_share": SHARE} if name == "MR" else {}
    F = STATES[state]
    measured = MATERIALS[name](**arguments).evaluate(F[None])[1][0]
    expected = STRESS[name](F)
    np.testing.assert_allclose(measured, expected, rtol=0, atol=1e-12 * (np.abs(expected).max() + YOUNG))
