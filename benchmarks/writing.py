"""What it costs to keep every step of the falling bar: a frame, a checkpoint and rows of statistics each.

Writing is timed by itself, within the run that it belongs to. Its share is of that run, writing included, and the
median of the repeats counts.
"""

from __future__ import annotations

import tempfile
from collections.abc import Sequence
from pathlib import Path
from time import perf_counter, process_time
from typing import NamedTuple

import numpy as np

from benchmarks.machine import machine_line, markdown
from benchmarks.step import CELLS
from qlb.results import RunWriter
from qlb.results.layout import frame_path
from qlb.scenes import load_scene

CASES = {"as it is": (), "float32": ("output.precision=float32",), "every tenth step": ("output.stride=10",)}
"""Settings of the scene, by how the table calls them."""
HEADER = ["tets", "frames", "MB a frame", "step CPU ms", "writing CPU ms", "writing wall ms", "of CPU", "of wall"]


class Cost(NamedTuple):
    """Of a whole run: seconds [s] and bytes."""

    cpu: float
    """writing included"""
    wall: float
    """writing included"""
    writing_cpu: float
    writing_wall: float
    size: float
    """of the last frame"""


def run_once(overrides: Sequence[str], steps: int) -> Cost:
    """Run the bar and keep it in a temporary folder (`$TMPDIR` says where)."""
    scene = load_scene("bar", [f"steps={steps}", *overrides])
    simulation = scene.build()
    with tempfile.TemporaryDirectory() as folder:
        directory = Path(folder) / "run"
        writer = RunWriter(directory, scene.model_dump(mode="json"), simulation, **scene.output.model_dump())
        writing = np.zeros(2)
        start = _clocks()
        for _ in range(steps):
            result = simulation.advance()
            before = _clocks()
            writer.record(result)
            writing += _clocks() - before
        cpu, wall = _clocks() - start
        writer.finish("complete")
        size = frame_path(directory, steps).stat().st_size
    return Cost(cpu, wall, writing[0], writing[1], size)


def _clocks() -> np.ndarray[tuple[int], np.dtype[np.float64]]:
    return np.array([process_time(), perf_counter()])


def table(sizes: Sequence[int], *, steps: int = 40, threads: int = 1, repeats: int = 3) -> str:
    """The cost of writing for each size and kind of frames, as Markdown."""
    rows = []
    for tets in sizes:
        costs: dict[str, list[Cost]] = {name: [] for name in CASES}
        for _ in range(repeats):
            for name, settings in CASES.items():
                overrides = [f"mesh.cells={CELLS[tets]}", f"threads={threads}", *settings]
                costs[name].append(run_once(overrides, steps))
        rows += [cost_row(str(tets), name, of_case, steps) for name, of_case in costs.items()]
    title = f"Bar, drop, {steps} steps of the default scene, median of {repeats}."
    return f"### Writing\n\n{title} {machine_line(threads)}.\n\n{markdown(HEADER, rows)}"


def cost_row(tets: str, name: str, costs: Sequence[Cost], steps: int) -> list[str]:
    """Medians over repeats: each share is of its own repeat."""
    cpu, wall, writing_cpu, writing_wall, size = np.array(costs).T
    numbers = [f"{np.median(1e3 * a / steps):.2f}" for a in (cpu - writing_cpu, writing_cpu, writing_wall)]
    shares = [f"{100 * np.median(a):.1f} %" for a in (writing_cpu / cpu, writing_wall / wall)]
    return [tets, name, f"{np.median(size) / 1e6:.2f}", *numbers, *shares]
