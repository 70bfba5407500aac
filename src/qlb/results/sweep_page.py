"""One page for the cases of a sweep: a table that can be sorted, plots over the keys, and what failed."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from qlb.results import layout
from qlb.results.files import write_text
from qlb.results.page import SCRIPTS_MISSING, page_data, page_scripts
from qlb.results.report import link_to, template
from qlb.results.run import Run
from qlb.results.wording import Verdict, common, short, verdict

_COLUMNS = {
    "status": "status",
    "steps": "steps",
    "iterations_mean": "iterations, mean",
    "iterations_max": "iterations, max",
    "failed_steps": "failed steps",
    "factorizations": "factorizations",
    "minimum_distance": "smallest gap [m]",
    "tets": "tetrahedra",
    "wall_seconds": "wall time [s]",
    "cpu_seconds": "CPU time [s]",
}
"""Columns of the page beside the keys, by their names in the rows; one that is empty everywhere is left out."""

Row = Mapping[str, Any]


def write_sweep_page(
    rows: Sequence[Row], keys: Sequence[str], runs: Mapping[str, Run], directory: Path, settings: Mapping[str, str]
) -> Path:
    """Write report.html for a sweep.

    Args:
        rows: the table: case, keys, status, error and counts of each case, empty where there are none.
        keys: what is swept.
        runs: those that are there, by case.
        directory: where to write, an existing folder; links are relative to it.
        settings: what all cases share, and "scene".

    Raises:
        WriteError: the file could not be written.
    """
    names = [name for name in _COLUMNS if any(row[name] not in ("", None) for row in rows)]
    varied = [key for key in keys if len({row[key] for row in rows}) > 1]
    scripts = page_scripts(("plots",))
    trouble = {row["case"]: _trouble(row, runs.get(row["case"])) for row in rows if not _good(row)}
    context = {
        "title": f"Sweep of {settings.get('scene', 'a scene')}" + (f" over {', '.join(varied)}" if varied else ""),
        "verdict": _verdict(len(rows), len(trouble)),
        "trouble": trouble,
        "columns": [*varied, *(_COLUMNS[name] for name in names)],
        "rows": [_table_row(row, [*varied, *names], runs, directory) for row in rows],
        "settings": {**settings, **{key: rows[0][key] for key in keys if key not in varied}},
        "versions": common([run.summary["versions"] for run in runs.values()]) if runs else {},
        "scripts": scripts,
        "scripts_missing": SCRIPTS_MISSING,
        "content": page_data({"sweep": {"keys": list(keys), "cases": [_case(row, keys) for row in rows]}}),
    }
    path = directory / layout.REPORT
    write_text(path, template("sweep.html.j2").render(context))
    return path


def _good(row: Row) -> bool:
    return bool(row["status"] == "complete" and row["converged"] == "true")


def _verdict(cases: int, bad: int) -> Verdict:
    if not bad:
        return Verdict("good", f"Converged: all steps of {'the case' if cases == 1 else f'all {cases} cases'}.")
    return Verdict("bad", f"{bad} of {cases} {'case' if cases == 1 else 'cases'} failed, or not all steps converged.")


def _trouble(row: Row, run: Run | None) -> str:
    """What went wrong with a case."""
    if run is None:
        return f"{row['status']}: {row['error']}"
    found = verdict(run)
    return f"{found.headline} {found.detail}".strip()


def _table_row(row: Row, names: Sequence[str], runs: Mapping[str, Run], directory: Path) -> dict[str, Any]:
    run = runs.get(row["case"])
    cells = ["" if row[name] is None else _cell(row[name]) for name in names]
    return {"label": row["case"], "link": run and link_to(run, directory), "cells": cells, "good": _good(row)}


def _cell(value: object) -> str:
    return f"{value:.3g}" if isinstance(value, float) else short(value)


def _case(row: Row, keys: Sequence[str]) -> dict[str, Any]:
    """For the plots (`SweepCase` in web/src/data.ts)."""
    numbers = {"mean": "iterations_mean", "max": "iterations_max", "factorizations": "factorizations"}
    return {
        "name": row["case"],
        "values": [row[key] for key in keys],
        "good": _good(row),
        **{short_name: _number(row[name]) for short_name, name in (numbers | {"cpu": "cpu_seconds"}).items()},
    }


def _number(value: Any) -> float | None:
    return None if value == "" else value
