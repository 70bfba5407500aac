"""Report pages: each one HTML file that holds all it shows and needs no network."""

from __future__ import annotations

import base64
import os
from collections.abc import Mapping, Sequence
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

import jinja2

from qlb.errors import InputError
from qlb.results import layout
from qlb.results.errors import MissingExtra, RenderingFailed
from qlb.results.files import write_text
from qlb.results.page import PAGE_BYTES, SCRIPTS_MISSING, page_content, page_scripts
from qlb.results.picture import render_frames
from qlb.results.plots import plot_contact, plot_iterations, plot_residuals, plot_seconds
from qlb.results.run import Run
from qlb.results.wording import common, facts, flatten, scene_name, short, statistics, title, verdict, verdict_of_all

_TITLES = {
    "picture": "The run",
    "iterations": "Nonlinear iterations",
    "residuals": "Convergence",
    "contact": "Contact",
    "seconds": "Time",
}
_ALT = {
    "picture": "The deformed bodies at chosen times",
    "iterations": "Nonlinear iterations over time steps",
    "residuals": "Relative residual over nonlinear iterations, one line for each solve",
    "contact": "Contacts and the smallest distance between what touches, over time steps",
    "seconds": "Seconds by part of a step, in total and over time steps",
}
_COLUMNS = {
    "iterations_mean": "iterations, mean",
    "iterations_max": "iterations, max",
    "failed": "failed steps",
    "wall_seconds": "wall time [s]",
    "cpu_seconds": "CPU time [s]",
    "difference": "final state off by [of the body's length]",
}


def finish_run(directory: Path, *, picture: bool = True, most_bytes: int = PAGE_BYTES) -> dict[str, Path]:
    """Write plots, picture and report of a run; returns each file by name.

    A picture that cannot be rendered here is not among them, and the report says why.

    Args:
        directory: a run directory.
        picture: whether to render the picture.
        most_bytes: about the size of the report at most; frames and vertices are thinned out until they fit.

    Raises:
        InputError: the directory is not a qlb run, a file in it is damaged, or most_bytes is out of range.
        WriteError: a file could not be written.
    """
    run = Run(directory)
    paths = {name: run.directory / file for name, file in layout.FIGURES.items()}
    missing = {}
    if picture:
        try:
            render_frames(run, paths["picture"])
        except (MissingExtra, RenderingFailed) as error:
            missing["picture"] = str(error)
    plot_iterations({title(run): run}, paths["iterations"])
    plot_residuals(run, paths["residuals"])
    if run.summary.get("contact") is not None:
        plot_contact(run, paths["contact"])
    plot_seconds(run, paths["seconds"])
    files = {name: path for name, path in paths.items() if path.exists()}
    return files | {"report": write_report(run, missing, most_bytes=most_bytes)}


def write_report(run: Run, missing: Mapping[str, str] | None = None, *, most_bytes: int = PAGE_BYTES) -> Path:
    """Write report.html from the run and, where the scripts of pages were not built, the images in its directory.

    Args:
        run: the run.
        missing: why an image is not there, by its name; one that is not there for no reason is passed over.
        most_bytes: about the size of the page at most.

    Raises:
        InputError: a file of the run is missing or damaged, or most_bytes is out of range.
        WriteError: the file could not be written.
    """
    path = run.directory / layout.REPORT
    moving = moving_parts({title(run): run}, most_bytes=most_bytes)
    write_text(path, template("report.html.j2").render(report_context(run, missing or {}) | moving))
    return path


def report_context(run: Run, missing: Mapping[str, str]) -> dict[str, Any]:
    """What stands on the page of a run beside what moves."""
    images = _images(run, missing)
    return {
        "title": title(run),
        "verdict": verdict(run),
        "facts": facts(run.summary),
        "picture": next((image for image in images if image["name"] == "picture"), None),
        "images": images,
        "settings": flatten(run.scene),
        "statistics": statistics(run.summary),
        "meshing": run.summary.get("meshing", []),
        "versions": run.summary["versions"],
        "files": [layout.STATS, layout.SUMMARY, layout.SCENE],
    }


