"""Report pages: one HTML file that holds its images and needs neither network nor scripts."""

from __future__ import annotations

import base64
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from pathlib import Path
from typing import Any
from urllib.parse import quote

import jinja2

from qlb.errors import InputError
from qlb.results import layout
from qlb.results.errors import MissingExtra, RenderingFailed
from qlb.results.files import write_text
from qlb.results.picture import render_frames
from qlb.results.plots import plot_contact, plot_iterations, plot_residuals, plot_seconds
from qlb.results.run import Run
from qlb.results.statistics import failures

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


def finish_run(directory: Path, *, picture: bool = True) -> dict[str, Path]:
    """Write plots, picture and report of a run; returns each file by name.

    A picture that cannot be rendered here is not among them, and the report says why.

    Args:
        directory: a run directory.
        picture: whether to render the picture.

    Raises:
        InputError: the directory is not a qlb run, or a file in it is damaged.
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
    plot_iterations({_title(run): run}, paths["iterations"])
    plot_residuals(run, paths["residuals"])
    if run.summary.get("contact") is not None:
        plot_contact(run, paths["contact"])
    plot_seconds(run, paths["seconds"])
    files = {name: path for name, path in paths.items() if path.exists()}
    return files | {"report": write_report(run, missing)}


def write_report(run: Run, missing: Mapping[str, str] | None = None) -> Path:
    """Write report.html from the run and the images that lie in its directory.

    Args:
        run: the run.
        missing: why an image is not there, by its name; one that is not there for no reason is passed over.

    Raises:
        WriteError: the file could not be written.
    """
    s = run.summary
    path = run.directory / layout.REPORT
    context = {
        "title": _title(run),
        "verdict": _verdict(run),
        "facts": {
            "steps": s["steps"],
            "simulated time": f"{s['time']:.6g} s",
            "tetrahedra": f"{s['tets']:,}".replace(",", "\u2009"),
            "iterations a step": f"{s['iterations_mean']:.3g}",
            "factorizations": s["factorizations"],
            "wall time": f"{s['wall_seconds']:.3g} s",
        },
        "images": _images(run, missing or {}),
        "settings": flatten(run.scene),
        "statistics": _statistics(s),
        "versions": s["versions"],
        "files": [layout.STATS, layout.SUMMARY, layout.SCENE],
    }
    write_text(path, template("report.html.j2").render(context))
    return path


def write_comparison(runs: Mapping[str, Run], rows: Sequence[Mapping[str, object]], directory: Path) -> Path:
    """Write report.html and iterations.png for runs side by side.

    Args:
        runs: the runs by their labels.
        rows: a table; the first value of a row is the label of its run, and links to its report.
        directory: where to write, an existing folder; links are relative to it.

    Raises:
        InputError: there are no runs.
        WriteError: a file could not be written.
    """
    if not runs:
        raise InputError("there are no runs to compare")
    plot = directory / layout.FIGURES["iterations"]
    plot_iterations(runs, plot)
    first = next(iter(runs.values()))
    title = f"{_scene_name(first)}: {', '.join(runs)}"
    names = list(rows[0]) if rows else []
    context = {
        "title": title,
        "verdict": _verdict_of_all(runs),
        "columns": [_COLUMNS.get(name, name.replace("_", " ")) for name in names],
        "rows": [_table_row(row, runs, directory) for row in rows],
        "image": {"title": _TITLES["iterations"], "alt": _ALT["iterations"], "data": data_uri(plot)},
        "settings": common([flatten(run.scene) for run in runs.values()]),
        "versions": common([run.summary["versions"] for run in runs.values()]),
    }
    path = directory / layout.REPORT
    write_text(path, template("comparison.html.j2").render(context))
    return path


@dataclass(frozen=True)
class Verdict:
    """How a run ended, in a line."""

    level: str
    """good, bad or warn"""
    headline: str
    detail: str = ""


def _verdict(run: Run) -> Verdict:
    s = run.summary
    failed, steps = s["failed_steps"], s["steps"]
    if s["status"] == "failed":
        return Verdict("bad", f"Stopped after {_steps(steps)}.", _sentence(s["error"] or "unknown error"))
    if failed:
        return Verdict("bad", f"{_steps(len(failed))} of {steps} did not converge:", f"{_which(run, failed)}.")
    if s["status"] == "interrupted":
        return Verdict("warn", f"Interrupted after {_steps(steps)}.", "Every step taken converged.")
    if s["status"] == "running":
        return Verdict("warn", f"Not finished: {_steps(steps)} so far.", "It is still running, or it was killed.")
    return Verdict("good", f"Converged: all {_steps(steps)}.")


def _which(run: Run, failed: Sequence[int], most: int = 8) -> str:
    """Failed steps with their reasons, neighbours with the same reason as one: "3, 5 to 9 (max iterations)"."""
    groups: list[tuple[int, int, str]] = []
    for step, reason in failures(run.stats, failed).items():
        if groups and groups[-1][1] == step - 1 and groups[-1][2] == reason:
            groups[-1] = (groups[-1][0], step, reason)
        else:
            groups.append((step, step, reason))
    texts = [
        f"{first if first == last else f'{first} to {last}'} ({reason.replace('_', ' ')})"
        for first, last, reason in groups[:most]
    ]
    more = sum(last - first + 1 for first, last, _ in groups[most:])
    return ", ".join(texts) + (f" and {more} more" if more else "")


def _verdict_of_all(runs: Mapping[str, Run]) -> Verdict:
    bad = {label: _verdict(run) for label, run in runs.items() if not run.summary["converged"]}
    if not bad:
        return Verdict("good", "Converged: all steps of all runs.")
    details = [f"{label}: {len(runs[label].summary['failed_steps'])} steps failed" for label in bad]
    return Verdict("bad", "Not all steps converged.", f"{'; '.join(details)}.")


def _steps(count: int) -> str:
    return f"{count} step" if count == 1 else f"{count} steps"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")


def _scene_name(run: Run) -> str:
    return str(run.scene.get("scene") or run.directory.resolve().name)


def _title(run: Run) -> str:
    return f"{_scene_name(run)}, {run.summary['solver']}, {run.summary['integrator']}"


def _statistics(s: Mapping[str, Any]) -> dict[str, str]:
    rows = {
        "steps": s["steps"],
        "failed steps": len(s["failed_steps"]),
        "iterations a step, mean": f"{s['iterations_mean']:.4g}",
        "iterations a step, max": s["iterations_max"],
        "factorizations": s["factorizations"],
        "wall time of the time loop": f"{s['wall_seconds']:.4g} s",
        "CPU time of the time loop": f"{s['cpu_seconds']:.4g} s",
        **_contact_rows(s),
        **{f"wall time, {part}": f"{seconds:.4g} s" for part, seconds in s["seconds"].items()},
        "nodes": s["nodes"],
        "tetrahedra": s["tets"],
        "threads": s["threads"],
    }
    return {name: str(value) for name, value in rows.items()}


def _contact_rows(s: Mapping[str, Any]) -> dict[str, str]:
    """What contact came to, where there is any."""
    contact, nearest = s.get("contact"), s.get("minimum_distance")
    if contact is None:
        return {}
    return {
        "smallest distance of what touched": "nothing touched" if nearest is None else f"{nearest:.4g} m",
        "distance at which contact begins, dhat": f"{contact['dhat']:.4g} m",
        "contact stiffness": f"{contact['stiffness']:.4g} Pa",
        "friction velocity": f"{contact['friction_velocity']:.4g} m/s",
    }


def flatten(data: Mapping[str, Any], prefix: str = "") -> dict[str, str]:
    """Nested settings as dotted keys and short texts, in order."""
    rows: dict[str, str] = {}
    for key, value in data.items():
        if isinstance(value, Mapping):
            rows |= flatten(value, f"{prefix}{key}.")
        else:
            rows[f"{prefix}{key}"] = _short(value)
    return rows


def _short(value: object) -> str:
    if value is None:
        return "\u2013"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        shown = ", ".join(_short(item) for item in value[:12])
        return f"{shown}, ... ({len(value)} values)" if len(value) > 12 else shown
    text = str(value)
    return text if len(text) <= 400 else text[:397] + "..."


def common(tables: Sequence[Mapping[str, str]]) -> dict[str, str]:
    """What all tables say alike."""
    first, *others = tables
    return {key: value for key, value in first.items() if all(t.get(key) == value for t in others)}


def _table_row(row: Mapping[str, object], runs: Mapping[str, Run], directory: Path) -> dict[str, Any]:
    label, *values = row.values()
    run = runs.get(str(label))
    link = None
    if run is not None and (run.directory / layout.REPORT).exists():
        relative = os.path.relpath(run.directory / layout.REPORT, directory)
        link = quote(Path(relative).as_posix())
    cells = [f"{value:.3g}" if isinstance(value, float) else _short(value) for value in values]
    return {"label": str(label), "link": link, "cells": cells}


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
