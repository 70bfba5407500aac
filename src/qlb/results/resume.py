"""Makes a run directory that a run left behind, perhaps killed, ready to be gone on with."""

from __future__ import annotations

from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path

from qlb.errors import InputError
from qlb.results import layout
from qlb.results.files import write_text
from qlb.results.run import Run
from qlb.results.statistics import StepCount, count_steps, read_statistics
from qlb.simulation import Simulation


@dataclass(frozen=True)
class Earlier:
    """What is kept of the finished steps."""

    first_step: int
    """steps that lay behind the simulation when the run began"""
    counts: list[StepCount]
    seconds: Mapping[str, float]
    """what the clock had counted (`LoopClock.saved`) [s]"""


def take_up(directory: Path, simulation: Simulation) -> Earlier:
    """Take rows and frames of unfinished steps away, and tell what is left.

    Args:
        directory: a run directory, which this process has locked.
        simulation: set up as it was, and at the checkpoint.

    Raises:
        InputError: a file is missing or damaged, or the simulation is another one; nothing was changed then.
        WriteError: stats.csv could not be written.
    """
    run = Run(directory)
    run.require_same(simulation)
    done = run.checkpoint.steps_done
    if simulation.steps_done != done:
        raise InputError(
            f"run {directory} cannot go on: its checkpoint is of step {done}, the simulation is at step"
            f" {simulation.steps_done}; restore it first"
        )
    frames = [step for step in run.frame_steps if step <= done]
    if not frames:
        raise InputError(f"run {directory} cannot go on: it has no frame up to step {done}, where its checkpoint is")
    _cut_statistics(directory / layout.STATS, done)
    layout.remove_frames_after(directory, done)
    counts = count_steps(read_statistics(directory / layout.STATS))
    return Earlier(frames[0], counts, run.checkpoint.seconds)


def _cut_statistics(path: Path, last: int) -> None:
    """Take the rows of steps after `last` off a stats.csv, and a line that was cut off. Raises `InputError`."""
    read_statistics(path)  # refuses what is damaged
    text = path.read_text(encoding="utf-8")
    header, *rows = text[: text.rfind("\n") + 1].splitlines(keepends=True)
    kept = [row for row in rows if int(row.partition(",")[0]) <= last]
    if header + "".join(kept) != text:
        write_text(path, header + "".join(kept))
