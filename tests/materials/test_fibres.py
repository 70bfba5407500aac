"""Fibres (Kim, de Goes, Iben 2019), by the compiled densities and as part of a whole body."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Fibres, InputError, Simulation, StableNeoHookean, TetMesh, _native
from tests.materials.deformations import KINDS
from tests.support import Array, difference, random_rotation

MODULUS = 3e4
AXIS = np.array([1.0, 2.0, -0.5])
UNIT = AXIS / np.linalg.norm(AXIS)
MODELS = ["sqrtI5", "StVK"]
SMOOTH = ["random", "random, not inverted", "near rest", "rotated", "inverted", "two stretches equal", "slender"]


def evaluate(model: str, F: Array, *, project: bool = False) -> tuple[Array, Array, Array]:
    count = len(F)
    psi, P, C = np.empty(count), np.empty((count, 3, 3)), np.empty((count, 9, 9))
    table = np.tile([MODULUS, *UNIT], (count, 1))
    _native.evaluate_density(Fibres(model=model).kernels, np.ascontiguousarray(F), table, project, psi, P, C)
    return psi, P, C


def fibre_sign(F: Array) -> Array:
    """The sign of a.S a with F = R S, R the nearest rotation, by numpy's SVD."""
    U, sigma, Vt = np.linalg.svd(F)
    sigma[:, 2] *= np.linalg.det(U) * np.linalg.det(Vt)
    return np.sign(np.einsum("kij,j,ki->k", Vt, UNIT, sigma * (Vt @ UNIT)))


def smooth_nearby(F: Array, step: float) -> Array:
    """Those F whose fibre keeps a length and a sign within the reach of a difference: the model jumps where I4 = 0."""
    around = [fibre_sign(F + d * u) for u in np.eye(9).reshape(9, 3, 3) for d in (-2 * step, 2 * step)]
    kept = np.all(np.array(around) == around[0], axis=0) & (np.linalg.norm(F @ UNIT, axis=1) > 0.1)
    assert kept.mean() > 0.7
    return F[kept]


@pytest.mark.parametrize("kind", SMOOTH)
@pytest.mark.parametrize("model", MODELS)
def test_derivatives(model: str, kind: str, rng: np.random.Generator) -> None:
    F = KINDS[kind](rng)
    if model == "sqrtI5":
        F = smooth_nearby(F, 1e-3)
    _, P, C = evaluate(model, F)
    units = np.eye(9).reshape(9, 3, 3)
    dpsi = np.stack([difference(lambda G: evaluate(model, G)[0], F, u, 1e-3) for u in units], axis=1)
    dP = np.stack([difference(lambda G: evaluate(model, G)[1], F, u, 1e-3).reshape(-1, 9) for u in units], axis=2)
    np.testing.assert_allclose(dpsi, P.reshape(-1, 9), rtol=0, atol=1e-6 * (np.abs(P).max() + MODULUS))
    np.testing.assert_allclose(dP, C, rtol=0, atol=1e-6 * np.abs(C).max())


@pytest.mark.parametrize("kind", SMOOTH)
@pytest.mark.parametrize("model", MODELS)
def test_projection_clamps_the_eigenvalues_at_zero(model: str, kind: str, rng: np.random.Generator) -> None:
    F = KINDS[kind](rng)
    exact, projected = evaluate(model, F)[2], evaluate(model, F, project=True)[2]
    values, vectors = np.linalg.eigh(exact)
    clamped = np.einsum("kip,kp,kjp->kij", vectors, np.maximum(values, 0.0), vectors)
    scale = np.abs(exact).max(axis=(1, 2), keepdims=True) + MODULUS
    assert (np.abs(projected - clamped) / scale).max() <= 1e-13


@pytest.mark.parametrize("stretch", [0.3, 1.0, 1.7])
def test_stress_of_a_stretch_along_the_fibre(stretch: float) -> None:
    # F a = s a: psi = mu/2 (s - 1)^2 and mu/2 (s^2 - 1)^2; P = psi'(s) a a^T
    F = np.eye(3) + (stretch - 1) * np.outer(UNIT, UNIT)
    slopes = {"sqrtI5": MODULUS * (stretch - 1), "StVK": 2 * MODULUS * (stretch**2 - 1) * stretch}
    for model, slope in slopes.items():
        expected = slope * np.outer(UNIT, UNIT)
        np.testing.assert_allclose(evaluate(model, F[None])[1][0], expected, rtol=1e-12, atol=1e-10)


