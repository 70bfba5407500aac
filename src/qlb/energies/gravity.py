"""Gravity."""

from __future__ import annotations

from collections.abc import Callable

from qlb.arrays import FloatArray, vectors
from qlb.energies.potential import DeadLoad
from qlb.integrators.integrator import Stage

Acceleration = tuple[float, float, float] | Callable[[float], FloatArray]
"""[m/s^2], constant or a function of time [s]."""


class Gravity:
    """The weight of every node: its share of the mass [kg] times an acceleration."""

    lagged = False

    def __init__(self, mass: FloatArray, acceleration: Acceleration, rest: FloatArray, threads: int) -> None:
        self._mass, self._acceleration, self._rest, self._threads = mass, acceleration, rest, threads
        self._constant = None if callable(acceleration) else DeadLoad(self.forces(0.0), rest, threads)

    def forces(self, time: float) -> FloatArray:
        """Forces on the nodes [N] at `time` [s], shape (n, 3)."""
        return self._mass[:, None] * self.acceleration(time)

    def acceleration(self, time: float) -> FloatArray:
        """[m/s^2] at `time` [s], shape (3,)."""
        a = self._acceleration(time) if callable(self._acceleration) else self._acceleration
        return vectors("gravity", a, (3,))

    def at(self, stage: Stage, guess: FloatArray) -> DeadLoad:
        """A dead load at the stage's time."""
        return self._constant or DeadLoad(self.forces(stage.time), self._rest, self._threads)
