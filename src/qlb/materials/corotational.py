"""Materials of the distance to the nearest rotation."""

from __future__ import annotations

from typing import ClassVar, Literal

from qlb.materials.material import Domain, IsotropicMaterial, Material
from qlb.settings import PerElement, quantity


class FixedCorotational(IsotropicMaterial):
    """Fixed corotational (Stomakhin, Howes, Schroeder, Teran 2012), defined for inverted elements.

    psi = mu |F - R|^2 + lambda/2 (J - 1)^2, R the rotation nearest to F.
    """

    domain: ClassVar[Domain] = "unique R"
    model: Literal["corotational"] = "corotational"


class Arap(Material):
    """As rigid as possible (Sorkine, Alexa 2007), defined for inverted elements; its Poisson's ratio is 0.

    psi = mu |F - R|^2, R the rotation nearest to F, mu = young/2.
    """

    domain: ClassVar[Domain] = "unique R"
    model: Literal["ARAP"] = "ARAP"
    young: PerElement = quantity(2e4, "Young's modulus", unit="Pa", gt=0)

    def modulus(self) -> PerElement:
        """Young's modulus [Pa]."""
        return self.young

    def kernel_parameters(self) -> tuple[PerElement, ...]:
        """mu alone."""
        return (0.5 * self.young,)
