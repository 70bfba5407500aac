"""Deformation gradients of linear tetrahedra and what is made of them."""

from __future__ import annotations

import numpy as np

from qlb.arrays import FloatArray, IntArray


def edges(positions: FloatArray, tets: IntArray) -> FloatArray:
    """x1 - x0, x2 - x0, x3 - x0 of each tet as columns [m], shape (m, 3, 3)."""
    corners = positions[tets]
    return np.asarray((corners[:, 1:] - corners[:, :1]).transpose(0, 2, 1))


def deformation_gradients(positions: FloatArray, tets: IntArray, inverse_rest: FloatArray) -> FloatArray:
    """F = D_s D_m^-1 of each tet, shape (m, 3, 3), at positions (n, 3) [m].

    `inverse_rest` (m, 3, 3) [1/m] are the inverses of the edges at rest (Bonet, Wood 2008, section 9.2).
    """
    return np.asarray(edges(positions, tets) @ inverse_rest)


def green_lagrange(F: FloatArray) -> FloatArray:
    """E = (F^T F - 1)/2, shape (m, 3, 3)."""
    return np.asarray(0.5 * (F.transpose(0, 2, 1) @ F - np.eye(3)))


def principal_stretches(F: FloatArray) -> FloatArray:
    """Singular values of F, the largest first, shape (m, 3); the last with the sign of J, which is their product."""
    stretches = np.linalg.svd(F, compute_uv=False)
    stretches[:, 2] *= np.where(np.linalg.det(F) < 0, -1.0, 1.0)
    return np.asarray(stretches)
