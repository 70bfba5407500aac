"""`qlb export`: progress and what is printed at the end."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path

from rich.markup import escape
from rich.progress import BarColumn, MofNCompleteColumn, Progress, TextColumn, TimeElapsedColumn, TimeRemainingColumn

from qlb.cli.output import console, errors
from qlb.errors import InputError
from qlb.export import Exported, export_run
from qlb.results import Run


def export_directory(
    directory: Path,
    out: Path | None,
    format: str | None,
    steps: str,
    *,
    overwrite: bool,
    options: Mapping[str, object],
) -> None:
    """Export the run in `directory`, with a bar on a terminal, and say what lies where."""
    progress = Progress(
        TextColumn("{task.description}"),
        BarColumn(),
        MofNCompleteColumn(),
        TimeElapsedColumn(),
        TextColumn("left"),
        TimeRemainingColumn(),
        console=errors,
        disable=not errors.is_terminal,
    )
    given = {**options, "size": _pixels(options["size"])}
    with progress:
        task = progress.add_task("frames", total=None)
        done = export_run(
            Run(directory),
            out,
            format=format,
            steps=steps,
            overwrite=overwrite,
            on_frame=lambda frames, total: progress.update(task, completed=frames, total=total),
            **given,
        )
    _report(done)


def _report(done: Exported) -> None:
    more = f" and {len(done.files) - 1} more" if len(done.files) > 1 else ""
    frames = f"{done.frames} frame{'s' if done.frames > 1 else ''}"
    console.print(f"{frames}, {_size(done.size)}", soft_wrap=True, highlight=False)
    console.print(f"{done.format:<11} {escape(str(done.files[0]))}{more}", soft_wrap=True, highlight=False)
    for note in done.notes:
        console.print(f"note        {escape(note)}", soft_wrap=True, highlight=False)


def _size(count: int) -> str:
    return f"{count / 1e6:.3g} MB" if count >= 1e6 else f"{count / 1e3:.3g} kB"


def _pixels(text: object) -> tuple[int, int] | None:
    """Width and height of "1280x720"."""
    if text is None:
        return None
    parts = str(text).lower().split("x")
    if len(parts) != 2 or not all(part.isdecimal() for part in parts):
        raise InputError(f"size = {text!r} must be WIDTHxHEIGHT in pixels, such as 1280x720")
    return int(parts[0]), int(parts[1])
