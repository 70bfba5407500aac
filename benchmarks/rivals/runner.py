"""Run the packages that are installed on the same problem, in turns, each in a process of its own, and print tables."""

from __future__ import annotations

import json
import os
import subprocess
import sys
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from pathlib import Path
from tempfile import TemporaryDirectory

import numpy as np

import qlb
from benchmarks.machine import machine_line, markdown
from benchmarks.rivals.problem import FloatArray, Problem
from benchmarks.rivals.registry import ACCURATE, DISTRIBUTIONS, REFERENCE, RIVALS, Rival
from benchmarks.step import CELLS

ROOT = Path(__file__).parents[2]
MOST_RAISES = 10
# The limit is for CHOLMOD 3, whose regions ask for four threads each; it would be slower with them.
THREADS = ("OMP_NUM_THREADS", "OMP_THREAD_LIMIT", "MKL_NUM_THREADS", "OPENBLAS_NUM_THREADS")
PROBE = """
import importlib.metadata as m, importlib.util as u, json, sys
names = json.loads(sys.argv[1])
print(json.dumps({k: m.version(d) for k, d in names.items() if u.find_spec(k)}))
"""


@dataclass(frozen=True)
class Settings:
    """What all runs of a table share."""

    python: str = sys.executable
    """the interpreter that has the rivals"""
    integrator: str = "BDF1"
    steps: int = 20
    repeats: int = 3
    threads: int = 1
    limit: float = 1200.0
    """seconds that one run may take, set-up and warm-up included"""


@dataclass
class Outcome:
    """The best of the runs of one rival."""

    rival: Rival
    cpu: float = float("inf")
    wall: float = float("inf")
    iterations: float = 0.0
    error: float = float("nan")
    settings: str = ""
    failure: str = ""


def bar(cells: tuple[int, int, int], *, log: bool, integrator: str, relative: float = 1e-6) -> Problem:
    """The default scene's bar, E = 2e4 Pa and nu = 0.49 at small strains under either density."""
    mesh = qlb.TetMesh.box(cells=cells)
    material = qlb.StableNeoHookean(young=2e4, poisson=0.49)
    lame_mu, lame_lam = (float(value) for value in material.lame())
    mu, lam = (float(value) for value in material.kernel_parameters())
    return Problem(
        positions=np.array(mesh.positions),
        tets=mesh.tets.astype(np.int64),
        fixed=mesh.positions[:, 0] < 1e-9,
        log=log,
        mu=mu if log else lame_mu,
        lam=lam if log else lame_lam + lame_mu,
        density=1000.0,
        gravity=np.array([0.0, -9.81, 0.0]),
        step=1e-2,
        integrator=integrator,
        relative=relative,
    )


def distance(found: FloatArray, reference: FloatArray, problem: Problem) -> float:
    """The largest distance of a node from the reference, over the longest side of the body."""
    return float(np.linalg.norm(found - reference, axis=1).max()) / problem.extent()


