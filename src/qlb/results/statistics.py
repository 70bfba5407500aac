"""stats.csv: one row for each nonlinear iteration, and what follows from the rows."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from qlb.errors import InputError
from qlb.solvers import IterationRow, Reason, SolveResult
from qlb.step_result import StepResult

_SECONDS = {
    "gradient": "energy with gradient",
    "hessian": "Hessian assembly",
    "factor": "Cholesky factorisation",
    "solve": "search direction",
    "contact": "energy, forces and Hessian of contact",
    "candidates": "pairs that may touch, and step bounds",
    "other": "all the rest",
}

COLUMNS: dict[str, str] = {
    "step": "time step, from 1",
    "stage": "solve within the step, from 1: the stage of the integrator; where the step was cut, counted on over its"
    " pieces",
    "parts": "1, or how many pieces the step was cut into because the whole did not converge",
    "iteration": "nonlinear iteration, 0 for the initial guess",
    "residual": "|g| after the iteration [kg m; N in quasistatics]",
    "reference": "|g(x_k)|, what the relative tolerance refers to [kg m; N in quasistatics]",
    "energy": "E after the iteration [kg m^2; J in quasistatics]",
    "step_length": "accepted by the line search, in units of the search direction",
    "factorizations": "Cholesky factorisations during the iteration",
    "contacts": "active contacts after the iteration",
    "minimum_distance": "smallest distance between what touches, after the iteration [m]; inf where nothing does",
    "step_bound": "the part of the search direction that contact allowed",
    "columns": "nodes in the low-rank part of the factor (QLA with contact)",
    "friction_pass": "which of the solves with friction taken anew, from 1",
    **{f"seconds_{part}": f"wall clock: {what} [s]" for part, what in _SECONDS.items()},
    "reason": "why the solve ended, on its last row only",
}
"""Columns of stats.csv, in order: name and meaning."""

_WHOLE = {"step", "stage", "parts", "iteration", "factorizations", "contacts", "columns", "friction_pass"}
_TYPES: dict[str, Any] = {
    name: np.int64 if name in _WHOLE else np.str_ if name == "reason" else np.float64 for name in COLUMNS
}

Statistics = dict[str, npt.NDArray[Any]]
"""The columns of stats.csv by name, each of shape (rows,)."""

HEADER = ",".join(COLUMNS) + "\n"


def csv_rows(result: StepResult) -> str:
    """The rows of one step, as text. Residuals and energies keep all their digits."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    for stage, solve in enumerate(result.solves, start=1):
        for row in solve.rows:
            last = row is solve.rows[-1]
            writer.writerow(
                [result.step, stage, result.parts, *_values(row, solve), solve.reason.value if last else ""]
            )
    return text.getvalue()


def _values(row: IterationRow, solve: SolveResult) -> list[object]:
    numbers = [repr(float(value)) for value in (row.residual, solve.reference, row.energy, row.step_length)]
    seconds = [f"{row.seconds.get(part, 0.0):.6g}" for part in _SECONDS]
    contact = [row.contacts, repr(row.minimum_distance), repr(row.step_bound), row.columns, row.friction_pass]
    return [row.iteration, *numbers, row.factorizations, *contact, *seconds]


def read_statistics(path: Path) -> Statistics:
    """The columns of a stats.csv; a last line that was cut off by a kill is left out.

    Raises:
        InputError: the file is missing, has other columns, or a value that is not a number.
    """
    try:
        text = path.read_text(encoding="utf-8")
    except (OSError, UnicodeDecodeError) as error:
        raise InputError(f"{path} cannot be read: {getattr(error, 'strerror', None) or error}") from None
    lines = list(csv.reader(io.StringIO(text[: text.rfind("\n") + 1])))
    header, rows = lines[:1], lines[1:]
    if header != [list(COLUMNS)]:
        raise InputError(f"{path} is damaged: its first line must be {HEADER.strip()}")
    try:
        columns = list(zip(*rows, strict=True)) or [()] * len(COLUMNS)
        return {name: np.array(c, dtype=_TYPES[name]) for name, c in zip(COLUMNS, columns, strict=True)}
    except ValueError as error:
        raise InputError(f"{path} is damaged: {error}") from None


@dataclass(frozen=True)
class StepCount:
    """What one time step took."""

    step: int
    iterations: int
    """of all its solves"""
    converged: bool
    factorizations: int
    minimum_distance: float = np.inf
    """[m], in the states that its solves ended with"""

    @staticmethod
    def of(result: StepResult) -> StepCount:
        """The counts of a step that was just taken."""
        distance = min((s.rows[-1].minimum_distance for s in result.solves if s.rows), default=np.inf)
        return StepCount(result.step, result.iterations, result.converged, result.factorizations, distance)


def count_steps(stats: Statistics, stage: int | None = None) -> list[StepCount]:
    """The counts of each step in the rows, or of one stage of each step that has it."""
    chosen = slice(None) if stage is None else stats["stage"] == stage
    names = ("step", "iteration", "factorizations", "parts", "reason", "minimum_distance")
    step, iteration, made, parts, reason, distance = (stats[name][chosen] for name in names)
    steps, begin = np.unique(step, return_index=True)
    counts = []
    for number, rows in zip(steps, map(slice, begin, [*begin[1:], len(step)]), strict=True):
        ends = reason[rows] != ""
        used = reason[rows][ends][-1 if parts[rows][0] > 1 else 0 :]
        converged = len(used) > 0 and all(Reason(r).converged for r in used)
        iterations = int(iteration[rows][ends].sum())
        nearest = float(distance[rows][ends].min(initial=np.inf))
        counts.append(StepCount(int(number), iterations, converged, int(made[rows].sum()), nearest))
    return counts


def summarise(counts: Sequence[StepCount]) -> dict[str, Any]:
    """The keys of a summary that follow from the counts; a step that failed for good counts too."""
    iterations = [count.iterations for count in counts]
    nearest = min((count.minimum_distance for count in counts), default=np.inf)
    return {
        "converged": all(count.converged for count in counts),
        "failed_steps": [count.step for count in counts if not count.converged],
        "iterations_mean": float(np.mean(iterations)) if iterations else 0.0,
        "iterations_max": max(iterations, default=0),
        "factorizations": sum(count.factorizations for count in counts),
        "minimum_distance": None if np.isinf(nearest) else nearest,
    }


def failures(stats: Statistics, steps: Iterable[int]) -> dict[int, str]:
    """Why each of `steps` failed: the first reason among its solves that is not convergence."""
    bad = {reason.value for reason in Reason if not reason.converged}
    reasons: dict[int, str] = {}
    for step in steps:
        of_step = stats["reason"][stats["step"] == step]
        reasons[step] = next((str(reason) for reason in of_step if reason in bad), "unknown")
    return reasons
