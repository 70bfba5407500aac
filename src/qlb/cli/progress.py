"""Live progress on a terminal, one line per step where asked, and Ctrl-C between steps."""

from __future__ import annotations

import signal
from types import FrameType, TracebackType
from typing import Self

from rich.progress import (
    BarColumn,
    MofNCompleteColumn,
    Progress,
    TextColumn,
    TimeElapsedColumn,
    TimeRemainingColumn,
)

from qlb.cli.output import console, errors
from qlb.step_result import StepResult


class StepReporter:
    """Called with each `StepResult`: moves the progress bar, and prints a line where `verbose`."""

    def __init__(self, label: str, steps: int, *, verbose: bool) -> None:
        self._label = label
        self._steps = steps
        self._verbose = verbose
        self._progress = Progress(
            TextColumn("{task.description}"),
            BarColumn(),
            MofNCompleteColumn(),
            TextColumn("{task.fields[note]}"),
            TimeElapsedColumn(),
            TextColumn("left"),
            TimeRemainingColumn(),
            console=errors,
            disable=not errors.is_terminal,
        )
        self._progress.start()
        self._task = self._progress.add_task(label or "steps", total=steps, note="")

    def __call__(self, result: StepResult) -> None:
        """Report one step."""
        mark = "" if result.converged else f" [red]{result.reason.value}[/]"
        self._progress.update(self._task, completed=result.step, note=f"{result.iterations} iterations{mark}")
        if self._verbose:
            console.print(self._line(result) + mark, soft_wrap=True, highlight=False)

    def _line(self, result: StepResult) -> str:
        solve = result.solves[-1]
        seconds = sum(sum(row.seconds.values()) for s in result.solves for row in s.rows)
        label = f"{self._label}  " if self._label else ""
        cut = f"  cut into {result.parts} parts" if result.parts > 1 else ""
        return (
            f"{label}step {result.step:>{len(str(self._steps))}}/{self._steps}  t = {result.time:.6g} s"
            f"  {result.iterations} iterations  {result.factorizations} factorizations"
            f"  |g| = {solve.residual:.2e}  {1e3 * seconds:.1f} ms{cut}"
        )

    def close(self) -> None:
        """Leave the terminal as it was."""
        self._progress.stop()

    def __enter__(self) -> Self:
        """Nothing more to do: progress shows from the start."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Close."""
        self.close()


class Interrupt:
    """Turns Ctrl-C (and SIGTERM) into a wish to stop at a good moment; a second one stops at once."""

    def __init__(self, notice: str = "Stopping after this step; what is done is kept.") -> None:
        self._notice = notice
        self._wanted = False
        self._old: dict[signal.Signals, object] = {}

    def __call__(self) -> bool:
        """Whether to stop."""
        return self._wanted

    def _on_signal(self, number: int, frame: FrameType | None) -> None:
        if self._wanted:
            raise KeyboardInterrupt
        self._wanted = True
        errors.print(f"{self._notice} Once more to stop at once.")

    def __enter__(self) -> Self:
        """Listen to the signals."""
        for name in (signal.SIGINT, signal.SIGTERM):
            self._old[name] = signal.signal(name, self._on_signal)
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Give the signals back."""
        for name, handler in self._old.items():
            signal.signal(name, handler)  # type: ignore[arg-type]
