"""The loop that all solvers share: direction, line search, convergence."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import ClassVar

import numpy as np

from qlb.arrays import FloatArray
from qlb.solvers.factor import Factor, HessianNotFinite
from qlb.solvers.line_search import Point, backtrack
from qlb.solvers.result import IterationRow, Reason, SolveResult
from qlb.solvers.settings import SolverSettings, Tolerance
from qlb.system import StageProblem, System


class Descent(ABC):
    """A descent method: a subclass says which direction to search, and what to do when a search fails."""

    name: ClassVar[str]
    defaults: ClassVar[dict[str, object]] = {
        "projection": "always",
        "initial_guess": "previous",
        "max_iterations": 500,
        "window": 5,
        "precision": "float64",
    }
    """What a setting is where the user gives none."""

    def __init__(self, system: System, settings: SolverSettings, tolerance: Tolerance) -> None:
        self.settings = settings.completed(self.defaults)
        self.tolerance = tolerance
        self.factor = Factor(system, self.settings.cholesky, self.settings.precision)

    def begin_step(self) -> None:
        """Called once before the stages of each time step."""

    def begin_solve(self, problem: StageProblem, point: Point, goal: float) -> None:
        """Called once before the iterations of each stage, with the initial guess and the |g| that will do."""

    def end_solve(self) -> None:
        """Called once after the iterations of each stage."""

    @abstractmethod
    def direction(self, problem: StageProblem, point: Point) -> tuple[FloatArray, float]:
        """The search direction p at a point, shape (n, 3), and the slope g.p along it."""

    def accept(self, old: Point, new: Point) -> None:
        """Learn from an accepted step."""

    def recover(self, problem: StageProblem, point: Point) -> bool:
        """After a failed search: change something so that `direction` differs; False when nothing is left to try."""
        return False

    def save(self) -> dict[str, FloatArray]:
        """Arrays that a resumed run needs to go on to the same bits; they must not be changed in place later."""
        return {}

    def load(self, arrays: dict[str, FloatArray]) -> None:
        """Take back what `save` gave."""

    def solve(self, problem: StageProblem) -> SolveResult:
        """Minimise the stage's E; where its terms lag something, again with that taken at the solution, till it stays.

        The last pass finds the tolerance met without an iteration; all passes share `max_iterations`.
        """
        result, iterations = self.minimise(problem), -1
        while result.reason.converged and result.iterations > iterations:
            refreshed = problem.refreshed(result.positions)
            if refreshed is None:
                break
            iterations = result.iterations
            result = self.minimise(refreshed, result)
        return result

    def minimise(self, problem: StageProblem, earlier: SolveResult | None = None) -> SolveResult:
        """Minimise the stage's E from the initial guess until the tolerance is met or the solve fails.

        Or from where an `earlier` solve of the same stage ended, against the same reference, adding to its rows.
        """
        log = _Log(problem, self.factor)
        if earlier is None:
            log.add(self._initial_point(problem), 0.0)
            reference = log.point.residual
            if log.point.x is not problem.start:
                reference = problem.residual(problem.value_gradient(problem.start)[1])
        else:
            log.rows, log.point = list(earlier.rows), Point.at(problem, earlier.positions)
            reference = earlier.reference
        try:
            reason = self._descend(problem, log, reference)
        except HessianNotFinite:
            reason = Reason.NOT_FINITE
        return SolveResult(log.point.x, reason, log.point.residual, reference, log.rows)

    def _descend(self, problem: StageProblem, log: _Log, reference: float) -> Reason:
        if not log.point.is_finite:
            return Reason.NOT_FINITE
        goals = self._goals(problem, reference)
        reason = _converged(log.point, *goals)
        if reason is not None:
            return reason
        self.begin_solve(problem, log.point, max(goals))
        reason = self._iterate(problem, log, goals)
        self.end_solve()
        return reason

    def _iterate(self, problem: StageProblem, log: _Log, goals: tuple[float, float]) -> Reason:
        reason = None
        while reason is None:
            if len(log.rows) > self.settings.max_iterations:
                return Reason.MAX_ITERATIONS
            old, found = log.point, self._search(problem, log.point)
            if found is None:
                log.add(old, 0.0)
                return Reason.LINE_SEARCH_FAILED
            step_length, new = found
            self.accept(old, new)
            log.add(new, step_length)
            reason = _converged(new, *goals)
        return reason

    def _initial_point(self, problem: StageProblem) -> Point:
        """x_k, or the predictor where it is asked for, inverts no tet, and has a finite energy."""
        if self.settings.initial_guess == "predictor" and not problem.system.is_inverted(problem.predictor):
            guess = Point.at(problem, problem.predictor)
            if guess.is_finite:
                return guess
        return Point.at(problem, problem.start)

    def _search(self, problem: StageProblem, point: Point) -> tuple[float, Point] | None:
        while True:
            p, slope = self.direction(problem, point)
            if np.isfinite(slope) and slope < 0:
                found = backtrack(problem, point, p, slope)
                if found is not None:
                    return found
            if not self.recover(problem, point):
                return None

    def _goals(self, problem: StageProblem, reference: float) -> tuple[float, float]:
        """The |g| that will do: the relative one, and the largest of the absolute ones."""
        tolerance = self.tolerance
        scaled = tolerance.scaled * problem.residual_scale
        return tolerance.relative * reference, max(tolerance.absolute, scaled, problem.residual_rounding)


def _converged(point: Point, relative: float, absolute: float) -> Reason | None:
    if point.residual <= relative:
        return Reason.CONVERGED_RELATIVE
    return Reason.CONVERGED_ABSOLUTE if point.residual <= absolute else None


class _Log:
    """The point at hand, and a row for each iteration that led there."""

    def __init__(self, problem: StageProblem, factor: Factor) -> None:
        self.rows: list[IterationRow] = []
        self.point: Point
        self._timer, self._factor, self._tried = problem.timer, factor, factor.count

    def add(self, point: Point, step_length: float) -> None:
        made, self._tried = self._factor.count - self._tried, self._factor.count
        row = IterationRow(len(self.rows), point.residual, point.energy, step_length, made, self._timer.lap())
        self.rows.append(row)
        self.point = point