def moving_parts(runs: Mapping[str, Run], *, most_bytes: int, live: bool = False) -> dict[str, Any]:
    """Scripts of a page and their data; both are None where the scripts were not built, and a note says so."""
    scripts = page_scripts(("viewer", "plots"))
    if scripts is None:
        return {"scripts": None, "content": None, "scripts_missing": SCRIPTS_MISSING, "live": live}
    room = most_bytes - sum(map(len, scripts))
    return {
        "scripts": scripts,
        "content": page_content(runs, most_bytes=room, live=live),
        "scripts_missing": None,
        "live": live,
    }


def write_comparison(
    runs: Mapping[str, Run],
    rows: Sequence[Mapping[str, object]],
    directory: Path,
    *,
    most_bytes: int = PAGE_BYTES,
) -> Path:
    """Write report.html and iterations.png for runs side by side.

    Args:
        runs: the runs by their labels.
        rows: a table; the first value of a row is the label of its run, and links to its report.
        directory: where to write, an existing folder; links are relative to it.
        most_bytes: about the size of the page at most.

    Raises:
        InputError: there are no runs, or most_bytes is out of range.
        WriteError: a file could not be written.
    """
    if not runs:
        raise InputError("there are no runs to compare")
    plot = directory / layout.FIGURES["iterations"]
    plot_iterations(runs, plot)
    first = next(iter(runs.values()))
    names = list(rows[0]) if rows else []
    context = {
        "title": f"{scene_name(first)}: {', '.join(runs)}",
        "verdict": verdict_of_all(runs),
        "columns": [_COLUMNS.get(name, name.replace("_", " ")) for name in names],
        "rows": [_table_row(row, runs, directory) for row in rows],
        "image": {"title": _TITLES["iterations"], "alt": _ALT["iterations"], "data": data_uri(plot)},
        "settings": common([flatten(run.scene) for run in runs.values()]),
        "versions": common([run.summary["versions"] for run in runs.values()]),
        **moving_parts(runs, most_bytes=most_bytes),
    }
    path = directory / layout.REPORT
    write_text(path, template("comparison.html.j2").render(context))
    return path


def _table_row(row: Mapping[str, object], runs: Mapping[str, Run], directory: Path) -> dict[str, Any]:
    label, *values = row.values()
    run = runs.get(str(label))
    link = None if run is None else link_to(run, directory)
    cells = [f"{value:.3g}" if isinstance(value, float) else short(value) for value in values]
    return {"label": str(label), "link": link, "cells": cells}


def link_to(run: Run, directory: Path) -> str | None:
    """The report of a run, where it has one, as seen from a page in `directory`."""
    report = run.directory / layout.REPORT
    return quote(Path(os.path.relpath(report, directory)).as_posix()) if report.exists() else None


def _images(run: Run, missing: Mapping[str, str]) -> list[dict[str, str | None]]:
    paths = {name: run.directory / file for name, file in layout.FIGURES.items()}
    return [
        {
            "name": name,
            "title": _TITLES[name],
            "alt": _ALT[name],
            "data": data_uri(path) if path.exists() else None,
            "missing": missing.get(name),
        }
        for name, path in paths.items()
        if path.exists() or name in missing
    ]


def data_uri(path: Path) -> str:
    """An image as a data URI, to stand in the page itself."""
    return "data:image/png;base64," + base64.b64encode(path.read_bytes()).decode("ascii")


@cache
def _environment() -> jinja2.Environment:
    folder = Path(__file__).parent / "templates"
    return jinja2.Environment(
        loader=jinja2.FileSystemLoader(folder), autoescape=True, undefined=jinja2.StrictUndefined, trim_blocks=True
    )


def template(name: str) -> jinja2.Template:
    """A page template by its file name."""
    return _environment().get_template(name)