class Bench:
    """One problem in a folder, its reference, and the runs on it."""

    def __init__(self, problem: Problem, settings: Settings, folder: Path) -> None:
        self.problem, self.settings, self.folder = problem, settings, folder
        problem.save(folder / "problem.npz")
        replace(problem, relative=1e-11).save(folder / "tight.npz")
        outcome, positions = self._run(REFERENCE, "tight.npz")
        if positions is None:
            raise RuntimeError(f"no reference: {outcome.failure}")
        self.reference = positions

    def run(self, rival: Rival) -> Outcome:
        """Once."""
        outcome, positions = self._run(rival, "problem.npz")
        if positions is not None:
            outcome.error = distance(positions, self.reference, self.problem)
        return outcome

    def tuned(self, rival: Rival) -> Rival:
        """With its option raised by half until it is accurate, or as often as is reasonable."""
        for _ in range(MOST_RAISES if rival.raised else 0):
            outcome = self.run(rival)
            if outcome.failure or outcome.error <= ACCURATE:
                break
            value = str(3 * int(rival.options[rival.raised]) // 2)
            rival = replace(rival, options={**rival.options, rival.raised: value})
        return rival

    def _run(self, rival: Rival, problem: str) -> tuple[Outcome, FloatArray | None]:
        python = sys.executable if rival.is_qlb else self.settings.python
        out, count = self.folder / "out.json", str(self.settings.threads)
        options = [f"{key}={value}" for key, value in rival.options.items()]
        worker = [python, "-W", "ignore", "-m", "benchmarks.rivals.worker"]
        command = [*worker, rival.module, str(self.folder / problem), str(self.settings.steps), str(out), *options]
        threads = dict.fromkeys(THREADS, count)
        path = os.pathsep.join([str(Path(python).parent), os.environ.get("PATH", "")])
        limit, environment = self.settings.limit, os.environ | threads | {"PATH": path}
        try:
            done = subprocess.run(command, cwd=ROOT, env=environment, capture_output=True, text=True, timeout=limit)
        except subprocess.TimeoutExpired:
            return Outcome(rival, failure=f"did not finish in {limit:g} s"), None
        if done.returncode:
            return Outcome(rival, failure=(done.stderr.strip().splitlines() or ["no message"])[-1]), None
        return Outcome(rival, **json.loads(out.read_text())), np.load(out.with_suffix(".npy"))


def measure(problem: Problem, rivals: Sequence[Rival], settings: Settings) -> list[Outcome]:
    """The best of several runs of each, in turns, so that a slow spell of the machine does not fall on one alone."""
    with TemporaryDirectory() as folder:
        bench = Bench(problem, settings, Path(folder))
        best = [Outcome(bench.tuned(rival)) for rival in rivals]
        for _ in range(settings.repeats):
            for i, outcome in enumerate(best):
                if not outcome.failure:
                    new = bench.run(outcome.rival)
                    best[i] = new if new.failure or new.cpu < outcome.cpu else outcome
        return best


def installed(python: str) -> dict[str, str]:
    """Versions of the rivals' distributions that this interpreter has, by module."""
    command = [python, "-c", PROBE, json.dumps(DISTRIBUTIONS)]
    done = subprocess.run(command, capture_output=True, text=True, check=True)
    versions: dict[str, str] = json.loads(done.stdout)
    return versions


def chosen(only: Sequence[str], settings: Settings, versions: Mapping[str, str]) -> tuple[list[Rival], list[Rival]]:
    """The rivals that were asked for: those that can run, and those whose packages are missing. qlb always runs."""
    asked = [r for r in RIVALS if r.is_qlb or not only or r.name in only]
    asked = [r for r in asked if settings.integrator in r.integrators]
    ready = [r for r in asked if all(name in versions for name in r.imports)]
    return ready, [r for r in asked if r not in ready]


def table(sizes: Sequence[int], only: Sequence[str], settings: Settings) -> str:
    """A table for each density, as Markdown."""
    versions = installed(settings.python)
    ready, missing = chosen(only, settings, versions)
    parts = [_title(settings, versions)]
    for log in (True, False):
        rivals = [rival for rival in ready if rival.log == log]
        if all(rival.is_qlb for rival in rivals) and not (log and len(ready) == 4):
            continue
        rows = []
        for tets in sizes:
            nx, ny, nz = map(int, CELLS[tets].split(","))
            problem = bar((nx, ny, nz), log=log, integrator=settings.integrator)
            rows += rows_of(tets, measure(problem, rivals, settings), settings.steps)
        density = "Eq. 14, with the logarithm" if log else "Without the logarithm"
        header = ["tets", "package", "settings", "iterations", "wall ms", "CPU ms", "CPU, QLA = 1", "error"]
        parts.append(f"{density}, {settings.integrator}:\n\n{markdown(header, rows)}")
    parts += [f"`{rival.name}` did not run: pip install -r benchmarks/rivals/requirements.txt" for rival in missing]
    return "\n\n".join(parts)


def rows_of(tets: int, outcomes: Sequence[Outcome], steps: int) -> list[list[str]]:
    """The rows of one size; CPU time is held against the first outcome's."""
    rows = []
    for outcome in outcomes:
        row = [f"{tets}", f"`{outcome.rival.name}`"]
        if outcome.failure:
            rows.append([*row, f"failed: {outcome.failure}", *[""] * 5])
            continue
        times = [f"{1e3 * seconds / steps:.2f}" for seconds in (outcome.wall, outcome.cpu)]
        ratio = f"{outcome.cpu / outcomes[0].cpu:.1f}"
        rows.append([*row, outcome.settings, f"{outcome.iterations:.1f}", *times, ratio, f"{outcome.error:.0e}"])
    return rows


def _title(settings: Settings, versions: Mapping[str, str]) -> str:
    packages = ", ".join(f"{DISTRIBUTIONS[module]} {version}" for module, version in versions.items())
    what = f"Bar, drop, {settings.steps} steps, {settings.integrator}, |g| <= 1e-6 |g(x_k)|, best of {settings.repeats}"
    return f"### Other packages\n\n{what}. {machine_line(settings.threads)}; rivals under {packages}."
