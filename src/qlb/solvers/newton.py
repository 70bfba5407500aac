"""Newton's method with a direct solver."""

from __future__ import annotations

from typing import ClassVar

from qlb.arrays import FloatArray
from qlb.solvers.descent import Descent
from qlb.solvers.line_search import Point
from qlb.solvers.settings import Projection
from qlb.system import StageProblem


class ND(Descent):
    """Newton: p = -H(x)^-1 g, with a fresh Cholesky factor each iteration.

    How H is kept positive definite is `SolverSettings.projection`. The supplement names ND without defining it; this
    is our reading.
    """

    name: ClassVar[str] = "ND"
    _forced: Projection | None = None

    def direction(self, problem: StageProblem, point: Point) -> tuple[FloatArray, float]:
        """-H^-1 g."""
        self.factor.update(problem, point.x, self._forced or self.settings.projection, point.contact)
        p = -self.factor.solve(problem, point.gradient)
        return p, problem.system.dot(point.gradient, p)

    def accept(self, old: Point, new: Point, *, limited: bool) -> None:
        """Go back to the projection that was asked for."""
        self._forced = None

    def begin_solve(self, problem: StageProblem, point: Point, goal: float) -> None:
        """Start with the projection that was asked for."""
        self._forced = None

    def recover(self, problem: StageProblem, point: Point) -> bool:
        """Where the exact Hessian gave a direction that leads nowhere, try the projected one."""
        if self.factor.projected or self.settings.projection == "never":
            return False
        self._forced = "always"
        return True
