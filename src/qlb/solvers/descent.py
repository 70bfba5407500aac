"""The loop that all solvers share: direction, line search, convergence."""

from __future__ import annotations

from abc import ABC, abstractmethod
from dataclasses import dataclass, replace
from typing import ClassVar

import numpy as np

from qlb.arrays import FloatArray
from qlb.solvers.factor import Factor, HessianNotFinite
from qlb.solvers.lead_in import LeadIn
from qlb.solvers.line_search import Point, backtrack
from qlb.solvers.result import IterationRow, Reason, SolveResult
from qlb.solvers.settings import SolverSettings, Tolerance
from qlb.system import StageProblem, System

SETTLED = 1e-2
"""Part of |g(x_k)|, or of all contact forces where they are more, that may be left where a solve ends by a small step.

A direction can be short because the solution is near, or because the factor is far too stiff, as that of QLB is where
friction held at the beginning of a step and gives way in it.
"""


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

    def accept(self, problem: StageProblem, old: Point, new: Point, *, limited: bool) -> None:
        """Learn from an accepted step, which contact may have `limited`."""

    def recover(self, problem: StageProblem, point: Point) -> bool:
        """After a failed search: change something so that `direction` differs; False when nothing is left to try."""
        return False

    def save(self) -> dict[str, FloatArray]:
        """Arrays that a resumed run needs to go on to the same bits; they must not be changed in place later."""
        return self.factor.save()

    def load(self, arrays: dict[str, FloatArray]) -> None:
        """Take back what `save` gave."""
        self.factor.load(arrays)

    def solve(self, problem: StageProblem) -> SolveResult:
        """Minimise the stage's E; where its terms lag something, again with that taken at the solution, till it stays.

        The last pass finds the tolerance met without an iteration, or is the last that friction is given; all passes
        share `max_iterations`.
        """
        result = self.minimise(problem) if problem.contact is None else self._solve_with_contact(problem)
        iterations = -1
        while result.reason.converged and result.iterations > iterations:
            refreshed = problem.refreshed(result.positions, result.contact)
            if refreshed is None:
                break
            problem, iterations = refreshed, result.iterations
            result = self.minimise(problem, result)
        if problem.contact is not None and result.contact is not None:
            result = replace(result, forces=problem.contact.forces(result.positions, result.contact))
        return result

    def _solve_with_contact(self, problem: StageProblem) -> SolveResult:
        """`minimise`, from where a way that passes through nothing leads."""
        lead = LeadIn(problem, predict=self.settings.initial_guess == "predictor")
        result = SolveResult.start(problem.origin.positions, lead.reference)
        while not lead.arrived:
            x = lead.advance()
            if x is None:
                return lead.blocked(result)
            result = self.minimise(problem, replace(result, positions=x))
            lead.relaxed(result.positions)
            if not result.reason.converged:
                return result if lead.arrived else lead.blocked(result)
        return result

    def minimise(self, problem: StageProblem, earlier: SolveResult | None = None) -> SolveResult:
        """Minimise the stage's E from the initial guess until the tolerance is met or the solve fails.

        Or from where an `earlier` solve of the same stage ended, against the same reference, adding to its rows.
        """
        log = _Log(problem, self)
        if earlier is None:
            reference = problem.residual(problem.value_gradient(problem.start)[1])
            log.add(self._initial_point(problem), 0.0)
        else:
            log.rows, log.point = list(earlier.rows), Point.at(problem, earlier.positions)
            reference = earlier.reference
            if not log.rows:
                log.add(log.point, 0.0)
        try:
            reason = self._descend(problem, log, reference)
        except HessianNotFinite:
            reason = Reason.NOT_FINITE
        return SolveResult(log.point.x, reason, log.point.residual, reference, log.rows, log.point.contact)

    def _descend(self, problem: StageProblem, log: _Log, reference: float) -> Reason:
        if not log.point.is_finite:
            return Reason.NOT_FINITE
        goals = self._goals(problem, reference)
        reason = _converged(log.point, *goals)
        if reason is not None:
            return reason
        self.begin_solve(problem, log.point, max(goals))
        reason = self._iterate(problem, log, goals, reference)
        self.end_solve()
        return reason

    def _iterate(self, problem: StageProblem, log: _Log, goals: tuple[float, float], reference: float) -> Reason:
        reason = None
        while reason is None:
            if len(log.rows) > self.settings.max_iterations:
                return Reason.MAX_ITERATIONS
            old, found = log.point, self._search(problem, log.point)
            if isinstance(found, Reason):
                log.add(old, 0.0)
                return found
            new = found.point.after(old)
            self.accept(problem, old, new, limited=found.longest < 1)
            log.add(new, found.step_length, found.longest)
            reason = _converged(new, *goals)
            if reason is None and found.small and _is_settled(problem, new, reference):
                reason = Reason.CONVERGED_STEP
        return reason

    def _initial_point(self, problem: StageProblem) -> Point:
        """x_k, or the predictor where it is asked for, inverts no tet, and has a finite energy."""
        if self.settings.initial_guess == "predictor" and not problem.system.is_inverted(problem.predictor):
            guess = Point.at(problem, problem.predictor)
            if guess.is_finite:
                return guess
        return Point.at(problem, problem.start)

    def _search(self, problem: StageProblem, point: Point) -> _Found | Reason:
        """The next point, or why there is none.

        A direction short enough to end the solve is followed, too: as it is there already, it costs little, and forces
        of contact need places far more exact than dhat where they act near the end of its reach.
        """
        while True:
            p, slope = self.direction(problem, point)
            if np.isfinite(slope) and slope < 0:
                reach = 0.0 if problem.contact is None else max(float(p.max()), -float(p.min()))
                small = self._is_small(problem, point, reach)
                longest = _longest_step(problem, point.x, p, reach)
                found = backtrack(problem, point, p, slope, longest)
                if found is not None:
                    return _Found(*found, longest, small)
                if small:
                    return Reason.CONVERGED_STEP
            if not self.recover(problem, point):
                return Reason.LINE_SEARCH_FAILED

    def _is_small(self, problem: StageProblem, point: Point, reach: float) -> bool:
        """Whether something touches, and a |p|_inf of `reach` [m] is so short beside dhat that it may end the solve."""
        if problem.contact is None or point.contact is None or point.contact.count == 0:
            return False
        return reach <= self.tolerance.step * problem.contact.model.dhat

    @property
    def factorizations(self) -> int:
        """Factorisations tried so far."""
        return self.factor.count

    @property
    def columns(self) -> int:
        """Nodes whose columns a low-rank part of the factor holds."""
        return 0

    def _goals(self, problem: StageProblem, reference: float) -> tuple[float, float]:
        """The |g| that will do: the relative one, and the largest of the absolute ones."""
        tolerance = self.tolerance
        scaled = tolerance.scaled * problem.residual_scale
        return tolerance.relative * reference, max(tolerance.absolute, scaled, problem.residual_rounding)


