"""Expressions of position."""

from __future__ import annotations

from dataclasses import dataclass, field

import numpy as np

from qlb.arrays import FloatArray
from qlb.fields.formula import Formula
from qlb.fields.varying import Varying
from qlb.mesh.tet_mesh import TetMesh

VARIABLES = ("x", "y", "z")


@dataclass(frozen=True)
class Expression(Varying):
    """A formula of the rest position x, y, z [m] of an element's centroid, such as "2e4 * (1 + 9 * (x > 0.5))".

    Attributes:
        text: the formula, with runs of white space made one blank.

    Raises:
        InputError: anything that `allowed` does not name; the message names it, with its column.
    """

    text: str
    _formula: Formula = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        formula = Formula(self.text, VARIABLES)
        object.__setattr__(self, "text", formula.text)
        object.__setattr__(self, "_formula", formula)

    @property
    def is_constant(self) -> bool:
        """Whether it has the same value everywhere."""
        return self._formula.is_constant

    def at(self, points: FloatArray) -> FloatArray:
        """Its values at `points` (k, 3) [m], shape (k,); infinite or NaN where it is not defined."""
        return np.array(np.broadcast_to(self._formula(*points.T), (len(points),)))

    def on(self, mesh: TetMesh) -> FloatArray:
        """Its values at the centroids of the elements, shape (m,)."""
        return self.at(mesh.centroids())

    def written(self) -> str:
        """The text."""
        return self.text

    def __str__(self) -> str:
        """Quotes the text."""
        return f"the expression {self._formula}"


@dataclass(frozen=True)
class VectorExpression(Varying):
    """Three expressions of the rest position, such as ("-y", "x", 0).

    Raises:
        InputError: as `Expression`.
    """

    components: tuple[str | float, ...]
    _expressions: tuple[Expression, ...] = field(init=False, repr=False, compare=False)

    def __post_init__(self) -> None:
        object.__setattr__(self, "_expressions", tuple(Expression(str(component)) for component in self.components))

    def on(self, mesh: TetMesh) -> FloatArray:
        """Its values at the centroids of the elements, shape (m, 3)."""
        return np.stack([expression.on(mesh) for expression in self._expressions], axis=1)

    def written(self) -> list[str | float]:
        """The components."""
        return list(self.components)

    def __str__(self) -> str:
        """Names the components."""
        return f"the expressions {', '.join(map(str, self.components))}"
