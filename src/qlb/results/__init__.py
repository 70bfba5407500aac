"""Results of runs: the run directory, plots, pictures and reports."""

from __future__ import annotations

from importlib import import_module
from typing import TYPE_CHECKING

from qlb.results.errors import MissingExtra, RenderingFailed, WriteError
from qlb.results.run import Frame, Run, StepIterations
from qlb.results.run_writer import RunWriter
from qlb.results.statistics import COLUMNS

if TYPE_CHECKING:
    from qlb.results.figure import FigureGrid
    from qlb.results.figure_drawing import write_figure
    from qlb.results.figure_page import FigureRow, figure_rows, write_figures_page
    from qlb.results.picture import render_frames
    from qlb.results.plots import plot_contact, plot_iterations, plot_residuals, plot_seconds
    from qlb.results.report import finish_run, write_comparison, write_report
    from qlb.results.sweep_page import write_sweep_page

# What draws is imported when it is first asked for: matplotlib takes as long as all the rest.
_DRAWS = {
    "figure": ("FigureGrid",),
    "figure_drawing": ("write_figure",),
    "figure_page": ("FigureRow", "figure_rows", "write_figures_page"),
    "picture": ("render_frames",),
    "plots": ("plot_contact", "plot_iterations", "plot_residuals", "plot_seconds"),
    "report": ("finish_run", "write_comparison", "write_report"),
    "sweep_page": ("write_sweep_page",),
}

__all__ = [
    "COLUMNS",
    "FigureGrid",
    "FigureRow",
    "Frame",
    "MissingExtra",
    "RenderingFailed",
    "Run",
    "RunWriter",
    "StepIterations",
    "WriteError",
    "figure_rows",
    "finish_run",
    "plot_contact",
    "plot_iterations",
    "plot_residuals",
    "plot_seconds",
    "render_frames",
    "write_comparison",
    "write_figure",
    "write_figures_page",
    "write_report",
    "write_sweep_page",
]


def __getattr__(name: str) -> object:
    for module, names in _DRAWS.items():
        if name in names:
            return getattr(import_module(f"{__name__}.{module}"), name)
    raise AttributeError(f"module {__name__!r} has no attribute {name!r}")
