"""Linear elasticity."""

from __future__ import annotations

from typing import ClassVar, Literal

from qlb.materials.material import IsotropicMaterial


class LinearElastic(IsotropicMaterial):
    """Linear elasticity: for small strains and rotations; it is not objective.

    psi = mu eps:eps + lambda/2 (tr eps)^2, eps = (F + F^T)/2 - 1.
    """

    objective: ClassVar[bool] = False
    model: Literal["linear"] = "linear"
