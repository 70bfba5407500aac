"""Singly diagonally implicit Runge-Kutta of order 2 (Alexander 1977)."""

from __future__ import annotations

from math import sqrt
from typing import ClassVar

from qlb.integrators.integrator import Integrator, Stage, State, Steps

A = (2 - sqrt(2)) / 2
W = (1 - A) / A


class SDIRK2(Integrator):
    """Two stages of order 2, L-stable and stiffly accurate (supplement, eqs. 9-12). Both stages share c = a h."""

    name = "SDIRK2"
    order: ClassVar[int] = 2

    def step(self, state: State, h: float) -> Steps:
        """Stage 1 at t + a h from x_k, v_k; stage 2 at t + h from x_k + (1-a) h v_1, v_k + (1-a)/a (v_1 - v_k)."""
        x_k, v_k = state.positions, state.velocities
        first = Stage(state.time + A * h, A * h, ((1.0, x_k),), v_k)
        x_1 = yield first
        v_1 = first.velocity(x_1)  # x_k + (1-a) h v_1 = (1-w) x_k + w x_1, w = (1-a)/a
        second = Stage(state.time + h, A * h, ((1 - W, x_k), (W, x_1)), v_k + W * (v_1 - v_k))
        x = yield second
        return x, second.velocity(x)
