"""Fibres: anisotropy that is added to an isotropic material."""

from __future__ import annotations

from collections.abc import Callable
from typing import Annotated, Any, Literal

import numpy as np
from pydantic import BeforeValidator, Field, PlainSerializer, WithJsonSchema

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.fields import VectorExpression
from qlb.mesh import TetMesh
from qlb.settings import PerElement, Settings, on_mesh, plain, quantity


def _direction(value: Any) -> Any:
    """`value`, made three expressions or an array where it is written as such."""
    if isinstance(value, list | tuple) and any(isinstance(part, str) for part in value):
        if len(value) != 3 or any(isinstance(part, bool) or not isinstance(part, str | int | float) for part in value):
            raise InputError(f"{value!r} must be three numbers or expressions of x, y, z")
        return VectorExpression(tuple(value))
    if isinstance(value, list) and any(isinstance(part, list | tuple) for part in value):
        try:
            return np.array(value, dtype=np.float64)
        except (TypeError, ValueError):
            raise InputError("must be three numbers or expressions of x, y, z, or three numbers per element") from None
    return value


_TRIPLE = {"type": "array", "items": {"type": "number"}, "minItems": 3, "maxItems": 3}

Direction = Annotated[
    tuple[float, float, float] | VectorExpression | FloatArray | Callable[[FloatArray], FloatArray],
    BeforeValidator(_direction),
    PlainSerializer(plain, when_used="json"),
    WithJsonSchema({"type": "array", "items": {"anyOf": [{"type": ["number", "string"]}, _TRIPLE]}, "minItems": 1}),
]


class Fibres(Settings):
    """A family of fibres (Kim, de Goes, Iben 2019), with a rest direction a in each element and I5 = |F a|^2.

    sqrtI5: psi = mu/2 (sqrt I5 - s)^2, s the sign of I4 = a.S a, F = R S: its force on an inverted fibre leads back.
    StVK: psi = mu/2 (I5 - 1)^2, stiffer the longer; weak in compression.
    """

    model: Literal["sqrtI5", "StVK"] = Field("sqrtI5", description="Energy of a fibre")
    modulus: PerElement = quantity(2e4, "Fibre modulus mu", unit="Pa", ge=0)
    direction: Direction = Field(
        (1.0, 0.0, 0.0),
        description="Rest direction, of any length > 0: three numbers or expressions of x, y, z; also one per element"
        " (m, 3), and from Python a function of the elements' centroids (m, 3) [m] that gives that",
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
        given: Any = self.direction
        if isinstance(given, VectorExpression):
            given = given.on(mesh)
        directions = np.asarray(given(mesh.centroids()) if callable(given) else given, dtype=np.float64)
        if directions.shape not in ((3,), (count, 3)):
            raise InputError(f"fibre directions have shape {directions.shape}, must be (3,) or ({count}, 3)")
        directions = np.broadcast_to(directions, (count, 3))
        with np.errstate(over="ignore"):
            length = np.linalg.norm(directions, axis=1)
        bad = ~(np.isfinite(length) & (length > 0))
        if bad.any():
            e = int(np.argmax(bad))
            raise InputError(f"fibre direction of element {e} is {directions[e].tolist()}, must have a length > 0")
        columns = [np.broadcast_to(modulus, (count,)), directions / length[:, None]]
        return np.ascontiguousarray(np.column_stack(columns))