def test_a_fibre_turned_inside_out_is_pulled_back() -> None:
    # I4 = a.S a = -0.5, sqrt I5 = 0.5: psi = mu/2 (0.5 + 1)^2, and the force goes on shortening it towards zero.
    F = np.eye(3) - 1.5 * np.outer(UNIT, UNIT)
    psi, P, _ = evaluate("sqrtI5", F[None])
    assert psi[0] == pytest.approx(0.5 * MODULUS * 1.5**2, rel=1e-12)
    np.testing.assert_allclose(P[0], -1.5 * MODULUS * np.outer(UNIT, UNIT), rtol=1e-12, atol=1e-10)


@pytest.mark.parametrize("model", MODELS)
def test_energy_is_objective_but_not_isotropic(model: str, rng: np.random.Generator) -> None:
    F, R = KINDS["random"](rng), random_rotation(rng)
    psi = evaluate(model, F)[0]
    np.testing.assert_allclose(evaluate(model, R @ F)[0], psi, rtol=1e-11, atol=1e-9)
    assert not np.allclose(evaluate(model, F @ R)[0], psi, rtol=1e-3)


def test_fibres_stiffen_a_body_along_their_direction_only() -> None:
    mesh = TetMesh.box((1.0, 0.25, 0.25), cells=(6, 2, 2))
    drops = {}
    for name, direction in {"none": None, "along": (1.0, 0.0, 0.0), "across": (0.0, 0.0, 1.0)}.items():
        fibres = () if direction is None else (Fibres(modulus=1e6, direction=direction),)
        simulation = Simulation(
            mesh,
            material=StableNeoHookean(young=1e5, poisson=0.3),
            fibres=fibres,
            integrator="quasistatic",
            gravity=(1.0, 0.0, 0.0),
            threads=1,
        )
        simulation.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
        drops[name] = (simulation.advance().positions - mesh.positions)[:, 0].max()
    assert drops["along"] < 0.15 * drops["none"]  # E and E + 10 E in parallel
    assert drops["across"] == pytest.approx(drops["none"], rel=0.1)


def test_directions_may_differ_and_need_no_unit_length() -> None:
    mesh = TetMesh.box(cells=(2, 1, 1))
    constant = Fibres(modulus=5.0, direction=(0.0, 3.0, 4.0)).parameter_table(mesh)
    np.testing.assert_allclose(constant, np.tile([5.0, 0.0, 0.6, 0.8], (12, 1)), rtol=1e-15)
    of_place = Fibres(modulus=5.0, direction=lambda x: np.stack([x[:, 0], 0 * x[:, 0], 0 * x[:, 0]], axis=1))
    np.testing.assert_allclose(of_place.parameter_table(mesh)[:, 1:], np.tile([1.0, 0.0, 0.0], (12, 1)))


def test_directions_may_be_expressions_of_place() -> None:
    mesh = TetMesh.box(cells=(2, 1, 1))
    found = Fibres(modulus=5.0, direction=("-y", "1e-1 + x", 0)).parameter_table(mesh)[:, 1:]
    x, y, _ = mesh.centroids().T
    expected = np.stack([-y, 0.1 + x, 0 * x], axis=1)
    np.testing.assert_allclose(found, expected / np.linalg.norm(expected, axis=1)[:, None], rtol=1e-14)
    listed = Fibres(direction=np.arange(36.0).reshape(12, 3).tolist())
    np.testing.assert_array_equal(listed.direction, np.arange(36.0).reshape(12, 3))


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({"direction": ("x", "y")}, ["direction", "three numbers or expressions"]),
        ({"direction": ("x", "y", "w")}, ["direction", "'w', which is not known"]),
        ({"direction": ("x", True, 0)}, ["direction", "three numbers or expressions"]),
        ({"direction": ("x - x", 0, 0)}, ["fibre direction of element 0", "length > 0"]),
        ({"direction": (0.0, 0.0, 0.0)}, ["fibre direction of element 0", "length > 0"]),
        ({"direction": np.ones((3, 3))}, ["(3, 3)", "(12, 3)"]),
        ({"direction": lambda x: x * np.nan}, ["element 0", "length > 0"]),
        ({"modulus": -1.0}, ["modulus", "-1", ">= 0 Pa"]),
        ({"modulus": np.ones(5)}, ["(5,)", "12"]),
        ({"model": "rope"}, ["model", "rope"]),
    ],
    ids=lambda value: str(sorted(value)) if isinstance(value, dict) else None,
)
def test_wrong_fibres_are_refused(arguments: dict[str, object], words: list[str]) -> None:
    with pytest.raises(InputError) as refusal:
        Fibres(**arguments).parameter_table(TetMesh.box(cells=(2, 1, 1)))  # type: ignore[arg-type]
    for word in words:
        assert word in str(refusal.value)
