"""A sequence of equilibria under loads and held nodes that change with time."""

from __future__ import annotations

from typing import ClassVar

from qlb.integrators.integrator import Integrator, Stage, State, Steps


class Quasistatic(Integrator):
    """f(x) = 0 at each time (supplement, eqs. 5-6): no inertia, no damping."""

    name = "quasistatic"
    order: ClassVar[int] = 0

    def step(self, state: State, h: float) -> Steps:
        """One stage without inertia; the velocity returned is the mean over the step."""
        stage = Stage(state.time + h, h, ((1.0, state.positions),), state.velocities, inertial=False)
        x = yield stage
        return x, stage.velocity(x)
