"""`qlb reproduce`: progress, Ctrl-C and what is printed at the end."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn
from rich.table import Table

from qlb.cli.output import console, errors
from qlb.cli.progress import Interrupt
from qlb.results import FigureRow, Run, figure_rows
from qlb.simulation import available_threads
from qlb.studies import Case, Plan, Reproduction, Update, chosen_figures, plan_figures, reproduce

COMPLETE, NOT_COMPLETE, INTERRUPTED = 0, 1, 130


def reproduce_figures(
    names: Sequence[str], overrides: Sequence[str], out: Path, processes: int | None, *, overwrite: bool
) -> int:
    """Redraw figures and print their tables; the exit status: 0 all there, 1 a case crashed, 130 interrupted."""
    plan = plan_figures(chosen_figures(names), overrides, out)
    with Interrupt("Stopping; the cases that are complete are kept.") as stop, CaseReporter(plan) as reporter:
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
        again = " without --overwrite" if overwrite else ""
        errors.print(
            f"[yellow]interrupted[/]: {reporter.done} of {len(plan.cases)} cases are kept in {escape(str(out))}"
        )
        errors.print(f"The same command{again} goes on from there.")
        return INTERRUPTED
    _print_tables(result)
    return NOT_COMPLETE if result.problems else COMPLETE


class CaseReporter:
    """Called with each `Update`: a progress bar on a terminal, otherwise a line for each case that ends."""

    def __init__(self, plan: Plan) -> None:
        self.done = 0
        self._total = len(plan.cases)
        self._steps: dict[str, int] = {}
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            TextColumn("{task.percentage:>3.0f} %"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            TextColumn("{task.fields[running]}", style="dim"),
            console=errors,
            disable=not errors.is_terminal,
        )
        work = sum(case.weight * case.steps for case in plan.cases)
        self._task = self._progress.add_task(f"0/{self._total} cases", total=work, running="")

    def __call__(self, update: Update) -> None:
        """Report what became of a case."""
        case = update.case
        before = self._steps.get(case.name, 0)
        if update.state == "step":
            self._steps[case.name] = update.steps
            self._advance(case, update.steps - before)
            return
        self._steps.pop(case.name, None)
        self.done += update.state != "crashed"
        self._line(update)
        if update.state == "kept":  # no work, so that it does not count in the time left
            task = self._progress.tasks[self._task]
            self._progress.update(self._task, total=(task.total or 0.0) - case.weight * case.steps)
        self._advance(case, 0 if update.state == "kept" else case.steps - before)

    def _advance(self, case: Case, steps: int) -> None:
        self._progress.update(
            self._task,
            advance=case.weight * steps,
            description=f"{self.done}/{self._total} cases",
            running=", ".join(self._steps),
        )

    def _line(self, update: Update) -> None:
        """One line for a case that ended, where no bar shows."""
        if errors.is_terminal:
            return
        head = f"{self.done}/{self._total}  {update.case.name:<28}"
        if update.state == "kept":
            console.print(f"{head}  kept", soft_wrap=True, highlight=False)
        elif update.state == "finished":
            s = Run(update.case.directory).summary
            failed = f", {len(s['failed_steps'])} failed" if s["failed_steps"] else ""
            counts = f"mean {s['iterations_mean']:.3g}, max {s['iterations_max']}{failed}"
            console.print(f"{head}  {counts}, {s['cpu_seconds']:.3g} s CPU", soft_wrap=True, highlight=False)

    def __enter__(self) -> Self:
        """Show the bar."""
        self._progress.start()
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Leave the terminal as it was."""
        self._progress.stop()


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
