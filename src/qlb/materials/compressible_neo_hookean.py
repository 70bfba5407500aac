"""Compressible Neo-Hookean elasticity."""

from __future__ import annotations

from typing import ClassVar, Literal

from qlb.materials.material import Domain, IsotropicMaterial


class CompressibleNeoHookean(IsotropicMaterial):
    """Compressible Neo-Hookean, infinite at collapse: no start with inverted elements.

    psi = mu/2 (I_C - 3) - mu log J + lambda/2 log(J)^2 (Bonet, Wood 2008, eq. 6.27), not defined for J <= 0.
    """

    domain: ClassVar[Domain] = "det F > 0"
    model: Literal["CNH"] = "CNH"
