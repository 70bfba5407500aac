"""Contact: what a step costs for each solver, where bodies fall, heap up and are squeezed.

Every case starts from the same state and runs the same steps to the same tolerance. Repeats are interleaved over the
cases, and the fastest of each counts. Counts are per stage, that is per nonlinear solve: SDIRK2 has two in a step.
"""

from __future__ import annotations

from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from math import inf
from pathlib import Path
from time import process_time

import numpy as np

from benchmarks.machine import machine_line, markdown
from benchmarks.step import BEST_ND
from qlb import Body, Contact, Plane, Simulation, SolverSettings, StableNeoHookean, StepFailed, StepResult, TetMesh
from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.scenes import load_scene
from qlb.studies import SolverCase

CASES = (BEST_ND, "QLB:max_iterations=500", "QLA")
DUCKS = 5
SIDE = 0.2
"""of the squeezed block [m]"""
SPEED = 0.05
"""of each plane [m/s], until the block is half as high"""
GAP = 0.0015
"""between block and plane at the start [m]"""
TETS_PER_CELL = 6


@dataclass(frozen=True)
class ContactScene:
    """A scene at a size that the caller chooses."""

    tets: int
    """by default, all bodies together"""
    steps: int
    """by default"""
    what: str
    build: Callable[[int, SolverCase, Path | None], Simulation]
    """from the number of tets, the solver and the mesh file that takes the place of a shape, where there is one"""


def bunny(tets: int, case: SolverCase, mesh: Path | None) -> Simulation:
    """The scene `bunny`, from 0.1 m above the ground."""
    shape = f"mesh.tets={tets}" if mesh is None else f"mesh.path={mesh}"
    return load_scene("bunny", [shape, "drop.height=0.1", *COMMON, *case.overrides]).build()


def ducks(tets: int, case: SolverCase, mesh: Path | None) -> Simulation:
    """The scene `ducks`; `mesh` is the bunny's, and not used."""
    size = [f"count={DUCKS}", f"mesh.tets={tets // DUCKS}"]
    return load_scene("ducks", [*size, *COMMON, *case.overrides]).build()


def squeeze(tets: int, case: SolverCase, mesh: Path | None) -> Simulation:
    """A block between two planes without friction, which close to half its height; no gravity, no damping."""
    cells = max(1, round((tets / TETS_PER_CELL) ** (1 / 3)))
    block = Body(TetMesh.box((SIDE,) * 3, cells=(cells,) * 3), StableNeoHookean(young=2e4, poisson=0.45), name="block")
    low = Plane((0.0, -GAP, 0.0), (0.0, 1.0, 0.0), motion=_closing(1), name="low")
    high = Plane((0.0, SIDE + GAP, 0.0), (0.0, -1.0, 0.0), motion=_closing(-1), name="high")
    scene = load_scene("bar", case.overrides)
    settings: SolverSettings = scene.solver_settings
    return Simulation(
        block,
        obstacles=[low, high],
        solver=scene.solver,
        solver_settings=settings,
        contact=Contact(),
        gravity=(0.0, 0.0, 0.0),
        on_failure="accept",
        threads=1,
    )


def _closing(direction: int) -> Callable[[FloatArray, float], FloatArray]:
    """The motion of a plane towards the other, by a quarter of the block's side in all."""

    def motion(x: FloatArray, time: float) -> FloatArray:
        return np.asarray(x + np.array([0.0, direction * min(SIDE / 4, SPEED * time), 0.0]))

    return motion


COMMON = ("threads=1", "on_failure=accept")
SCENES = {
    "bunny": ContactScene(19000, 60, "dropped from 0.1 m, self-contact, mu = 0.3, SDIRK2", bunny),
    "ducks": ContactScene(20000, 60, f"{DUCKS} that fall on each other, self-contact, mu = 0.3, SDIRK2", ducks),
    "squeeze": ContactScene(20250, 100, "a block between planes that close to half, no friction, BDF2", squeeze),
}


@dataclass
class ContactMeasurement:
    """One run of one case."""

    tets: int
    extent: float
    """longest side of the box around all bodies at the start [m]"""
    cpu: list[float] = field(default_factory=list)
    """CPU seconds of the loop from its start to the end of each step"""
    seconds: dict[str, float] = field(default_factory=dict)
    """wall-clock by part (`qlb.timing.PARTS`)"""
    positions: list[FloatArray] = field(default_factory=list)
    """after each step [m], each (n, 3)"""
    iterations: list[int] = field(default_factory=list)
    """of each solve"""
    factorizations: list[int] = field(default_factory=list)
    """of each solve"""
    failed: int = 0
    """steps that did not converge"""
    distance: float = inf
    """smallest at the end of a solve [m]"""
    contacts: int = 0
    """largest number at the end of a solve"""

    @property
    def steps(self) -> int:
        """How many steps were taken."""
        return len(self.cpu)

    def add(self, result: StepResult, cpu: float) -> None:
        """Take in a step that ended `cpu` seconds after the start of the loop."""
        self.cpu.append(cpu)
        self.positions.append(result.positions)
        self.iterations += [solve.iterations for solve in result.solves]
        self.factorizations += [solve.factorizations for solve in result.solves]
        self.failed += not result.converged
        ends = [solve.rows[-1] for solve in result.solves if solve.rows]
        self.distance = min([self.distance, *(row.minimum_distance for row in ends)])
        self.contacts = max([self.contacts, *(row.contacts for row in ends)])

    def off(self, other: ContactMeasurement) -> float:
        """Largest distance of a node from where `other` has it after the last step of both, over the extent."""
        last = min(self.steps, other.steps) - 1
        if last < 0:
            return inf
        return float(np.linalg.norm(self.positions[last] - other.positions[last], axis=1).max()) / self.extent

    def ratio(self, other: ContactMeasurement) -> float:
        """CPU time over that of `other`, over the steps that both took."""
        last = min(self.steps, other.steps) - 1
        return self.cpu[last] / other.cpu[last] if last >= 0 else inf


