"""Mooney-Rivlin elasticity."""

from __future__ import annotations

from typing import ClassVar, Literal

from qlb.materials.material import Domain, IsotropicMaterial
from qlb.settings import PerElement, quantity


class MooneyRivlin(IsotropicMaterial):
    """Mooney-Rivlin in its nearly incompressible form, for rubber; no start with inverted elements.

    psi = c1 (J^-2/3 I1 - 3) + c2 (J^-4/3 I2 - 3) + kappa/2 (J - 1)^2 (Bonet, Wood 2008, section 6.5.3), not defined for
    J <= 0. 2 (c1 + c2) = mu and kappa = lambda + 2/3 mu are those of `young` and `poisson`.
    """

    domain: ClassVar[Domain] = "det F > 0"
    model: Literal["MR"] = "MR"
    second_share: PerElement = quantity(0.25, "c2/(c1 + c2), the part of the second invariant", ge=0, le=1)

    def kernel_parameters(self) -> tuple[PerElement, ...]:
        """c1, c2 and kappa."""
        mu, lam = self.lame()
        return 0.5 * mu * (1 - self.second_share), 0.5 * mu * self.second_share, lam + 2.0 / 3.0 * mu
