"""How a solve gets from where the last one ended to its first guess without passing through anything."""

from __future__ import annotations

from dataclasses import replace

import numpy as np

from qlb.arrays import FloatArray
from qlb.solvers.result import Reason, SolveResult
from qlb.system import StageProblem

SHARE = 0.8  # of a way that is not free, how much is gone
MAX_SUBSTEPS = 200
LEAST_PROGRESS = 1e-3  # of what a script asks for, in PATIENCE sub-steps
PATIENCE = 20


class LeadIn:
    """The way from the origin of a stage (intersection-free) to positions in which all that is scripted has arrived.

    Where something scripted would run into a body on its way, it goes as far as it can, the stage is solved for the
    rest with the script held there, and so on (sub-steps).
    """

    def __init__(self, problem: StageProblem, *, predict: bool) -> None:
        """`predict`: whether to start from the predictor, or where something touches towards where inertia leads."""
        self._problem, self._predict = problem, predict
        self._x = problem.origin.positions
        self._move: FloatArray | None = None  # what the free nodes did in the last sub-step, for all of the script
        self._fraction = 0.0
        self._history: list[float] = []
        self._limit = ""  # what was in the way last, in words
        held = problem.system.held.fixed != 0
        assert problem.contact is not None
        self._contact = problem.contact
        target = problem.system.held.place(self._x, problem.stage.time)
        self._scripted = self._contact.planes_move or not np.array_equal(target[held], self._x[held])
        self.reference = problem.residual(problem.value_gradient(problem.start)[1])
        """|g(x_k)| without contact, what the relative tolerance refers to."""

    @property
    def arrived(self) -> bool:
        """Whether all that is scripted is where it belongs in the stage."""
        return self._fraction == 1.0

    def advance(self) -> FloatArray | None:
        """Positions (n, 3) [m] to solve from, as far along the way as is free; None where the script is blocked.

        Of two ways that are free to their ends, the one that ends lower: bodies that follow what moves them are better
        taken along, and those that it runs into left where they are.
        """
        if self._is_stuck():
            return None
        self._contact.set_fraction(self._fraction)
        x, moves = self._x, self._moves()
        parts = [self._contact.bound(x, move, moving_planes=True) for move in moves]
        self._limit = self._contact.limiting() or self._limit
        best = int(np.argmax(parts))
        if len(moves) > 1 and min(parts) == 1:
            self._contact.set_fraction(1.0)
            energies = np.array([self._problem.evaluate(x + move).energy for move in moves])
            best = int(np.argmin(np.where(np.isnan(energies), np.inf, energies)))
        t, p = parts[best], moves[best]
        if t < 1:
            t *= SHARE
        if not self._scripted and self._problem.system.is_inverted(x + t * p):
            t, p = 1.0, self._still()
        if not self._scripted or t == 1:
            self._fraction = 1.0
        else:
            self._fraction += t * (1 - self._fraction)
        self._history.append(self._fraction)
        self._contact.set_fraction(self._fraction)
        return x + t * p

    def relaxed(self, x: FloatArray) -> None:
        """Take the solution of a sub-step (n, 3) [m]."""
        gained = self._history[-1] - (self._history[-2] if len(self._history) > 1 else 0.0)
        self._move = (x - self._x) / gained if gained > 0 else None
        self._x = x

    def blocked(self, result: SolveResult) -> SolveResult:
        """The failure of a solve whose script cannot go on."""
        between = f" between {self._limit}" if self._limit else ""
        point = result.contact
        gap = point.minimum_distance if point is not None else np.inf
        detail = (
            f"scripted motion can go only {100 * self._fraction:.3g} % of its way without forcing an intersection"
            f"{between}: the smallest gap is {gap:.3g} m"
        )
        if not result.reason.converged and result.rows:
            detail += f"; with the script held there the solve ends by {result.reason.value}"
        return replace(result, reason=Reason.MOTION_BLOCKED, detail=detail)

    def _is_stuck(self) -> bool:
        history = self._history
        if len(history) >= MAX_SUBSTEPS:
            return True
        return len(history) > PATIENCE and history[-1] - history[-1 - PATIENCE] < LEAST_PROGRESS

    def _moves(self) -> list[FloatArray]:
        """Ways to try: from where we are to where all that is scripted has arrived.

        Where something touches, the predictor has forces of contact in it that will not be the same. Less of its way is
        free than of the way that inertia takes: in the second stage of SDIRK2 about half as much.
        """
        problem, x = self._problem, self._x
        if self._move is not None:
            guess = x + (1 - self._fraction) * self._move
        elif not self._predict:
            return [self._still()]
        elif self._scripted or not self._touches():
            guess = problem.predictor
        else:
            guess = problem.inertial if problem.stage.inertial else x
        moving = problem.system.held.place(guess, problem.stage.time) - x
        return [moving, self._still()] if self._scripted else [moving]

    def _still(self) -> FloatArray:
        """The way on which only what is scripted moves."""
        return self._problem.system.held.place(self._x, self._problem.stage.time) - self._x

    def _touches(self) -> bool:
        return self._contact.at(self._x).count > 0
