"""What a time step returns, and how one fails."""

from __future__ import annotations

from dataclasses import dataclass, field

from qlb.arrays import FloatArray
from qlb.contact.report import ContactReport
from qlb.errors import QlbError
from qlb.solvers import Reason, SolveResult


@dataclass(frozen=True)
class StepResult:
    """One time step."""

    step: int
    """1 for the first"""
    time: float
    """at the end of the step [s]"""
    positions: FloatArray
    """[m], shape (n, 3); with obstacles (n + q, 3), those of their vertices behind those of the bodies"""
    velocities: FloatArray
    """[m/s], of the same shape"""
    solves: list[SolveResult] = field(repr=False)
    """one for each stage, or for each stage of each part of a step that was cut"""
    contact: ContactReport | None = None
    """forces and distances of contact at the end of the step, where there can be any"""
    parts: int = 1
    """1, or how many pieces the step was cut into because the whole did not converge"""

    @property
    def converged(self) -> bool:
        """Whether every solve that led to `positions` met the tolerance."""
        return self.reason.converged

    @property
    def reason(self) -> Reason:
        """Why the last solve ended, or the first that failed (of the pieces, where the step was cut)."""
        used = self.solves[-1:] if self.parts > 1 else self.solves
        return next((s.reason for s in used if not s.reason.converged), self.solves[-1].reason)

    @property
    def iterations(self) -> int:
        """Nonlinear iterations of all solves."""
        return sum(solve.iterations for solve in self.solves)

    @property
    def factorizations(self) -> int:
        """Cholesky factorisations of all solves."""
        return sum(solve.factorizations for solve in self.solves)


class StepFailed(QlbError, RuntimeError):
    """A time step did not converge.

    Attributes:
        result: the failed step; its state was not taken over by the simulation.
    """

    def __init__(self, message: str, result: StepResult) -> None:
        super().__init__(message)
        self.result = result


def failure_message(result: StepResult, solver: str) -> str:
    """Which step failed, why, how far it got, and what more is known."""
    solve = next((s for s in result.solves if not s.reason.converged), result.solves[-1])
    relative = solve.residual / solve.reference if solve.reference else float("inf")
    detail = f"; {solve.detail}" if solve.detail else ""
    return (
        f"step {result.step} (time {result.time:g} s) did not converge: {result.reason.value} after"
        f" {solve.iterations} iterations of {solver}, |g| = {solve.residual:.3g} ({relative:.3g} of |g(x_k)|){detail}"
    )
