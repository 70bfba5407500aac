"""L-BFGS whose initial inverse Hessian is a sparse Cholesky factor: QLF and QLB of the paper."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar

import numpy as np

from qlb import _native
from qlb.arrays import FloatArray
from qlb.solvers.descent import Descent
from qlb.solvers.line_search import Point
from qlb.solvers.settings import SolverSettings, Tolerance
from qlb.system import StageProblem, System


class FactoredLbfgs(Descent):
    """p = -H g by the two-loop recursion around one solve with a factor B = L L^T (Nocedal, Wright 2006, alg. 7.4).

    The pairs are dropped before each solve. Which B, a subclass says.
    """

    def __init__(self, system: System, settings: SolverSettings, tolerance: Tolerance) -> None:
        super().__init__(system, settings, tolerance)
        self.history = _native.Lbfgs(3 * system.nodes, self.settings.window, system.threads)

    @property
    def inverse(self) -> _native.InverseOperator:
        """B^-1"""
        return self.factor.cholesky

    @abstractmethod
    def prepare_factor(self, problem: StageProblem, point: Point) -> None:
        """See to it that `self.inverse` is the one to use in this stage, which starts at `point`."""

    def begin_solve(self, problem: StageProblem, point: Point, goal: float) -> None:
        """Drop the pairs of the last solve and see to the factor."""
        self.history.clear()
        self.prepare_factor(problem, point)

    def direction(self, problem: StageProblem, point: Point) -> tuple[FloatArray, float]:
        """-H g, H from the pairs over the factor."""
        with problem.timer.section("solve"):
            p = np.empty_like(point.gradient)
            slope = self.history.direction(point.gradient, self.inverse, p)
            return p, slope

    def accept(self, problem: StageProblem, old: Point, new: Point, *, limited: bool) -> None:
        """Store the pair (s, y) unless its curvature is not positive."""
        self.history.push(old.x, new.x, old.gradient, new.gradient)

    def recover(self, problem: StageProblem, point: Point) -> bool:
        """Drop the pairs and search along -B^-1 g; when that was it already, give up."""
        if self.history.pairs == 0:
            return False
        self.history.clear()
        return True


class QLF(FactoredLbfgs):
    """L-BFGS over the factor of B, the Hessian at the start of the simulation, for the whole run.

    c is part of the Hessian, so a stage with another c (the SDIRK2 step that starts BDF2) has it factorised with its
    own c, at the same positions. Contact has no part in it: when it is made again, for another c or in a resumed run,
    nothing tells any more where planes were and how things slid. The supplement names QLF without defining it; this is
    our reading.
    """

    name: ClassVar[str] = "QLF"
    _start: FloatArray | None = None
    _c: float | None = None

    def prepare_factor(self, problem: StageProblem, point: Point) -> None:
        """Factorise at the first positions ever seen, once for each c."""
        if self._start is None:
            self._start = problem.start
        if problem.stage.c != self._c:
            self._c = None  # should the update fail, no factor is in place
            self.factor.update(problem, self._start, self.settings.projection)
            self._c = problem.stage.c

    def save(self) -> dict[str, FloatArray]:
        """The positions at which the factor is taken."""
        return super().save() | ({} if self._start is None else {"start": self._start})

    def load(self, arrays: dict[str, FloatArray]) -> None:
        """Take the positions back; the factor follows when it is needed."""
        super().load(arrays)
        self._start, self._c = arrays.get("start"), None


class QLB(FactoredLbfgs):
    """L-BFGS over the factor of B, the Hessian at the beginning of each step.

    Stages of one step with the same c (both of SDIRK2) share it. The supplement names QLB without defining it; this is
    our reading.
    """

    name: ClassVar[str] = "QLB"
    _c: float | None = None

    def begin_step(self) -> None:
        """Forget the factor of the last step."""
        self._c = None

    def prepare_factor(self, problem: StageProblem, point: Point) -> None:
        """Factorise at x_k, once a step; with contact where the first stage begins, which is next to it."""
        if problem.stage.c != self._c:
            start = problem.start if point.contact is None else point.x
            self.factor.update(problem, start, self.settings.projection, point.contact)
            self._c = problem.stage.c
