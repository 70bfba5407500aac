"""What a solve returns."""

from __future__ import annotations

from dataclasses import dataclass, field
from enum import Enum

from qlb.arrays import FloatArray


class Reason(str, Enum):
    """Why a solve ended."""

    CONVERGED_ABSOLUTE = "converged_absolute"
    CONVERGED_RELATIVE = "converged_relative"
    MAX_ITERATIONS = "max_iterations"
    LINE_SEARCH_FAILED = "line_search_failed"
    NOT_FINITE = "not_finite"

    @property
    def converged(self) -> bool:
        """Whether the tolerance was met."""
        return self in (Reason.CONVERGED_ABSOLUTE, Reason.CONVERGED_RELATIVE)


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

    @property
    def iterations(self) -> int:
        """Nonlinear iterations."""
        return self.rows[-1].iteration if self.rows else 0

    @property
    def factorizations(self) -> int:
        """Cholesky factorisations tried."""
        return sum(row.factorizations for row in self.rows)
