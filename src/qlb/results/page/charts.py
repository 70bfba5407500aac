"""The numbers of a run that the page plots over its steps."""

from __future__ import annotations

from typing import Any

import numpy as np

from qlb.results import style
from qlb.results.page.packing import numbers
from qlb.results.page.thinning import spread
from qlb.results.plots import residual_lines
from qlb.results.run import Run
from qlb.timing import PARTS

_MOST_LINES = 240
"""Solves whose residuals are drawn."""


def run_charts(run: Run) -> dict[str, Any]:
    """What the page draws of one run: iterations, residuals, time, contact (web/src/data.ts)."""
    return {
        "iterations": _iterations(run),
        "factorizations": _factorizations(run),
        "residuals": _residuals(run),
        "seconds": _seconds(run),
        "contact": _contact(run),
        "failedSteps": list(run.summary["failed_steps"]),
    }


def _iterations(run: Run) -> list[dict[str, Any]]:
    """A curve for each stage of the integrator."""
    names = ("first stage", "second stage", "third stage")
    several = run.stages > 1
    curves = []
    for stage in range(1, run.stages + 1):
        counts = run.iterations_per_step(stage if several else None)
        name = names[stage - 1] if several else "iterations"
        curves.append({"name": name, "steps": numbers(counts.steps), "values": numbers(counts.iterations)})
    return curves


def _factorizations(run: Run) -> dict[str, Any]:
    steps, inverse = np.unique(run.stats["step"], return_inverse=True)
    made = np.bincount(inverse, run.stats["factorizations"], len(steps)).astype(np.int64)
    return {"steps": numbers(steps), "values": numbers(made)}


def _residuals(run: Run) -> dict[str, Any]:
    lines, steps, failed = residual_lines(run.stats)
    chosen = spread(range(len(lines)), _MOST_LINES)
    return {
        "lines": [
            {
                "step": int(steps[i]),
                "failed": failed[i],
                "iterations": numbers(lines[i][:, 0].astype(np.int64)),
                "values": numbers(lines[i][:, 1]),
            }
            for i in chosen
        ],
        "solves": len(lines),
        "tolerance": run.summary.get("tolerance", {}).get("relative"),
    }


def _seconds(run: Run) -> dict[str, Any]:
    """By step and part, without parts that took none."""
    steps, inverse = np.unique(run.stats["step"], return_inverse=True)
    total = run.summary["seconds"]
    parts = [
        {
            "name": "Hessian" if part == "hessian" else part,
            "colour": style.PARTS[part],
            "total": total[part],
            "values": numbers(np.bincount(inverse, run.stats[f"seconds_{part}"], len(steps))),
        }
        for part in PARTS
        if total[part] > 0
    ]
    return {"steps": numbers(steps), "parts": parts}


def _contact(run: Run) -> dict[str, Any] | None:
    """Contacts and the smallest gap at the end of each step, where there is contact."""
    contact = run.summary.get("contact")
    if contact is None:
        return None
    last = np.flatnonzero(np.diff(run.stats["step"], append=-1))
    gaps = run.stats["minimum_distance"][last]
    return {
        "steps": numbers(run.stats["step"][last]),
        "contacts": numbers(run.stats["contacts"][last]),
        "gaps": numbers(np.where(gaps > 0, gaps, np.nan)),
        "dhat": contact["dhat"],
    }
