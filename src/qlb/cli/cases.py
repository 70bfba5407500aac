"""Progress of the cases of a study."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from types import TracebackType
from typing import Self

from rich.markup import escape
from rich.progress import BarColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from qlb.cli.output import console, errors
from qlb.results import Run
from qlb.studies import Case, Update


def print_interrupted(done: int, total: int, out: Path, *, overwrite: bool) -> None:
    """What is kept, and how to go on."""
    again = " without --overwrite" if overwrite else ""
    errors.print(f"[yellow]interrupted[/]: {done} of {total} cases are kept in {escape(str(out))}")
    errors.print(f"The same command{again} goes on from there.")


class CaseReporter:
    """Called with each `Update`: a progress bar on a terminal, otherwise a line for each case that ends."""

    def __init__(self, cases: Sequence[Case]) -> None:
        self.done = 0
        self._total = len(cases)
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
        work = sum(case.weight * case.steps for case in cases)
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
        self.done += update.state in ("kept", "finished")
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
