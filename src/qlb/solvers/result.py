"""What a solve returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum
from math import inf

from qlb.arrays import FloatArray
from qlb.contact.report import ContactForces
from qlb.contact.stage import ContactPoint


class Reason(str, Enum):
    """Why a solve ended."""

    CONVERGED_ABSOLUTE = "converged_absolute"
    CONVERGED_RELATIVE = "converged_relative"
    CONVERGED_STEP = "converged_step"
    MAX_ITERATIONS = "max_iterations"
    LINE_SEARCH_FAILED = "line_search_failed"
    NOT_FINITE = "not_finite"
    MOTION_BLOCKED = "motion_blocked"

    @property
    def converged(self) -> bool:
        """Whether the tolerance was met."""
        return self in (Reason.CONVERGED_ABSOLUTE, Reason.CONVERGED_RELATIVE, Reason.CONVERGED_STEP)


@dataclass(frozen=True)
class IterationRow:
    """One nonlinear iteration; iteration 0 is the initial guess."""

    iteration: int
    residual: float
    """|g| after the iteration [kg m; N in quasistatics]"""
    energy: float
    """E after the iteration [kg m^2; J in quasistatics]"""
    step_length: float
    """accepted by the line search, in units of the search direction"""
    factorizations: int
    """during the iteration"""
    seconds: dict[str, float]
    """wall-clock by part (`qlb.timing.PARTS`)"""
    contacts: int = 0
    """active after the iteration"""
    minimum_distance: float = inf
    """between surfaces that touch, after the iteration [m]"""
    step_bound: float = 1.0
    """the part of the search direction that contact allowed"""
    columns: int = 0
    """nodes whose columns the low-rank part of the factor holds (QLA)"""
    friction_pass: int = 1
    """which of the passes with friction taken anew"""


@dataclass(frozen=True)
class SolveResult:
    """The end of one nonlinear solve."""

    positions: FloatArray
    """[m], shape (n, 3); a solution only where `reason.converged`"""
    reason: Reason
    residual: float
    """|g| at `positions`"""
    reference: float
    """|g(x_k)|, what the relative tolerance refers to"""
    rows: list[IterationRow] = field(default_factory=list)
    contact: ContactPoint | None = None
    """contact at `positions`"""
    forces: ContactForces | None = None
    """of contact and friction at `positions`"""
    detail: str = ""
    """more about a failure, in words"""

    @staticmethod
    def start(x: FloatArray, reference: float) -> SolveResult:
        """No solve yet, which is to begin at `x` (n, 3) [m]."""
        return SolveResult(x, Reason.MAX_ITERATIONS, inf, reference)

    @property
    def iterations(self) -> int:
        """Nonlinear iterations."""
        return self.rows[-1].iteration if self.rows else 0

    @property
    def factorizations(self) -> int:
        """Cholesky factorisations tried."""
        return sum(row.factorizations for row in self.rows)
