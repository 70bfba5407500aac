"""The figures of runs in a grid, as data for the page that draws them."""

from __future__ import annotations

from collections.abc import Sequence
from typing import Any

import numpy as np

from qlb.results.figure import FigureGrid, stage_curves, words_on
from qlb.results.page.packing import numbers
from qlb.results.page.scripts import page_data
from qlb.results.run import Run

_STAGES = ("first stage", "second stage", "third stage")


def figures_content(grids: Sequence[FigureGrid]) -> str:
    """What the page draws of figures (`FigureData` in web/src/data.ts), as JSON that may stand in a script element."""
    return page_data({"figures": [_figure(grid) for grid in grids]})


def _figure(grid: FigureGrid) -> dict[str, Any]:
    rows = [
        {"label": label, "panels": [_panel(runs[s]) if s in runs else None for s in grid.solvers]}
        for label, runs in grid.runs.items()
    ]
    return {"number": grid.number, "solvers": list(grid.solvers), "rows": rows}


def _panel(run: Run) -> dict[str, Any]:
    curves = stage_curves(run)
    names = _STAGES if len(curves) > 1 else ("iterations",)
    counts, trouble = words_on(run)
    failed = [(curve.steps[~curve.converged], curve.iterations[~curve.converged]) for curve in curves]
    steps, values = (np.concatenate(parts) for parts in zip(*failed, strict=True))
    return {
        "stages": [
            {"name": name, "steps": numbers(curve.steps), "values": numbers(curve.iterations)}
            for name, curve in zip(names, curves, strict=False)
        ],
        "failed": {"steps": numbers(steps), "values": numbers(values)},
        "counts": counts,
        "trouble": trouble,
    }
