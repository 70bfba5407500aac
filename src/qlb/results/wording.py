"""What pages say of runs in words and tables: how they ended, their settings and numbers."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from typing import Any

from qlb.results.run import Run
from qlb.results.statistics import failures


@dataclass(frozen=True)
class Verdict:
    """How a run ended, in a line."""

    level: str
    """good, bad or warn"""
    headline: str
    detail: str = ""


def verdict(run: Run) -> Verdict:
    """How a run ended."""
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


def verdict_of_all(runs: Mapping[str, Run]) -> Verdict:
    """How runs ended, in one line."""
    bad = {label: verdict(run) for label, run in runs.items() if not run.summary["converged"]}
    if not bad:
        return Verdict("good", "Converged: all steps of all runs.")
    details = [f"{label}: {len(runs[label].summary['failed_steps'])} steps failed" for label in bad]
    return Verdict("bad", "Not all steps converged.", f"{'; '.join(details)}.")


def _steps(count: int) -> str:
    return f"{count} step" if count == 1 else f"{count} steps"


def _sentence(text: str) -> str:
    return text[:1].upper() + text[1:] + ("" if text.endswith(".") else ".")


def scene_name(run: Run) -> str:
    """The scene of a run, or its folder."""
    return str(run.scene.get("scene") or run.directory.resolve().name)


def title(run: Run) -> str:
    """Scene, solver and integrator."""
    return f"{scene_name(run)}, {run.summary['solver']}, {run.summary['integrator']}"


def facts(s: Mapping[str, Any]) -> dict[str, str]:
    """The numbers of a summary that stand at the top of its page."""
    return {
        "steps": str(s["steps"]),
        "simulated time": f"{s['time']:.6g} s",
        "tetrahedra": f"{s['tets']:,}".replace(",", "\u2009"),
        "iterations a step": f"{s['iterations_mean']:.3g}",
        "factorizations": str(s["factorizations"]),
        "wall time": f"{s['wall_seconds']:.3g} s",
    }


def statistics(s: Mapping[str, Any]) -> dict[str, str]:
    """A summary as a table."""
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
            rows[f"{prefix}{key}"] = short(value)
    return rows


def short(value: object) -> str:
    """A setting as a short text."""
    if value is None:
        return "\u2013"
    if isinstance(value, bool):
        return "yes" if value else "no"
    if isinstance(value, float):
        return f"{value:.6g}"
    if isinstance(value, list | tuple):
        shown = ", ".join(short(item) for item in value[:12])
        return f"{shown}, ... ({len(value)} values)" if len(value) > 12 else shown
    text = str(value)
    return text if len(text) <= 400 else text[:397] + "..."


def common(tables: Sequence[Mapping[str, str]]) -> dict[str, str]:
    """What all tables say alike."""
    first, *others = tables
    return {key: value for key, value in first.items() if all(t.get(key) == value for t in others)}
