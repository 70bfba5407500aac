"""Stable Neo-Hookean elasticity."""

from __future__ import annotations

from typing import Literal

from qlb.materials.material import IsotropicMaterial
from qlb.settings import PerElement


class StableNeoHookean(IsotropicMaterial):
    """Stable Neo-Hookean (Smith, de Goes, Kim 2018): volume preserving, defined for inverted elements.

    psi = mu/2 (I_C - 3) + lambda/2 (J - alpha)^2 - mu/2 log(I_C + 1), alpha = 1 + mu/lambda - mu/(4 lambda) (eq. 14),
    less its value at rest. `young` and `poisson` are those of its small-strain limit.
    """

    model: Literal["SNH"] = "SNH"

    def kernel_parameters(self) -> tuple[PerElement, ...]:
        """The reparametrised constants: mu = 4/3 mu_Lame, lambda = lambda_Lame + 5/6 mu_Lame (section 3.4)."""
        mu, lam = self.lame()
        return 4.0 / 3.0 * mu, lam + 5.0 / 6.0 * mu
