from __future__ import annotations

from collections.abc import Callable
from pathlib import Path
from typing import Any

import pytest

import qlb
from qlb.results import Run, RunWriter

SCENE = {"scene": "bar", "material": {"young": 2e4, "poisson": 0.49}, "mesh": {"cells": [4, 1, 1]}, "steps": 3}

MakeSimulation = Callable[..., qlb.Simulation]
MakeRun = Callable[..., Run]


@pytest.fixture
def make_simulation() -> MakeSimulation:
    """A bar of 24 tets that is held at one end; keyword arguments go to `Simulation`."""

    def make(**arguments: Any) -> qlb.Simulation:
        mesh = qlb.TetMesh.box(cells=(4, 1, 1))
        simulation = qlb.Simulation(mesh, material=qlb.StableNeoHookean(), threads=1, **arguments)
        simulation.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
        return simulation

    return make


@pytest.fixture
def make_run(tmp_path: Path, make_simulation: MakeSimulation) -> MakeRun:
    """A finished run of a few steps in `tmp_path / name`."""

    def make(
        name: str = "run", steps: int = 3, scene: dict[str, Any] = SCENE, stride: int = 1, **arguments: Any
    ) -> Run:
        simulation = make_simulation(**arguments)
        with RunWriter(tmp_path / name, scene, simulation, stride=stride) as writer:
            for result in simulation.run(steps):
                writer.record(result)
        return Run(tmp_path / name)

    return make
