"""Where the time of a step goes, for each solver, on the drop or twist bar.

Every case starts from the same state, runs the same steps to the same tolerance, and its final state is held against
that of the first case. Repeats are interleaved over the cases, and the fastest repeat of each counts, so that a slow
spell of the machine does not fall on one case alone.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from time import process_time

import numpy as np

from benchmarks.machine import machine_line, markdown
from qlb import Simulation
from qlb.arrays import FloatArray
from qlb.scenes import load_scene
from qlb.studies import SolverCase
from qlb.timing import PARTS

CELLS = {1536: "16,4,4", 5184: "24,6,6", 12288: "32,8,8", 53742: "53,13,13", 192000: "80,20,20"}
BEST_ND = "ND:projection=on-demand:initial_guess=predictor"
CASES = ("ND:cholesky=cholmod", "ND", BEST_ND, "QLB:cholesky=cholmod", "QLB", "QLA")
ABLATION = (
    "QLA",
    "QLA:precision=float32",
    "QLA:precision=float64",
    "QLA:cholesky=cholmod",
    "QLA:keep_factor=false",
    "QLA:carry_factor=false",
    "QLA:refactor_in_solve=false",
    "QLA:initial_guess=previous",
    "QLA:projection=always",
    "QLA:window=5",
)
"""QLA, and with each ingredient off."""


@dataclass
class Measurement:
    """The fastest of several repeats of one case."""

    cpu: float = float("inf")
    seconds: dict[str, float] = field(default_factory=dict)
    iterations: float = 0.0
    factorizations: float = 0.0
    failed: int = 0
    positions: FloatArray | None = None


Build = Callable[[Sequence[str]], Simulation]
"""A simulation from settings of a scene, KEY=VALUE."""


def bar(overrides: Sequence[str]) -> Simulation:
    """The bar."""
    return load_scene("bar", overrides).build()


def run_case(build: Build, case: SolverCase, overrides: Sequence[str], steps: int, best: Measurement) -> None:
    """Run one case once; keep it if it is the fastest so far."""
    simulation = build(["on_failure=accept", f"steps={steps}", *overrides, *case.overrides])
    _ = simulation.solver  # set-up (ordering, analysis) is not part of a step
    start = process_time()
    results = list(simulation.run(steps))
    cpu = process_time() - start
    if cpu < best.cpu:
        simulation.timer.lap()
        best.cpu = cpu
        best.seconds = dict(simulation.timer.seconds)
        best.iterations = float(np.mean([r.iterations for r in results]))
        best.factorizations = float(np.mean([r.factorizations for r in results]))
        best.failed = sum(not r.converged for r in results)
        best.positions = results[-1].positions


def measure(
    cases: Sequence[str], overrides: Sequence[str], *, steps: int, repeats: int, build: Build = bar
) -> dict[str, Measurement]:
    """Measure every case of a scene with `overrides` (KEY=VALUE)."""
    parsed = [SolverCase.parse(case) for case in cases]
    found = {case.label: Measurement() for case in parsed}
    for _ in range(repeats):
        for case in parsed:
            run_case(build, case, overrides, steps, found[case.label])
    return found


def table(
    sizes: list[int],
    cases: Sequence[str],
    *,
    variant: str = "drop",
    steps: int = 20,
    threads: int = 1,
    repeats: int = 3,
) -> str:
    """The split of a step for each size and case, as Markdown."""
    rows: list[list[str]] = []
    for tets in sizes:
        overrides = [f"mesh.cells={CELLS[tets]}", f"variant={variant}", f"threads={threads}"]
        found = measure(cases, overrides, steps=steps, repeats=repeats)
        rows += split_rows(str(tets), found, steps)
    title = f"Bar, {variant}, {steps} steps of the default scene, tolerance 1e-6 relative, best of {repeats}."
    return f"### Split of a step\n\n{title} {machine_line(threads)}.\n\n{markdown(HEADER, rows)}"


HEADER = [
    *("tets", "solver", "iterations", "factors", *(f"{part} ms" for part in PARTS), "CPU ms", "CPU ratio"),
    *("Python", "final state off [m]"),
]


def split_rows(tets: str, found: dict[str, Measurement], steps: int) -> list[list[str]]:
    """A row for each case: its counts, its milliseconds a step by part, its ratio to the first case."""
    first = next(iter(found.values()))
    assert first.positions is not None
    rows = []
    for label, m in found.items():
        assert m.positions is not None
        row = [tets, f"`{label}`", f"{m.iterations:.1f}", f"{m.factorizations:.2f}"]
        row += [f"{1e3 * m.seconds[part] / steps:.2f}" for part in PARTS]
        row += [f"{1e3 * m.cpu / steps:.2f}", f"{m.cpu / first.cpu:.2f}"]
        off = f"{np.abs(m.positions - first.positions).max():.0e}" + (f", {m.failed} failed" if m.failed else "")
        rows.append([*row, f"{100 * m.seconds['other'] / sum(m.seconds.values()):.1f} %", off])
    return rows
