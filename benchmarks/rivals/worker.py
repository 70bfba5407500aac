"""`python -m benchmarks.rivals.worker MODULE PROBLEM STEPS OUT [KEY=VALUE ...]`: one run in a process of its own."""

from __future__ import annotations

import json
import os
import sys
from importlib import import_module
from pathlib import Path
from time import perf_counter, process_time

import numpy as np

from benchmarks.rivals.problem import Problem, Simulation

WARM_UP_STEPS = 2


def main(arguments: list[str]) -> None:
    """Set up twice: once to warm up what is compiled or loaded on first use, once to be timed."""
    module, path, steps, out, *pairs = arguments
    _pin(int(os.environ.get("OMP_NUM_THREADS", "1")))
    options = dict(pair.split("=", 1) for pair in pairs)
    problem, build = Problem.load(Path(path)), import_module(f"benchmarks.rivals.{module}").build
    warm_up: Simulation = build(problem, options)
    for _ in range(min(int(steps), WARM_UP_STEPS)):
        warm_up.step()
    del warm_up
    simulation: Simulation = build(problem, options)
    wall, cpu = perf_counter(), process_time()
    iterations = sum(simulation.step() for _ in range(int(steps)))
    cpu, wall = process_time() - cpu, perf_counter() - wall
    np.save(Path(out).with_suffix(".npy"), simulation.positions())
    row = {"cpu": cpu, "wall": wall, "iterations": iterations / int(steps), "settings": simulation.settings}
    Path(out).write_text(json.dumps(row))


def _pin(count: int) -> None:
    """To as many CPUs as there are threads to be, for the packages that take what they find."""
    if hasattr(os, "sched_setaffinity"):
        os.sched_setaffinity(0, sorted(os.sched_getaffinity(0))[-count:])


if __name__ == "__main__":
    main(sys.argv[1:])
