"""Backtracking line search."""

from __future__ import annotations

from dataclasses import dataclass, replace
from functools import cached_property
from math import isfinite

from qlb.arrays import FloatArray
from qlb.contact.stage import ContactPoint
from qlb.system import StageProblem

ARMIJO = 1e-4
ROUNDING = 1e-11
MAX_HALVINGS = 30
LEARNT = 0.5  # of friction's stiffness, a bound, what pairs are to find out


@dataclass(frozen=True)
class Point:
    """A point with the energy and gradient there."""

    x: FloatArray
    energy: float
    gradient: FloatArray
    residual: float
    smooth: FloatArray
    """the gradient without contact"""
    contact: ContactPoint | None = None

    @cached_property
    def secant(self) -> FloatArray:
        """The gradient that pairs hold the change of where there is contact: without it, but with half its friction."""
        sliding = None if self.contact is None else self.contact.sliding
        return self.smooth if sliding is None else self.smooth + LEARNT * sliding

    @property
    def is_finite(self) -> bool:
        """Whether the energy and every entry of the gradient are numbers."""
        return isfinite(self.energy) and isfinite(self.residual)

    def after(self, before: Point) -> Point:
        """The same, with what contact learns from the step from the point `before`."""
        if self.contact is None or before.contact is None or self.contact.friction is None:
            return self
        return replace(self, contact=self.contact.after(before.contact))

    @staticmethod
    def at(problem: StageProblem, x: FloatArray, *, on_way: bool = False) -> Point:
        """Evaluate `problem` at `x`; `on_way`: on the way that contact has bounded last."""
        found = problem.evaluate(x, on_way=on_way)
        residual = problem.residual(found.gradient)
        return Point(x, found.energy, found.gradient, residual, found.smooth, found.contact)


def backtrack(
    problem: StageProblem, start: Point, p: FloatArray, slope: float, longest: float = 1.0
) -> tuple[float, Point] | None:
    """The first of t = `longest`, half of it, ... that decreases E enough along `p`; None where none does.

    Enough is Armijo's condition E(x + t p) <= E(x) + 1e-4 t g.p. Where the change of E is below 1e-11 |E|, or below
    what rounding leaves of the element energies, a point is taken if |g| does not grow. A trial that is not finite
    counts as too far.
    """
    rounding = max(ROUNDING * abs(start.energy), problem.energy_rounding)
    t = longest
    for _ in range(MAX_HALVINGS):
        trial = Point.at(problem, start.x + (p if t == 1.0 else t * p), on_way=True)
        if trial.is_finite:
            change = trial.energy - start.energy
            if change <= ARMIJO * t * slope:
                return t, trial
            if abs(change) <= rounding and trial.residual <= start.residual:
                return t, trial
        t *= 0.5
    return None
