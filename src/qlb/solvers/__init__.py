"""Nonlinear solvers. All minimise a `StageProblem` and stop at a tolerance, with a reason."""

from qlb.registry import found_in
from qlb.solvers.adaptive import QLA
from qlb.solvers.descent import Descent
from qlb.solvers.newton import ND
from qlb.solvers.quasi_newton import QLB, QLF
from qlb.solvers.result import IterationRow, Reason, SolveResult
from qlb.solvers.settings import SolverSettings, Tolerance

SOLVERS: dict[str, type[Descent]] = found_in(
    __name__,
    Descent,  # type: ignore[type-abstract]
    lambda kind: kind.name,
    first=("ND", "QLF", "QLB", "QLA"),
)
"""Every solver by the name that scene files and the command line use."""

__all__ = [
    "ND",
    "QLA",
    "QLB",
    "QLF",
    "SOLVERS",
    "Descent",
    "IterationRow",
    "Reason",
    "SolveResult",
    "SolverSettings",
    "Tolerance",
]
