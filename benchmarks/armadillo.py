"""A real mesh: the armadillo, feet held, pulled by its hands."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path

import numpy as np

from benchmarks.machine import machine_line, markdown
from benchmarks.step import HEADER, measure, split_rows
from qlb import Simulation, TetMesh, Translation
from qlb.scenes import load_scene


def table(path: Path, cases: Sequence[str], *, steps: int, threads: int, repeats: int) -> str:
    """The split of a step for each case, as Markdown."""
    given = TetMesh.read(path)
    mesh = TetMesh(given.positions / np.ptp(given.positions[:, 1]), given.tets)  # 1 m tall

    def build(overrides: Sequence[str]) -> Simulation:
        return pulled(mesh, overrides)

    found = measure(cases, [f"threads={threads}"], steps=steps, repeats=repeats, build=build)
    title = f"Armadillo, {steps} steps, E = 2e4 Pa, nu = 0.49, h = 10 ms, BDF2, hands pulled apart at 1 m/s each."
    rows = split_rows(str(len(mesh.tets)), found, steps)
    return f"### Armadillo\n\n{title} Best of {repeats}. {machine_line(threads)}.\n\n{markdown(HEADER, rows)}"


def pulled(mesh: TetMesh, overrides: Sequence[str]) -> Simulation:
    """The lowest twentieth of the body held, its ends along x moved outwards."""
    scene = load_scene("bar", overrides)
    simulation = Simulation(mesh, **scene.simulation_arguments() | scene.composition())
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    margin = 0.04 * (high - low)
    simulation.pin(mesh.nodes_where(lambda x: x[:, 1] < low[1] + margin[1]))
    simulation.move(mesh.nodes_where(lambda x: x[:, 0] < low[0] + margin[0]), Translation((-1.0, 0.0, 0.0)))
    simulation.move(mesh.nodes_where(lambda x: x[:, 0] > high[0] - margin[0]), Translation((1.0, 0.0, 0.0)))
    return simulation
