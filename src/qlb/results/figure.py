"""Figures of runs in a grid, as in the supplement: rows are a variation, columns the solvers."""

from __future__ import annotations

import csv
import io
from collections.abc import Iterator, Mapping, Sequence
from dataclasses import dataclass, field
from pathlib import Path

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.lines import Line2D
from matplotlib.ticker import FuncFormatter, MaxNLocator

from qlb.results import style
from qlb.results.files import write_text
from qlb.results.plots import LOGARITHMIC
from qlb.results.run import Run, StepIterations

CSV_COLUMNS = ("figure", "row", "solver", "step", "stage", "iterations", "converged")
"""Columns of the file behind a figure: one row for each stage of each time step."""

FORMATS = ("png", "svg", "pdf")
CROSSES = 20
"""More failed steps than these are marked by a rug at the foot of the panel, fewer by a cross each."""

_HEADROOM = 1.45


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

    def cells(self) -> Iterator[tuple[str, str, Run | None]]:
        """Row, solver and run, row by row."""
        for label, runs in self.runs.items():
            for solver in self.solvers:
                yield label, solver, runs.get(solver)


def write_figure(grid: FigureGrid, directory: Path) -> dict[str, Path]:
    """Write figure-N.png, .svg, .pdf and .csv; returns each by its suffix. Raises `WriteError`."""
    paths = {suffix: directory / f"figure-{grid.number}.{suffix}" for suffix in (*FORMATS, "csv")}
    with style.look():
        figure = draw_grid(grid)
        for suffix in FORMATS:
            style.save(figure, paths[suffix])
    write_text(paths["csv"], grid_csv(grid))
    return paths


def grid_csv(grid: FigureGrid) -> str:
    """The numbers that a figure shows (`CSV_COLUMNS`), as text."""
    text = io.StringIO()
    writer = csv.writer(text, lineterminator="\n")
    writer.writerow(CSV_COLUMNS)
    for label, solver, run in grid.cells():
        for stage, curve in enumerate(_curves(run) if run else [], start=1):
            for step, iterations, converged in zip(*(column.tolist() for column in curve), strict=True):
                row = (grid.number, label, solver, step, stage, iterations, str(converged).lower())
                writer.writerow(row)
    return text.getvalue()


def draw_grid(grid: FigureGrid) -> Figure:
    """The figure: time steps along x, nonlinear iterations along y, one range of y for each column."""
    rows, columns = len(grid.runs), len(grid.solvers)
    figure = style.figure(1.2 + 3.1 * columns, 1.3 + 1.65 * rows)
    axes = figure.subplots(rows, columns, sharex=True, sharey="col", squeeze=False)
    for ax, (_, _, run) in zip(axes.flat, grid.cells(), strict=True):
        _draw_panel(ax, run)
    for column, solver in zip(axes.T, grid.solvers, strict=True):
        column[0].set_title(solver, loc="center")
        column[-1].set_xlabel("time step")
        runs = [run for _, name, run in grid.cells() if name == solver and run]
        _scale(column[0], [curve for run in runs for curve in _curves(run)])
    for ax, label in zip(axes[:, 0], grid.runs, strict=True):
        ax.set_ylabel(label, fontweight="bold", labelpad=8)
    figure.supylabel("nonlinear iterations a step", fontsize=10)
    figure.suptitle(f"Figure {grid.number}: {grid.title}", x=0.01, ha="left", fontweight="bold", fontsize=12)
    _legend(figure, grid)
    return figure


def _curves(run: Run) -> list[StepIterations]:
    """Iterations by step, one curve for each stage of the integrator."""
    return [run.iterations_per_step(stage) for stage in range(1, run.stages + 1)]


def _draw_panel(ax: Axes, run: Run | None) -> None:
    if run is None:
        ax.text(0.5, 0.5, "no run", transform=ax.transAxes, ha="center", va="center", color=style.FAINT)
        return
    curves = _curves(run)
    for curve, colour, width in zip(curves, (style.BLUE, style.RED), (2.0 if len(curves) > 1 else 1.3, 1.0)):  # noqa: B905
        marker = "o" if len(curve.steps) < 3 else ""
        ax.step(curve.steps, curve.iterations, where="mid", color=colour, linewidth=width, marker=marker, markersize=3)
    _mark_failed(ax, curves)
    _write_counts(ax, run)
    ax.margins(x=0.02)
    ax.xaxis.set_major_locator(MaxNLocator(integer=True, nbins=6, steps=[1, 2, 3, 4, 5, 10]))


def _mark_failed(ax: Axes, curves: list[StepIterations]) -> None:
    """A red cross on each step that did not converge; a red rug where they are many."""
    steps = np.concatenate([curve.steps[~curve.converged] for curve in curves])
    values = np.concatenate([curve.iterations[~curve.converged] for curve in curves])
    rug = len(steps) > CROSSES
    if len(steps):
        (marks,) = ax.plot(steps, np.full(len(steps), 0.035) if rug else values, color=style.RED, linestyle="none")
        marks.set(gid="failed", zorder=4, marker="|" if rug else "x", markersize=7 if rug else 5, markeredgewidth=1.3)
        if rug:
            marks.set_transform(ax.get_xaxis_transform())


def _write_counts(ax: Axes, run: Run) -> None:
    s = run.summary
    ax.text(0.02, 0.97, counts_text(s["iterations_mean"], s["iterations_max"]), transform=ax.transAxes, va="top")
    failed = len(s["failed_steps"])
    if failed or s["status"] == "failed":
        text = "stopped" if s["status"] == "failed" else f"{failed} of {s['steps']} failed"
        ax.text(0.98, 0.97, text, transform=ax.transAxes, va="top", ha="right", color=style.RED)


def counts_text(mean: float, most: int) -> str:
    """Mean and maximum of iterations in a few words."""
    return f"mean {mean:.3g}, max {most}"


def _scale(ax: Axes, curves: Sequence[StepIterations]) -> None:
    """The range of y that a column shares: from 0, or logarithmic where its panels lie far apart."""
    means = [max(1.0, float(curve.iterations.mean())) for curve in curves if len(curve.iterations)]
    highest = max((int(curve.iterations.max()) for curve in curves if len(curve.iterations)), default=1)
    if means and max(means) > LOGARITHMIC * min(means):
        lowest = min(int(curve.iterations.min()) for curve in curves if len(curve.iterations))
        ax.set_yscale("symlog", linthresh=1, linscale=0.3)
        ax.set_ylim(0 if lowest == 0 else 1, 6 * highest)
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    else:
        ax.set_ylim(0, _HEADROOM * max(1, highest))
        ax.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=5, steps=[1, 2, 5, 10]))


def _legend(figure: Figure, grid: FigureGrid) -> None:
    """Below the panels, for what is not said in them: stages and failed steps."""
    handles: dict[str, Line2D] = {}
    runs = [run for _, _, run in grid.cells() if run]
    if any(run.stages > 1 for run in runs):
        lines = next(ax for ax in figure.axes if len(ax.lines) > 1).lines
        handles |= {"first stage": lines[0], "second stage": lines[1]}
    for ax in figure.axes:
        marks = [line for line in ax.lines if line.get_gid() == "failed"]
        handles |= {f"did not converge ({_mark_name(line.get_marker())})": line for line in marks}
    if handles:
        figure.legend(list(handles.values()), list(handles), loc="outside lower center", ncols=len(handles), fontsize=9)


def _mark_name(marker: object) -> str:
    return "rug at the foot" if marker == "|" else "cross"
