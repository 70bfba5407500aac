"""A Python function of position."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from typing import Any, NoReturn

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.fields.varying import Varying
from qlb.mesh.tet_mesh import TetMesh


@dataclass(frozen=True)
class Function(Varying):
    """A Python function: centroids of the elements at rest (m, 3) [m] -> values (m,)."""

    function: Callable[[FloatArray], npt.ArrayLike]

    def on(self, mesh: TetMesh) -> FloatArray:
        """Its values (m,). Raises `InputError` where they are not numbers or have another shape."""
        given: Any = self.function(mesh.centroids())
        try:
            values = np.array(given, dtype=np.float64)
        except (TypeError, ValueError, OverflowError):
            raise InputError(f"{self} gives no numbers but {type(given).__name__}") from None
        if values.shape != (len(mesh.tets),):
            raise InputError(f"{self} gives shape {values.shape}, must be ({len(mesh.tets)},)")
        return values

    def written(self) -> NoReturn:
        """A scene file cannot hold it: raises `InputError`."""
        raise InputError(f"{self} cannot be written to a scene file; use an expression such as '2e4 * (1 + x)'")

    def __str__(self) -> str:
        """Names the function."""
        return f"the function {getattr(self.function, '__name__', type(self.function).__name__)}"
