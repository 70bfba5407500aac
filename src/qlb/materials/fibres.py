"""Fibres: anisotropy that is added to an isotropic material."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any, Literal

import numpy as np
from pydantic import Field

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.mesh import TetMesh
from qlb.settings import PerElement, Settings, on_mesh, quantity

Direction = tuple[float, float, float] | FloatArray | Callable[[FloatArray], FloatArray]


class Fibres(Settings):
    """A family of fibres (Kim, de Goes, Iben 2019), with a rest direction a in each element and I5 = |F a|^2.

    sqrtI5: psi = mu/2 (sqrt I5 - s)^2, s the sign of I4 = a.S a, F = R S: its force on an inverted fibre leads back.
    StVK: psi = mu/2 (I5 - 1)^2, stiffer the longer; weak in compression.
    """

    model: Literal["sqrtI5", "StVK"] = Field("sqrtI5", description="Energy of a fibre")
    modulus: PerElement = quantity(2e4, "Fibre modulus mu", unit="Pa", ge=0)
    direction: Direction = Field(
        (1.0, 0.0, 0.0),
        description="Rest direction, of any length > 0; from Python also one per element (m, 3), or a function of the"
        " elements' centroids (m, 3) [m] that gives that",
    )

    @property
    def kernels(self) -> str:
        """Name of the compiled kernels."""
        return f"fibre-{self.model}"

    def parameter_table(self, mesh: TetMesh) -> FloatArray:
        """mu and the unit direction of each element, shape (m, 4).

        Raises:
            InputError: a modulus that does not fit the mesh or is out of range, directions of another shape, or one
                that is not finite or has no length; the element is named.
        """
        count = len(mesh.tets)
        modulus: Any = on_mesh(self, "fibre", mesh).modulus
        given = self.direction(mesh.centroids()) if callable(self.direction) else self.direction
        directions = np.asarray(given, dtype=np.float64)
        if directions.shape not in ((3,), (count, 3)):
            raise InputError(f"fibre directions have shape {directions.shape}, must be (3,) or ({count}, 3)")
        directions = np.broadcast_to(directions, (count, 3))
        length = np.linalg.norm(directions, axis=1)
        bad = ~(np.isfinite(length) & (length > 0))
        if bad.any():
            e = int(np.argmax(bad))
            raise InputError(f"fibre direction of element {e} is {directions[e].tolist()}, must have a length > 0")
        columns = [np.broadcast_to(modulus, (count,)), directions / length[:, None]]
        return np.ascontiguousarray(np.column_stack(columns))
