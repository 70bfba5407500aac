"""Strain and stress against closed forms, and against the forces that the time loop feels."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.optimize import brentq

import qlb
from qlb.analysis import Snapshot
from qlb.analysis.stress import von_mises
from qlb.materials import MATERIALS
from tests.materials.test_closed_forms import LAMBDA, MU, POISSON, SHARE, STRESS, YOUNG
from tests.support import Array, elastic_gradient, left_end, random_rotation, right_end, small_bar, start_at

STRETCH = np.array([[1.3, 0.2, 0], [0, 0.9, 0], [0, 0, 0.95]])


def deformed(material: qlb.StableNeoHookean, F: Array, **arguments: object) -> Snapshot:
    """A bar under the deformation gradient F."""
    mesh = small_bar()
    simulation = qlb.Simulation(mesh, material=material, threads=1, **arguments)  # type: ignore[arg-type]
    return Snapshot.of(start_at(simulation, mesh.positions @ F.T + [1.0, -2.0, 0.5]))


@pytest.mark.parametrize("name", STRESS)
def test_a_uniform_deformation_has_the_stress_of_the_closed_form(name):
    arguments = {"young": YOUNG} | ({} if name == "ARAP" else {"poisson": POISSON})
    arguments |= {"second_share": SHARE} if name == "MR" else {}
    for F in (np.diag([1.4, 0.9, 0.8]), np.eye(3) + 0.3 * np.outer([1, 0, 0], [0, 1, 0])):
        state = deformed(MATERIALS[name](**arguments), F)
        P = STRESS[name](F)
        sigma = P @ F.T / np.linalg.det(F)
        np.testing.assert_allclose(state.deformation_gradient, np.broadcast_to(F, (18, 3, 3)), atol=1e-12)
        np.testing.assert_allclose(state.first_piola_kirchhoff_stress, np.broadcast_to(P, (18, 3, 3)), atol=1e-8)
        np.testing.assert_allclose(state.cauchy_stress, np.broadcast_to(sigma, (18, 3, 3)), atol=1e-8)
        np.testing.assert_allclose(state.at_nodes(state.cauchy_stress), np.broadcast_to(sigma, (16, 3, 3)), atol=1e-8)


def test_a_bar_that_is_pulled_has_uniaxial_stress():
    # Ends held along the bar alone: the sides contract until P_yy = mu (s - 1/s) + lambda log(l s^2)/s = 0.
    mesh, length = small_bar((6, 2, 2)), 1.25
    material = qlb.CompressibleNeoHookean(young=YOUNG, poisson=POISSON)
    tight = qlb.Tolerance(relative=1e-11)
    pull = qlb.Simulation(
        mesh, material=material, integrator="quasistatic", gravity=(0, 0, 0), tolerance=tight, step=1.0, threads=1
    )
    pull.pin(left_end(mesh), "x")
    pull.move(right_end(mesh), lambda anchors, time: anchors + np.array([0.75 * (length - 1) * time, 0, 0]), "x")
    pull.pin([0], "yz")
    pull.pin([int(np.argmax(mesh.positions @ [-100, 1, -1]))], "z")
    pull.advance()
    side = brentq(lambda s: MU * (s - 1 / s) + LAMBDA * np.log(length * s * s) / s, 0.5, 1.0, xtol=1e-15)
    axial = (MU * (length**2 - 1) + LAMBDA * np.log(length * side**2)) / (length * side**2)
    state = Snapshot.of(pull)
    np.testing.assert_allclose(state.von_mises_stress, axial, rtol=1e-6)
    np.testing.assert_allclose(state.cauchy_stress[:, 0, 0], axial, rtol=1e-6)
    np.testing.assert_allclose(state.cauchy_stress[:, 1, 1], 0, atol=1e-6 * axial)
    np.testing.assert_allclose(state.principal_stretches, np.tile([length, side, side], (144, 1)), rtol=1e-6)
    np.testing.assert_allclose(state.at_surface(state.von_mises_stress), axial, rtol=1e-6)


def test_von_mises_of_tension_shear_and_pressure(rng):
    Q = random_rotation(rng)
    pull, shear, pressure = np.diag([7.0, 0, 0]), np.array([[0, 3, 0], [3, 0, 0], [0, 0, 0.0]]), -5 * np.eye(3)
    turned = np.stack([Q @ s @ Q.T for s in (pull, shear, pressure, pull + pressure)])
    np.testing.assert_allclose(von_mises(turned), [7, 3 * np.sqrt(3), 0, 7], atol=1e-12)


def test_strain(rng):
    Q = random_rotation(rng)
    state = deformed(qlb.StableNeoHookean(), Q @ STRETCH)
    E = 0.5 * (STRETCH.T @ STRETCH - np.eye(3))
    np.testing.assert_allclose(state.green_lagrange_strain, np.broadcast_to(E, (18, 3, 3)), atol=1e-12)
    squares = np.sort(np.linalg.eigvalsh(STRETCH.T @ STRETCH))[::-1]
    np.testing.assert_allclose(state.principal_stretches**2, np.tile(squares, (18, 1)), rtol=1e-12)
    np.testing.assert_allclose(state.volume_ratio, np.linalg.det(STRETCH), rtol=1e-12)


def test_the_last_stretch_of_an_inverted_tet_is_negative():
    state = deformed(qlb.StableNeoHookean(), np.diag([1.2, 1.1, -0.5]))
    np.testing.assert_allclose(state.principal_stretches, np.tile([1.2, 1.1, -0.5], (18, 1)), rtol=1e-12)


def test_stress_and_energy_are_those_of_the_time_loop(rng):
    # Two bodies of different materials, one heterogeneous and with two families of fibres: forces from P by the
    # gradients of the shape functions, against those that the compiled energies give.
    mesh = small_bar()
    bodies = [
        qlb.Body(
            mesh,
            qlb.StableNeoHookean(young="2e4 * (1 + x)"),
            fibres=[qlb.Fibres(direction=(1, 1, 0)), qlb.Fibres(model="StVK", direction=("1", "x", "0"))],
        ),
        qlb.Body(mesh, qlb.MooneyRivlin(), placement=qlb.Placement(translation=(0, 1, 0))),
    ]
    simulation = qlb.Simulation(bodies, contact=False, threads=1)
    x = simulation.mesh.positions + 0.02 * rng.normal(size=simulation.mesh.positions.shape)
    state = Snapshot.of(start_at(simulation, x))
    whole = state.constitution
    per_corner = np.einsum("m,mik,mak->mai", whole.volumes, state.first_piola_kirchhoff_stress, whole.inverse_rest)
    forces = np.zeros_like(x)
    np.add.at(forces, whole.mesh.tets[:, 1:], per_corner)
    np.add.at(forces, whole.mesh.tets[:, 0], -per_corner.sum(axis=1))
    system = simulation.system
    gradient = elastic_gradient(system, x)
    for fibres in system.potentials[2:]:
        fibres.add_value_gradient(x, 1.0, gradient)
    np.testing.assert_allclose(forces, gradient, atol=1e-10 * np.abs(gradient).max())
    energy = sum(p.add_value_gradient(x, 1.0, np.zeros_like(x)) for p in system.potentials)
    assert state.energies.elastic == pytest.approx(energy, rel=1e-12)


def test_means_at_nodes_are_weighted_by_volume(rng):
    state = deformed(qlb.StableNeoHookean(), np.eye(3))
    mesh, values = state.constitution.mesh, rng.normal(size=(18, 2))
    for node in range(len(mesh.positions)):
        of_node = (mesh.tets == node).any(axis=1)
        expected = np.average(values[of_node], axis=0, weights=mesh.volumes()[of_node])
        np.testing.assert_allclose(state.at_nodes(values)[node], expected, rtol=1e-12)
