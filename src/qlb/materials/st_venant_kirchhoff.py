"""St. Venant-Kirchhoff elasticity."""

from __future__ import annotations

from typing import Literal

from qlb.materials.material import IsotropicMaterial


class StVenantKirchhoff(IsotropicMaterial):
    """St. Venant-Kirchhoff: linear in Green's strain; weak, then unstable in compression.

    psi = mu E:E + lambda/2 (tr E)^2, E = (F^T F - 1)/2 (Bonet, Wood 2008, eq. 6.23).
    """

    model: Literal["StVK"] = "StVK"