@dataclass(frozen=True)
class _Found:
    """What a search led to."""

    step_length: float
    point: Point
    longest: float
    """the longest step that was allowed"""
    small: bool
    """whether the direction was too short to go on"""


def _converged(point: Point, relative: float, absolute: float) -> Reason | None:
    if point.residual <= relative:
        return Reason.CONVERGED_RELATIVE
    return Reason.CONVERGED_ABSOLUTE if point.residual <= absolute else None


def _is_settled(problem: StageProblem, point: Point, reference: float) -> bool:
    contact = 0.0 if point.contact is None else problem.residual(point.contact.gradient)
    return point.residual <= SETTLED * max(reference, contact)


def _longest_step(problem: StageProblem, x: FloatArray, p: FloatArray, reach: float) -> float:
    """The part of p (n, 3) [m] that contact allows and that is no longer than anything may move; 1 without contact.

    `reach`: |p|_inf [m].
    """
    if problem.contact is None:
        return 1.0
    clamp = min(1.0, problem.plausible_move / reach)
    return clamp * problem.contact.bound(x, p if clamp == 1 else clamp * p)


class _Log:
    """The point at hand, and a row for each iteration that led there."""

    def __init__(self, problem: StageProblem, solver: Descent) -> None:
        self.rows: list[IterationRow] = []
        self.point: Point
        self._problem, self._solver, self._tried = problem, solver, solver.factorizations

    def add(self, point: Point, step_length: float, longest: float = 1.0) -> None:
        solver, contact = self._solver, self._problem.contact
        made, self._tried = solver.factorizations - self._tried, solver.factorizations
        seconds = self._problem.timer.lap()
        row = (len(self.rows), point.residual, point.energy, step_length, made, seconds)
        if contact is None or point.contact is None:
            self.rows.append(IterationRow(*row))
        else:
            touching = point.contact.count, point.contact.minimum_distance
            self.rows.append(IterationRow(*row, *touching, longest, solver.columns, contact.friction_pass))
        self.point = point
