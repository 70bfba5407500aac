"""How figures look: one palette that colour-blind readers can tell apart (Okabe, Ito 2008), light and plain."""

from __future__ import annotations

from collections.abc import Sequence
from contextlib import AbstractContextManager
from pathlib import Path
from typing import Any

import matplotlib
from matplotlib.axes import Axes
from matplotlib.figure import Figure

from qlb.results.files import replacing

INK = "#1f2933"
FAINT = "#6b7683"
BLUE, RED = "#0072B2", "#D0342C"
LINES = (BLUE, "#E69F00", "#009E73", "#CC79A7", "#56B4E9", "#4D4D4D", "#8C510A")
PARTS = {
    "gradient": "#56B4E9",
    "hessian": "#0072B2",
    "factor": "#E69F00",
    "solve": "#009E73",
    "contact": "#CC79A7",
    "candidates": "#F0E442",
    "other": "#B8BEC6",
}
"""Colour of each part of a step."""

_SETTINGS: Any = {
    "font.family": "sans-serif",
    "font.size": 10,
    "axes.titlesize": 11,
    "axes.titleweight": "bold",
    "axes.titlelocation": "left",
    "axes.titlepad": 10,
    "axes.labelcolor": INK,
    "axes.edgecolor": "#9aa5b1",
    "axes.linewidth": 0.8,
    "axes.spines.top": False,
    "axes.spines.right": False,
    "axes.axisbelow": True,
    "axes.grid": True,
    "grid.color": "#e4e7eb",
    "grid.linewidth": 0.7,
    "text.color": INK,
    "xtick.color": FAINT,
    "ytick.color": FAINT,
    "xtick.labelcolor": INK,
    "ytick.labelcolor": INK,
    "legend.frameon": False,
    "lines.solid_capstyle": "round",
    "svg.hashsalt": "qlb",
    "svg.fonttype": "none",
}
_DOTS_PER_INCH = 160


def look() -> AbstractContextManager[None]:
    """Within it, what matplotlib makes has the look of qlb's figures."""
    return matplotlib.rc_context(_SETTINGS)


def figure(width: float, height: float) -> Figure:
    """An empty figure of a size in inches, laid out by itself."""
    return Figure(figsize=(width, height), dpi=_DOTS_PER_INCH, layout="constrained", facecolor="white")


def save(figure: Figure, path: Path) -> None:
    """Write a figure in the format of the suffix (.png, .svg, .pdf). Raises `WriteError`."""
    with replacing(path) as temporary:
        figure.savefig(temporary)


def panels(figure: Figure, columns: int) -> Sequence[Axes]:
    """Axes side by side that share their scales."""
    return list(figure.subplots(1, columns, sharex=True, sharey=True, squeeze=False)[0])
