"""Kinetic energy and momentum of linear tetrahedra, by the mass matrix of the simulation.

Lumped, each node of an element has a quarter of its mass m_e. Consistent, the element's mass matrix is
m_e (1 + delta_ij)/20 (Zienkiewicz, Taylor 2000, vol. 1, ch. 17), whose bilinear form is m_e/20 (sum u.sum v + sum u.v).
"""

from __future__ import annotations

import numpy as np

from qlb.arrays import FloatArray, IntArray
from qlb.system.system import MassKind


def kinetic_energy(velocities: FloatArray, tets: IntArray, mass: FloatArray, kind: MassKind) -> float:
    """1/2 v.M v [J]; velocities (n, 3) [m/s], masses (m,) [kg]."""
    v = velocities[tets]
    squares = np.einsum("mai,mai->m", v, v)
    if kind == "lumped":
        return float(0.125 * np.dot(mass, squares))
    total = v.sum(axis=1)
    return float(np.dot(mass, np.einsum("mi,mi->m", total, total) + squares) / 40)


def linear_momentum(velocities: FloatArray, tets: IntArray, mass: FloatArray) -> FloatArray:
    """Integral of density times velocity [kg m/s], shape (3,): the same for both kinds of mass matrix."""
    return np.asarray(0.25 * mass @ velocities[tets].sum(axis=1))


def angular_momentum(
    arms: FloatArray, velocities: FloatArray, tets: IntArray, mass: FloatArray, kind: MassKind
) -> FloatArray:
    """x cross M v [kg m^2/s], shape (3,); `arms` are positions from the point that it is about (n, 3) [m]."""
    r, v = arms[tets], velocities[tets]
    nodal = np.cross(r, v).sum(axis=1)
    if kind == "lumped":
        return np.asarray(0.25 * mass @ nodal)
    return np.asarray(mass @ (np.cross(r.sum(axis=1), v.sum(axis=1)) + nodal) / 20)
