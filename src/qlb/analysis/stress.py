"""Stress measures, from the first Piola-Kirchhoff stress (Bonet, Wood 2008, chapter 5)."""

from __future__ import annotations

import numpy as np

from qlb.arrays import FloatArray


def cauchy(P: FloatArray, F: FloatArray) -> FloatArray:
    """sigma = P F^T/J [Pa], shape (m, 3, 3); not finite where a tet is flat."""
    with np.errstate(divide="ignore", invalid="ignore"):
        return np.asarray(P @ F.transpose(0, 2, 1) / np.linalg.det(F)[:, None, None])


def von_mises(sigma: FloatArray) -> FloatArray:
    """sqrt(3/2 s:s) [Pa], s the deviator of the symmetric part of sigma (m, 3, 3), shape (m,)."""
    s = 0.5 * (sigma + sigma.transpose(0, 2, 1))
    s = s - np.trace(s, axis1=1, axis2=2)[:, None, None] / 3 * np.eye(3)
    return np.asarray(np.sqrt(1.5 * np.einsum("mij,mij->m", s, s)))
