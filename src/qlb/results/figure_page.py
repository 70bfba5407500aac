"""One page with figures in a grid, the numbers of each and what to expect; needs no network."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path

from qlb.results.figure import PAGE, FigureGrid
from qlb.results.files import write_text
from qlb.results.page import figures_content, page_scripts
from qlb.results.report import data_uri, template
from qlb.results.run import Run
from qlb.results.wording import Verdict, common, flatten


@dataclass(frozen=True)
class FigureRow:
    """The counts of one panel; None where it has no run."""

    row: str
    solver: str
    mean: float | None
    max: int | None
    failed: int | None
    """steps that did not converge"""
    factorizations: int | None
    cpu_seconds: float | None
    stopped: bool = False
    """whether the run ended early, at a step that it could not go on from"""
    reference: str = ""

    @staticmethod
    def of(label: str, solver: str, run: Run | None, reference: str) -> FigureRow:
        """From a run."""
        if run is None:
            return FigureRow(label, solver, None, None, None, None, None, reference=reference)
        s = run.summary
        return FigureRow(
            label,
            solver,
            s["iterations_mean"],
            s["iterations_max"],
            len(s["failed_steps"]),
            s["factorizations"],
            s["cpu_seconds"],
            s["status"] != "complete",
            reference,
        )


def figure_rows(grid: FigureGrid) -> list[FigureRow]:
    """The table of a figure: one row for each panel."""
    return [
        FigureRow.of(label, solver, run, grid.reference.get(label, {}).get(solver, ""))
        for label, solver, run in grid.cells()
    ]


def write_figures_page(
    grids: Sequence[FigureGrid], directory: Path, problems: Mapping[str, str], notes: Sequence[str] = ()
) -> Path:
    """Write index.html from figures whose images `write_figure` has put into `directory`.

    Args:
        grids: the figures, in order.
        directory: where the images lie and the page goes.
        problems: why a run is not there or not whole, by its name.
        notes: paragraphs on all figures.

    Raises:
        WriteError: the file could not be written.
    """
    runs = [run for grid in grids for _, _, run in grid.cells() if run]
    scripts = page_scripts(("plots",))
    context = {
        "title": "The supplement's figures, redrawn",
        "verdict": _verdict(grids, problems),
        "problems": problems,
        "notes": notes,
        "figures": [_figure(grid, directory, moving=scripts is not None) for grid in grids],
        "scripts": scripts,
        "content": figures_content(grids),
        "has_findings": any(grid.findings for grid in grids),
        "settings": common([flatten(run.scene) for run in runs]) if runs else {},
        "versions": common([run.summary["versions"] for run in runs]) if runs else {},
    }
    path = directory / PAGE
    write_text(path, template("figures.html.j2").render(context))
    return path


def _figure(grid: FigureGrid, directory: Path, *, moving: bool) -> dict[str, object]:
    """What the page says of a figure; its image stands in the page where nothing draws it there."""
    rows, image = figure_rows(grid), f"figure-{grid.number}.png"
    return {
        "number": grid.number,
        "title": grid.title,
        "parameter": grid.parameter,
        "image": image if moving else data_uri(directory / image),
        "alt": f"Nonlinear iterations over time steps of {', '.join(grid.solvers)}; rows: {', '.join(grid.runs)}",
        "expectation": grid.expectation,
        "findings": grid.findings,
        "groups": [[row for row in rows if row.row == label] for label in grid.runs],
        "has_reference": any(row.reference for row in rows),
        "files": [f"figure-{grid.number}.{suffix}" for suffix in ("svg", "pdf", "png", "csv")],
    }


def _verdict(grids: Sequence[FigureGrid], problems: Mapping[str, str]) -> Verdict:
    """How it went, in a line. Steps that fail are part of what the figures show, and said so."""
    if problems:
        many = "1 run is" if len(problems) == 1 else f"{len(problems)} runs are"
        return Verdict("bad", f"{many} missing or not whole.", "The reasons stand below.")
    rows = [row for grid in grids for row in figure_rows(grid)]
    failed = sorted({row.solver for row in rows if row.failed})
    if not failed:
        return Verdict("good", "All runs are complete, and every step converged.")
    return Verdict("warn", "All runs are complete.", f"Steps of {', '.join(failed)} did not converge; they are marked.")
