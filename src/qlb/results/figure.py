"""Figures of runs in a grid, as in the supplement: rows are a variation, columns the solvers."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field

import numpy as np

from qlb.results.run import Run, StepIterations

CSV_COLUMNS = ("figure", "row", "solver", "step", "stage", "iterations", "converged")
"""Columns of the file behind a figure: one row for each stage of each time step."""

FORMATS = ("png", "svg", "pdf")
PAGE = "index.html"


@dataclass(frozen=True)
class Finding:
    """A statement on a figure, held against what was measured."""

    statement: str
    measured: str
    """the numbers that decide"""
    holds: bool | None
    """None where a run is missing"""
    sentence: str
    """why it holds or does not"""

    @property
    def verdict(self) -> str:
        """In words."""
        return {True: "holds", False: "does not hold", None: "not measured"}[self.holds]


@dataclass(frozen=True)
class FigureGrid:
    """What a figure shows."""

    number: int
    title: str
    parameter: str
    """what differs from row to row"""
    solvers: Sequence[str]
    """the columns"""
    runs: Mapping[str, Mapping[str, Run]]
    """by label of the row, then by solver; a run that is not there leaves its panel empty"""
    expectation: str = ""
    """what to look for"""
    reference: Mapping[str, Mapping[str, str]] = field(default_factory=dict)
    """counts to hold against, by label of the row, then by solver"""
    findings: Sequence[Finding] = ()
    """what is said about the figure, held against its runs"""

    def cells(self) -> Iterator[tuple[str, str, Run | None]]:
        """Row, solver and run, row by row."""
        for label, runs in self.runs.items():
            for solver in self.solvers:
                yield label, solver, runs.get(solver)


def grid_csv(grid: FigureGrid) -> str:
    """The numbers that a figure shows (`CSV_COLUMNS`), as text."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    for label, solver, run in grid.cells():
        writer.writerows((grid.number, label, solver, *row) for row in (_stage_rows(run) if run else []))
    return text.getvalue()


def stage_curves(run: Run) -> list[StepIterations]:
    """Iterations by step, one curve for each stage of the integrator.

    A first step by SDIRK2, with which BDF2 starts, does not make two curves: both its stages count in one.
    """
    if run.stages == 1:
        return [run.iterations_per_step()]
    return [run.iterations_per_step(stage) for stage in range(1, run.stages + 1)]


def words_on(run: Run) -> tuple[str, str]:
    """What stands in the panel of a run: its counts, and what went wrong, if anything."""
    s = run.summary
    failed, trouble = len(s["failed_steps"]), ""
    if s["status"] == "failed":
        trouble = f"stopped after step {s['steps']}"
    elif failed:
        trouble = f"{failed} of {s['steps']} failed"
    return f"mean {s['iterations_mean']:.3g}, max {s['iterations_max']}", trouble


def _stage_rows(run: Run) -> Iterator[tuple[int, int, int, str]]:
    """Step, stage, iterations and whether it converged, of each solve."""
    for stage in range(1, int(run.stats["stage"].max(initial=0)) + 1):
        for step, iterations, converged in zip(*map(np.ndarray.tolist, run.iterations_per_step(stage)), strict=True):
            yield step, stage, iterations, str(converged).lower()
