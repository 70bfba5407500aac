from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import qlb
from qlb.mesh import EmbeddedSurface
from qlb.results import Run, RunWriter

STEPS = 4


def two_bodies() -> qlb.Simulation:
    """Two bodies, one with a surface of its own, over a hill that rises, a slope that stands and two planes."""
    box = qlb.TetMesh.box((0.4, 0.1, 0.1), cells=(4, 1, 1))
    shown = np.random.default_rng(1).dirichlet(np.ones(4), size=12)
    skin = EmbeddedSurface.on(box, np.arange(12).reshape(4, 3), np.arange(12) % len(box.tets), shown)
    bodies = [
        qlb.Body(
            box,
            qlb.StableNeoHookean(),
            name="löw body",
            placement=qlb.Placement(translation=(0, 0.004, 0)),
            velocity=(0, 0.1, 0.2),
        ),
        qlb.Body(box.with_surface(skin), qlb.MooneyRivlin(), placement=qlb.Placement(translation=(0, 0.3, 0))),
    ]
    hill = qlb.Obstacle([[0, -0.5, 0], [1, -0.5, 0], [0, -0.5, 1]], [[0, 2, 1]], motion=qlb.Translation((0, 1, 0)))
    slope = qlb.Obstacle([[2, 0, 0], [3, 1, 0], [3, 1, 1], [2, 0, 1]], [[0, 2, 1], [0, 3, 2]], name="slope")
    planes = [qlb.Plane((0, 0, 0), (0, 1, 0)), qlb.Plane((-1, 0, 0), (1, 0, 0), motion=qlb.Translation((1, 0, 0)))]
    return qlb.Simulation(
        bodies, obstacles=[hill, slope, *planes], integrator="SDIRK2", contact=qlb.Contact(dhat=0.01), threads=1
    )


@pytest.fixture(scope="session")
def run(tmp_path_factory: pytest.TempPathFactory) -> Run:
    """A run of `two_bodies` in a folder called "two bodies"; not to be changed."""
    directory = tmp_path_factory.mktemp("runs") / "two bodies"
    simulation = two_bodies()
    with RunWriter(directory, {"scene": "two"}, simulation) as writer:
        for result in simulation.run(STEPS):
            writer.record(result)
    return Run(directory)


@pytest.fixture
def bar(tmp_path: Path) -> Run:
    """A run of one small bar that falls."""
    simulation = qlb.Simulation(qlb.TetMesh.box(cells=(2, 1, 1)), material=qlb.StableNeoHookean(), threads=1)
    with RunWriter(tmp_path / "bar", {}, simulation) as writer:
        for result in simulation.run(3):
            writer.record(result)
    return Run(tmp_path / "bar")


@pytest.fixture
def make_still(tmp_path: Path):
    """Makes a run of a bar over a plane that stands."""

    def make() -> Run:
        body = qlb.Body(
            qlb.TetMesh.box(cells=(2, 1, 1)), qlb.StableNeoHookean(), placement=qlb.Placement(translation=(0, 1, 0))
        )
        simulation = qlb.Simulation(body, obstacles=[qlb.Plane((0, 0, 0), (0, 1, 0))], threads=1)
        with RunWriter(tmp_path / "still", {}, simulation) as writer:
            for result in simulation.run(2):
                writer.record(result)
        return Run(tmp_path / "still")

    return make
