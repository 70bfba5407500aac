"""`qlb reproduce`: progress, Ctrl-C and what is printed at the end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

from rich.markup import escape
from rich.table import Table

from qlb.cli.cases import CaseReporter, print_interrupted
from qlb.cli.output import console, errors
from qlb.cli.progress import Interrupt
from qlb.results import FigureRow, figure_rows
from qlb.simulation import available_threads
from qlb.studies import Reproduction, chosen_figures, plan_figures, reproduce

COMPLETE, NOT_COMPLETE, INTERRUPTED = 0, 1, 130


def reproduce_figures(
    names: Sequence[str], overrides: Sequence[str], out: Path, processes: int | None, *, overwrite: bool
) -> int:
    """Redraw figures and print their tables; the exit status: 0 all there, 1 a case crashed, 130 interrupted."""
    plan = plan_figures(chosen_figures(names), overrides, out)
    with Interrupt("Stopping; the cases that are complete are kept.") as stop, CaseReporter(plan.cases) as reporter:
        result = reproduce(
            plan,
            processes=available_threads() if processes is None else processes,
            overwrite=overwrite,
            on_update=reporter,
            stop=stop,
        )
    for name, problem in result.problems.items():
        errors.print(f"[bold red]crashed:[/] {name}: {escape(problem)}", soft_wrap=True, highlight=False)
    if result.interrupted:
        print_interrupted(reporter.done, len(plan.cases), out, overwrite=overwrite)
        return INTERRUPTED
    _print_tables(result)
    return NOT_COMPLETE if result.problems else COMPLETE


def _print_tables(result: Reproduction) -> None:
    for grid in result.grids:
        table = Table("row", "solver", title=f"Figure {grid.number}: {grid.title}", title_justify="left")
        for name in ("mean", "max", "failed", "factors", "CPU s"):
            table.add_column(name, justify="right", no_wrap=True)
        rows = figure_rows(grid)
        for before, row in zip([None, *rows], rows, strict=False):
            new = before is None or before.row != row.row
            if new and before is not None:
                table.add_section()
            table.add_row(escape(row.row) if new else "", row.solver, *_cells(row))
        console.print(table)
    console.print("mean, max: nonlinear iterations a step; factors: Cholesky factorizations", soft_wrap=True)
    _print_findings(result)
    console.print(f"figures     {escape(str(result.directory))}/figure-*", soft_wrap=True, highlight=False)
    console.print(f"page        {escape(str(result.page))}", soft_wrap=True, highlight=False)


def _print_findings(result: Reproduction) -> None:
    """How many statements hold, and those that do not."""
    findings = [(grid.number, finding) for grid in result.grids for finding in grid.findings]
    holds = sum(finding.holds is True for _, finding in findings)
    console.print(
        f"statements  {holds} of {len(findings)} hold; each stands on the page", soft_wrap=True, highlight=False
    )
    for number, finding in findings:
        if finding.holds is not True:
            text = (
                f"  figure {number}, [yellow]{finding.verdict}[/]: {escape(f'{finding.statement} {finding.sentence}')}"
            )
            console.print(text, soft_wrap=True, highlight=False)


def _cells(row: FigureRow) -> tuple[str, ...]:
    if row.mean is None:
        return ("[red]no run[/]", "", "", "", "")
    failed = f"[red]{row.failed}[/]" if row.failed else "0"
    if row.stopped:
        failed += " [red]stopped[/]"
    return (f"{row.mean:.3g}", str(row.max), failed, str(row.factorizations), f"{row.cpu_seconds:.3g}")
