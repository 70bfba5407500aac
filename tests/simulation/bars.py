"""The bar that the tests of the time loop run."""

from __future__ import annotations

import numpy as np

from qlb import Rotation, Simulation, StableNeoHookean
from tests.support import Array, left_end, right_end, small_bar

MESH = small_bar((4, 2, 2))
TWIST = Rotation(axis=(1.0, 0.0, 0.0), origin=(0.75, 0.125, 0.125), rate=0.5)


def growing(time: float) -> Array:
    """A load for quasistatics, where a constant one would change nothing after the first step."""
    return np.array([0.0, -30.0 * time, 0.0])


def bar(*, twist: bool = False, **arguments: object) -> Simulation:
    quasistatic = arguments.get("integrator") == "quasistatic"
    defaults: dict[str, object] = {
        "material": StableNeoHookean(young=2e4, poisson=0.45),
        "gravity": growing if quasistatic else (0.0, -9.81, 0.0),
        "threads": 1,
    }
    simulation = Simulation(MESH, **(defaults | arguments))  # type: ignore[arg-type]
    simulation.pin(left_end(MESH))
    if twist:
        simulation.move(right_end(MESH), TWIST)
    return simulation
