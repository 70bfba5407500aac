"""Draws the figures of runs in a grid."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import Any, Literal

import numpy as np
from matplotlib.axes import Axes
from matplotlib.figure import Figure
from matplotlib.legend_handler import HandlerTuple
from matplotlib.ticker import FuncFormatter, MaxNLocator

from qlb.results import style
from qlb.results.figure import FORMATS, FigureGrid, grid_csv, stage_curves, words_on
from qlb.results.files import write_text
from qlb.results.plots import LOGARITHMIC
from qlb.results.run import Run, StepIterations

CROSSES = 20
"""More failed steps than these are marked by a rug at the foot of the panel, fewer by a cross each."""

_HEADROOM = 1.45


def write_figure(grid: FigureGrid, directory: Path) -> dict[str, Path]:
    """Write figure-N.png, .svg, .pdf and .csv; returns each by its suffix. Raises `WriteError`."""
    paths = {suffix: directory / f"figure-{grid.number}.{suffix}" for suffix in (*FORMATS, "csv")}
    with style.look():
        figure = draw_grid(grid)
        for suffix in FORMATS:
            style.save(figure, paths[suffix])
    write_text(paths["csv"], grid_csv(grid))
    return paths


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
        _scale(column[0], [curve for run in runs for curve in stage_curves(run)])
    for ax, label in zip(axes[:, 0], grid.runs, strict=True):
        ax.set_ylabel(label, fontweight="bold", labelpad=8)
    figure.supylabel("nonlinear iterations a step", fontsize=10)
    figure.suptitle(f"Figure {grid.number}: {grid.title}", x=0.01, ha="left", fontweight="bold", fontsize=12)
    _legend(figure, grid)
    return figure


def _draw_panel(ax: Axes, run: Run | None) -> None:
    if run is None:
        ax.text(0.5, 0.5, "no run", transform=ax.transAxes, ha="center", va="center", color=style.FAINT)
        return
    curves = stage_curves(run)
    looks = ((style.BLUE, 1.3),) if len(curves) == 1 else ((style.BLUE, 2.0), (style.RED, 1.0))
    for curve, (colour, width) in zip(curves, looks, strict=True):
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
    counts, trouble = words_on(run)
    _write(ax, counts, "left", style.INK)
    if trouble:
        _write(ax, trouble, "right", style.RED)


def _write(ax: Axes, text: str, side: Literal["left", "right"], colour: str) -> None:
    """A text in an upper corner, on white so that the grid does not cross it."""
    ax.text(
        0.02 if side == "left" else 0.98,
        0.97,
        text,
        transform=ax.transAxes,
        ha=side,
        va="top",
        color=colour,
        bbox={"facecolor": "white", "edgecolor": "none", "pad": 1.0},
    )


def _scale(ax: Axes, curves: Sequence[StepIterations]) -> None:
    """The range of y that a column shares: from 0, or logarithmic where its panels lie far apart."""
    highest = [max(1, int(curve.iterations.max())) for curve in curves if len(curve.iterations)] or [1]
    if max(highest) > LOGARITHMIC * min(highest):
        lowest = min(int(curve.iterations.min()) for curve in curves if len(curve.iterations))
        ax.set_yscale("symlog", linthresh=1, linscale=0.3)
        ax.set_ylim(0 if lowest == 0 else 1, 6 * max(highest))
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    else:
        ax.set_ylim(0, _HEADROOM * max(highest))
        ax.yaxis.set_major_locator(MaxNLocator(integer=True, nbins=5, steps=[1, 2, 5, 10]))


def _legend(figure: Figure, grid: FigureGrid) -> None:
    """Below the panels, for what is not said in them: stages and failed steps."""
    handles: dict[str, Any] = {}
    if any(run.stages > 1 for _, _, run in grid.cells() if run):
        lines = next(ax for ax in figure.axes if len(ax.lines) > 1).lines
        handles |= {"first stage": lines[0], "second stage": lines[1]}
    marks = {line.get_marker(): line for ax in figure.axes for line in ax.lines if line.get_gid() == "failed"}
    if marks:
        handles["did not converge"] = tuple(marks.values())
    if handles:
        figure.legend(
            list(handles.values()),
            list(handles),
            loc="outside lower center",
            ncols=len(handles),
            fontsize=9,
            handler_map={tuple: HandlerTuple(ndivide=None)},
        )
