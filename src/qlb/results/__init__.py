"""Results of runs: the run directory, plots, pictures and reports."""

from qlb.results.errors import MissingExtra, RenderingFailed, WriteError
from qlb.results.figure import FigureGrid, write_figure
from qlb.results.figure_page import FigureRow, figure_rows, write_figures_page
from qlb.results.picture import render_frames
from qlb.results.plots import plot_contact, plot_iterations, plot_residuals, plot_seconds
from qlb.results.report import finish_run, write_comparison, write_report
from qlb.results.run import Frame, Run, StepIterations
from qlb.results.run_writer import RunWriter
from qlb.results.statistics import COLUMNS

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
]
