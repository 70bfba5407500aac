"""The same input gives the same bits, in one go or in pieces."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Simulation, SolverSettings, State
from qlb.integrators import INTEGRATORS
from qlb.solvers import SOLVERS
from tests.simulation.bars import bar
from tests.support import finish


@pytest.fixture(params=INTEGRATORS)
def integrator(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(params=SOLVERS)
def solver(request: pytest.FixtureRequest) -> str:
    return request.param


def copy_of(state: State) -> State:
    """The state as a file would give it back: new arrays, one state of history."""
    previous = None if state.previous is None else copy_of(state.previous.without_history())
    return State(state.time, state.positions.copy(), state.velocities.copy(), previous)


def resumed(simulation: Simulation, fresh: Simulation) -> Simulation:
    """`fresh`, made from the same arguments, at the state of `simulation`."""
    saved = {name: array.copy() for name, array in simulation.solver.save().items()}
    fresh.restore(copy_of(simulation.state), simulation.steps_done, saved)
    return fresh


def assert_same_bits(a: State, b: State) -> None:
    assert a.time == b.time
    np.testing.assert_array_equal(a.positions, b.positions)
    np.testing.assert_array_equal(a.velocities, b.velocities)


@pytest.mark.parametrize("guess", ["previous", "predictor"])
@pytest.mark.parametrize("cut", [1, 4])
@pytest.mark.parametrize("twist", [False, True], ids=["drop", "twist"])
def test_a_run_cut_in_two_gives_the_same_bits(integrator: str, solver: str, cut: int, twist: bool, guess: str) -> None:
    settings = SolverSettings(initial_guess=guess, max_iterations=3000)  # type: ignore[arg-type]

    def make() -> Simulation:
        return bar(twist=twist, integrator=integrator, solver=solver, solver_settings=settings)

    whole, first = make(), make()
    finish(whole, 7)
    finish(first, cut)
    second = resumed(first, make())
    results = list(second.run(7 - cut))
    assert [result.step for result in results] == list(range(cut + 1, 8))
    assert_same_bits(second.state, whole.state)


def test_the_same_run_twice_gives_the_same_bits(integrator: str, solver: str) -> None:
    runs = []
    for _ in range(2):
        simulation = bar(integrator=integrator, solver=solver, solver_settings=SolverSettings(max_iterations=3000))
        rows = [row for result in simulation.run(6) for solve in result.solves for row in solve.rows]
        runs.append((simulation.state, [(row.residual, row.energy, row.step_length) for row in rows]))
    assert_same_bits(runs[0][0], runs[1][0])
    assert runs[0][1] == runs[1][1]


def test_two_simulations_side_by_side_do_not_disturb_each_other(solver: str) -> None:
    alone = bar(solver=solver)
    finish(alone, 4)
    pair = bar(solver=solver), bar(solver=solver, step=0.02, twist=True)
    for _ in range(4):
        for simulation in pair:
            simulation.advance()
    assert_same_bits(pair[0].state, alone.state)


def test_a_run_with_cut_steps_resumes_to_the_same_bits(solver: str) -> None:
    def make() -> Simulation:
        few = SolverSettings(max_iterations=5)
        return bar(integrator="BDF2", solver=solver, step=0.1, on_failure="halve", solver_settings=few)

    whole, first = make(), make()
    parts = [result.parts for result in whole.run(5)]
    assert max(parts) > 1
    finish(first, 3)
    second = resumed(first, make())
    finish(second, 2)
    assert_same_bits(second.state, whole.state)
