"""What the commands print at the end."""

from __future__ import annotations

from collections.abc import Mapping, Sequence
from pathlib import Path
from typing import Any

from rich.console import Console
from rich.markup import escape
from rich.table import Column, Table

console = Console()
errors = Console(stderr=True)


def print_outcome(summary: Mapping[str, Any], files: Mapping[str, Path]) -> None:
    """The verdict of a run in a line or two, then where its files lie."""
    console.print(_verdict(summary), soft_wrap=True, highlight=False)
    for name, path in files.items():
        console.print(f"{name:<11} {escape(str(path))}", soft_wrap=True, highlight=False)


def _verdict(summary: Mapping[str, Any]) -> str:
    counts = (
        f"{summary['steps']} step{'' if summary['steps'] == 1 else 's'},"
        f" {summary['iterations_mean']:.2f} iterations a step (at most"
        f" {summary['iterations_max']}), {summary['factorizations']} factorizations,"
        f" {summary['wall_seconds']:.2f} s ({summary['cpu_seconds']:.2f} s CPU)"
    )
    if summary["status"] == "interrupted":
        return f"[yellow]interrupted[/]: {counts}"
    if summary["converged"]:
        return f"[green]converged[/]: {counts}"
    failed = summary["failed_steps"]
    which = ", ".join(map(str, failed[:8])) + (", ..." if len(failed) > 8 else "")
    reason = f"\n{escape(summary['error'])}" if summary.get("error") else ""
    steps = f"{len(failed)} step{'s' if len(failed) > 1 else ''}"
    return f"[red]not converged[/] in {steps} ({which}): {counts}{reason}"


def print_scenes(scenes: Mapping[str, type]) -> None:
    """Name and first line of each scene, and how to go on."""
    table = Table(Column(style="bold", no_wrap=True), "", show_header=False, box=None, pad_edge=False)
    for name, kind in scenes.items():
        table.add_row(name, escape((kind.__doc__ or "").splitlines()[0]))
    console.print(table)
    console.print(
        "`qlb run NAME` runs one; `qlb scenes --show NAME > mine.yaml` writes it as a file to change and run."
    )


def print_comparison(rows: Sequence[Mapping[str, Any]], report: Path) -> None:
    """The table of `qlb compare`."""
    table = Table(Column("solver", overflow="fold"), "steps", "failed", "mean", "max", "factors", "CPU s", "off by")
    for column in table.columns[1:]:
        column.justify, column.no_wrap = "right", True
    for row in rows:
        difference = row["difference"]
        table.add_row(
            row["solver"],
            str(row["steps"]),
            f"[red]{row['failed']}[/]" if row["failed"] else "0",
            f"{row['iterations_mean']:.2f}",
            str(row["iterations_max"]),
            str(row["factorizations"]),
            f"{row['cpu_seconds']:.2f}",
            "-" if difference is None else f"{difference:.1e}",
        )
    console.print(table)
    console.print(
        "mean, max: nonlinear iterations a step; factors: Cholesky factorizations; off by: largest distance of a node"
        f" of the final state from that of {rows[0]['solver']}, over the longest side of the body",
        soft_wrap=True,
    )
    console.print(f"report      {escape(str(report))}", soft_wrap=True, highlight=False)
