"""States, stages, and what an integrator is."""

from __future__ import annotations

from abc import ABC, abstractmethod
from collections.abc import Generator
from dataclasses import dataclass
from functools import cached_property
from typing import ClassVar

from qlb.arrays import FloatArray


@dataclass(frozen=True)
class State:
    """Positions and velocities at a time, and the state one step earlier where there is one.

    Rows are the nodes of the system: n of the bodies, then q of the obstacles.
    """

    time: float
    """[s]"""
    positions: FloatArray
    """[m], shape (n + q, 3)"""
    velocities: FloatArray
    """[m/s], shape (n + q, 3)"""
    previous: State | None = None

    def without_history(self) -> State:
        """The same state with no previous one."""
        return State(self.time, self.positions, self.velocities)


@dataclass(frozen=True)
class Origin:
    """Positions that a solve comes from, known to be free of intersections, and when everything was there."""

    positions: FloatArray
    """[m], shape (n, 3), obstacles included"""
    time: float
    """[s]"""


@dataclass(frozen=True)
class Stage:
    """One implicit stage: find x with M (x - x_b - c v_b) = c^2 f(x, (x - x_b)/c)."""

    time: float
    """Where the loads and the held nodes are taken [s]."""
    c: float
    """[s]"""
    base: tuple[tuple[float, FloatArray], ...]
    """x_b as a combination of positions that were: weights, and positions [m] of shape (n, 3)."""
    v_b: FloatArray
    """[m/s], shape (n, 3)"""
    inertial: bool = True
    """False in quasistatics, where the stage is f(x) = 0."""

    @cached_property
    def x_b(self) -> FloatArray:
        """[m], shape (n, 3)"""
        weight, first = self.base[0]
        x_b = first if weight == 1 else weight * first
        for weight, positions in self.base[1:]:
            x_b = x_b + weight * positions
        return x_b

    def velocity(self, x: FloatArray) -> FloatArray:
        """v = (x - x_b)/c [m/s]."""
        return (x - self.x_b) / self.c


Steps = Generator[Stage, FloatArray, tuple[FloatArray, FloatArray]]
"""Yields each stage of a step, is sent the positions that solve it, returns positions and velocities at the end."""


class Integrator(ABC):
    """A time integrator; it knows no energy and no solver."""

    name: str

    order: ClassVar[int]
    """Of positions and velocities; 0 where nothing has a velocity of its own. The tests hold it to that."""

    @abstractmethod
    def step(self, state: State, h: float) -> Steps:
        """The stages of one step of `h` [s] from `state`."""

    def one_step_method(self) -> Integrator:
        """An integrator of the same order that needs no earlier state: for starting, and for steps cut in half."""
        return self
