"""`qlb sweep`: progress, Ctrl-C and the table at the end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from qlb.cli.cases import CaseReporter, print_interrupted
from qlb.cli.output import console, errors
from qlb.cli.progress import Interrupt
from qlb.simulation import available_threads
from qlb.studies import Sweep, plan_sweep, sweep

CONVERGED, NOT_CONVERGED, INTERRUPTED = 0, 1, 130


def run_sweep(
    scene: str,
    lists: Sequence[str],
    overrides: Sequence[str],
    out: Path,
    processes: int | None,
    scheduler: str | None,
    *,
    overwrite: bool,
) -> int:
    """Run a sweep and print its table; the exit status: 0 all steps converged, 1 a case failed, 130 interrupted."""
    plan = plan_sweep(scene, lists, out, overrides)
    with Interrupt("Stopping; the cases that are done are kept.") as stop, CaseReporter(plan.cases) as reporter:
        result = sweep(
            plan,
            processes=available_threads() if processes is None else processes,
            scheduler=scheduler,
            overwrite=overwrite,
            on_update=reporter,
            stop=stop,
        )
    if result.interrupted:
        print_interrupted(reporter.done, len(plan.cases), out, overwrite=overwrite)
        return INTERRUPTED
    _print_table(result, list(plan.members[0].values))
    return CONVERGED if result.converged else NOT_CONVERGED


def _print_table(result: Sweep, keys: Sequence[str]) -> None:
    table = Table(*map(escape, keys), "status")
    for name in ("steps", "mean", "max", "failed", "CPU s"):
        table.add_column(name, justify="right", no_wrap=True)
    for row in result.rows:
        good = row["status"] == "complete" and row["converged"] == "true"
        status = row["status"] if good else f"[red]{row['status']}[/]"
        numbers = (
            []
            if row["steps"] == ""
            else [
                str(row["steps"]),
                f"{row['iterations_mean']:.3g}",
                str(row["iterations_max"]),
                str(row["failed_steps"]),
                f"{row['cpu_seconds']:.3g}",
            ]
        )
        table.add_row(*(escape(row[key]) for key in keys), status, *numbers)
    console.print(table)
    for row in result.rows:
        if row["error"]:
            errors.print(f"[bold red]{row['status']}:[/] {escape(row['case'] + ': ' + row['error'])}", soft_wrap=True)
    console.print("mean, max: nonlinear iterations a step", soft_wrap=True)
    for name, path in {"table": result.table, "report": result.page}.items():
        console.print(f"{name:<11} {escape(str(path))}", soft_wrap=True, highlight=False)
