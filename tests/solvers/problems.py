"""Stage problems for the solvers, and some that misbehave on purpose."""

from __future__ import annotations

import numpy as np

from qlb import SolverSettings, StableNeoHookean, State, TetMesh, Tolerance
from qlb.integrators import INTEGRATORS
from qlb.solvers import SOLVERS, Descent
from qlb.system import HeldNodes, StageProblem, System
from qlb.timing import Timer
from tests.support import Array, left_end, make_system, small_bar


def bar_system(
    cells: tuple[int, int, int] = (4, 2, 2),
    *,
    poisson: float = 0.4,
    gravity: tuple[float, float, float] = (0.0, -9.81, 0.0),
) -> System:
    mesh = small_bar(cells)
    held = HeldNodes(len(mesh.positions))
    held.hold(left_end(mesh), mesh.positions)
    return make_system(mesh, StableNeoHookean(poisson=poisson), held=held, gravity=gravity)


def swinging(system: System, time: float = 0.0) -> State:
    """The bar at rest with a speed that grows along it."""
    x = system.mesh.positions
    v = np.zeros_like(x)
    v[:, 1] = -3.0 * x[:, 0]
    return State(time, x, v)


def crushed(system: System, rng: np.random.Generator, amount: float = 0.06) -> State:
    """The bar with its free nodes moved so far that many tets are inverted."""
    x = system.mesh.positions + amount * rng.normal(size=system.mesh.positions.shape)
    return State(0.0, x, np.zeros_like(x))


def problem_of(
    system: System, state: State, *, h: float = 0.05, integrator: str = "BDF1", kind: type[StageProblem] = StageProblem
) -> StageProblem:
    """The first stage of a step of `h` from `state`."""
    stage = next(INTEGRATORS[integrator]().step(state, h))
    return kind(system, stage, state, Timer())


def make_solver(name: str, system: System, tolerance: Tolerance | None = None, **settings: object) -> Descent:
    return SOLVERS[name](system, SolverSettings(**settings), tolerance or Tolerance())  # type: ignore[arg-type]


class WrongGradient(StageProblem):
    """Gives minus the gradient: every direction that looks downhill leads up."""

    def value_gradient(self, x: Array) -> tuple[float, Array]:
        energy, gradient = super().value_gradient(x)
        return energy, -gradient


class NoPrediction(StageProblem):
    """Its predictor gives nothing usable."""

    @property
    def predictor(self) -> Array:
        return np.full_like(self.start, np.nan)


def fixed_state(mesh: TetMesh) -> State:
    return State(0.0, mesh.positions, np.zeros_like(mesh.positions))