def run_case(simulation: Simulation, steps: int, limit: float) -> ContactMeasurement:
    """Run a simulation; no further than the step in which its CPU seconds exceed `limit`, or that is not finite."""
    _ = simulation.solver  # set-up (ordering, analysis) is not part of a step
    mesh = simulation.mesh
    found = ContactMeasurement(len(mesh.tets), float(np.ptp(mesh.positions, axis=0).max()))
    start = process_time()
    try:
        for result in simulation.run(steps):
            found.add(result, process_time() - start)
            if found.cpu[-1] > limit:
                break
    except StepFailed:
        found.failed += 1
    simulation.timer.lap()
    found.seconds = dict(simulation.timer.seconds)
    return found


@dataclass(frozen=True)
class Amount:
    """How much of a scene is measured, and how often."""

    tets: int | None = None
    """by default those of the scene"""
    steps: int | None = None
    """by default those of the scene"""
    mesh: Path | None = None
    """a file in place of a shape"""
    repeats: int = 1
    limit: float = inf
    """CPU seconds after which a run stops"""


def measure(name: str, cases: Sequence[str], amount: Amount) -> dict[str, ContactMeasurement]:
    """The fastest of several runs of each case of a scene."""
    if name not in SCENES:
        raise InputError(f"scene {name!r} is not known: must be one of {', '.join(SCENES)}")
    scene = SCENES[name]
    best: dict[str, ContactMeasurement] = {}
    for _ in range(amount.repeats):
        for case in [SolverCase.parse(case) for case in cases]:
            simulation = scene.build(amount.tets or scene.tets, case, amount.mesh)
            found = run_case(simulation, amount.steps or scene.steps, amount.limit)
            if case.label not in best or found.ratio(best[case.label]) < 1:
                best[case.label] = found
    return best


def table(scenes: Sequence[str], cases: Sequence[str], amount: Amount) -> str:
    """A row for each case of each scene, as Markdown."""
    rows: list[list[str]] = []
    for name in scenes:
        found = measure(name, cases, amount)
        rows += contact_rows(name, found, amount.steps or SCENES[name].steps)
    lines = "; ".join(f"{name}: {SCENES[name].what}, {amount.steps or SCENES[name].steps} steps" for name in scenes)
    title = (
        f"{lines}. h = 10 ms, E = 2e4 Pa, nu = 0.45, |p|_inf <= 1e-2 dhat or 1e-6 |g(x_k)|, best of {amount.repeats}."
    )
    return f"### Solvers in contact\n\n{title} {machine_line(1)}.\n\n{markdown(header(cases), rows)}"


def header(cases: Sequence[str]) -> list[str]:
    """The last case is the one that the others' times are held against; the first, the one for positions."""
    return [
        *("scene", "tets", "solver", "CPU ms", f"over `{cases[-1]}`", "iterations", "factors", "candidates", "contact"),
        *("failed steps", "smallest distance [m]", "most contacts", f"off `{cases[0].split(':')[0]}`, of the extent"),
    ]


def contact_rows(scene: str, found: dict[str, ContactMeasurement], steps: int) -> list[list[str]]:
    """A row for each case: CPU a step, counts a stage, shares of a step, failures, distances, the way to the first."""
    first, last = next(iter(found.values())), list(found.values())[-1]
    rows = []
    for label, m in found.items():
        row = [scene, str(m.tets), f"`{label}`", f"{1e3 * m.cpu[-1] / m.steps:.1f}" if m.cpu else "-"]
        row += [f"{m.ratio(last):.2f}", f"{_mean(m.iterations):.1f}", f"{_mean(m.factorizations):.2f}"]
        row += [f"{100 * m.seconds[part] / sum(m.seconds.values()):.0f} %" for part in ("candidates", "contact")]
        row.append(f"{m.failed}" + (f", stopped after {m.steps}" if m.steps < steps else ""))
        rows.append([*row, f"{m.distance:.1e}", str(m.contacts), f"{m.off(first):.0e}"])
    return rows


def _mean(values: Sequence[int]) -> float:
    return float(np.mean(values)) if values else 0.0
