"""Backward differentiation formulas (Hairer, Lubich, Wanner 2006)."""

from __future__ import annotations

from typing import ClassVar

from qlb.integrators.integrator import Integrator, Stage, State, Steps
from qlb.integrators.sdirk2 import SDIRK2


class BDF1(Integrator):
    """Backward Euler, of order 1 (supplement, eqs. 1-4)."""

    name = "BDF1"
    order: ClassVar[int] = 1

    def step(self, state: State, h: float) -> Steps:
        """One stage: c = h, x_b = x_k, v_b = v_k."""
        stage = Stage(state.time + h, h, ((1.0, state.positions),), state.velocities)
        x = yield stage
        return x, stage.velocity(x)


class BDF2(Integrator):
    """The two-step formula, of order 2 (supplement, eqs. 7-8).

    Its first step is one step of SDIRK2, which keeps the order (Nishikawa 2019 on BDF2's start-up error).
    """

    name = "BDF2"
    order: ClassVar[int] = 2

    def step(self, state: State, h: float) -> Steps:
        """One stage: c = 2h/3, x_b = (4 x_k - x_{k-1})/3, v_b = (4 v_k - v_{k-1})/3."""
        if state.previous is None:
            return (yield from self.one_step_method().step(state, h))
        last = state.previous
        base = ((4 / 3, state.positions), (-1 / 3, last.positions))
        v_b = (4 * state.velocities - last.velocities) / 3
        stage = Stage(state.time + h, 2 * h / 3, base, v_b)
        x = yield stage
        return x, stage.velocity(x)

    def one_step_method(self) -> Integrator:
        """SDIRK2, of the same order."""
        return SDIRK2()
