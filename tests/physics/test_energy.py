"""Energy of a bar that swings without damping."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

from qlb import Damping, Simulation, StableNeoHookean, TetMesh, Tolerance
from tests.support import Array, left_end, mechanical_energy

STEPS = 150


def swinging(integrator: str, **arguments: object) -> Simulation:
    mesh = TetMesh.box((1.0, 0.25, 0.25), cells=(8, 2, 2))
    material = StableNeoHookean(young=1e5, poisson=0.4)
    simulation = Simulation(
        mesh,
        material=material,
        integrator=integrator,
        tolerance=Tolerance(relative=1e-8),
        threads=1,
        **arguments,  # type: ignore[arg-type]
    )
    simulation.pin(left_end(mesh))
    return simulation


@cache
def energies(integrator: str) -> Array:
    """Total energy after each step [J], zero at the start, in units of the largest elastic energy of the swing."""
    simulation = swinging(integrator)
    total, elastic = [0.0], [0.0]
    for result in simulation.run(STEPS):
        total.append(mechanical_energy(simulation))
        elastic.append(simulation.system.elastic.value(result.positions))
    return np.array(total) / max(elastic)


def test_the_better_integrator_loses_less_energy() -> None:
    # 24 %, 0.7 % and 0.04 % when written
    lost = {name: -energies(name)[-1] for name in ("BDF1", "BDF2", "SDIRK2")}
    assert lost["BDF1"] > 10 * lost["BDF2"] > 50 * lost["SDIRK2"] > 0, lost


@pytest.mark.parametrize(("integrator", "most"), [("BDF1", 0.4), ("BDF2", 0.01), ("SDIRK2", 0.001)])
def test_the_loss_is_of_the_size_of_the_truncation_error(integrator: str, most: float) -> None:
    assert 0 < -energies(integrator)[-1] < most


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_energy_is_never_gained(integrator: str) -> None:
    # But for the solver's tolerance and for what one step of BDF2 can give back.
    assert energies(integrator).max() <= 1e-5


def test_damping_takes_energy() -> None:
    free, damped = swinging("SDIRK2"), swinging("SDIRK2", damping=Damping(mass=2.0))
    for simulation in (free, damped):
        for _ in simulation.run(50):
            pass
    # The falling bar has given up a good part of m g dy by then; what is missing is what damping took.
    assert mechanical_energy(damped) < mechanical_energy(free) - 0.1 * damped.system.elastic.value(free.state.positions)
