"""The time loop counts steps and times, keeps its state, and asks for loads at the time of each stage."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Reason
from qlb.integrators import INTEGRATORS
from tests.simulation.bars import MESH, bar
from tests.support import Array, finish


@pytest.fixture(params=INTEGRATORS)
def integrator(request: pytest.FixtureRequest) -> str:
    return request.param


def test_steps_and_times_are_counted(integrator: str) -> None:
    simulation = bar(integrator=integrator, step=0.02)
    results = list(simulation.run(5))
    assert [result.step for result in results] == [1, 2, 3, 4, 5]
    assert [result.time for result in results] == pytest.approx([0.02, 0.04, 0.06, 0.08, 0.1])
    assert (simulation.steps_done, simulation.state.time) == (5, results[-1].time)


def test_the_state_is_that_of_the_last_result(integrator: str) -> None:
    simulation = bar(integrator=integrator)
    first, second = simulation.run(2)
    state = simulation.state
    np.testing.assert_array_equal(state.positions, second.positions)
    np.testing.assert_array_equal(state.velocities, second.velocities)
    assert state.previous is not None
    np.testing.assert_array_equal(state.previous.positions, first.positions)
    assert state.previous.previous is None


def test_a_result_does_not_change_with_later_steps(integrator: str) -> None:
    simulation = bar(integrator=integrator)
    result = simulation.advance()
    before = result.positions.copy(), result.velocities.copy()
    finish(simulation, 3)
    np.testing.assert_array_equal(result.positions, before[0])
    np.testing.assert_array_equal(result.velocities, before[1])


def test_the_mesh_does_not_move_with_the_body(integrator: str) -> None:
    before = MESH.positions.copy()
    finish(bar(integrator=integrator), 3)
    np.testing.assert_array_equal(MESH.positions, before)


def test_one_solve_for_each_stage(integrator: str) -> None:
    expected = {"BDF2": [2, 1, 1], "SDIRK2": [2, 2, 2]}.get(integrator, [1, 1, 1])
    assert [len(result.solves) for result in bar(integrator=integrator).run(3)] == expected


def test_counts_are_sums_over_the_solves(integrator: str) -> None:
    for result in bar(integrator=integrator).run(3):
        assert result.iterations == sum(solve.iterations for solve in result.solves) > 0
        assert result.factorizations == sum(solve.factorizations for solve in result.solves)
        assert result.converged
        assert result.reason is Reason.CONVERGED_RELATIVE
        assert result.parts == 1


def test_steps_are_taken_as_they_are_asked_for() -> None:
    simulation = bar()
    run = simulation.run(10)
    assert simulation.steps_done == 0
    next(run)
    assert simulation.steps_done == 1


def test_running_on_is_the_same_as_running_through(integrator: str) -> None:
    once, twice = bar(integrator=integrator), bar(integrator=integrator)
    finish(once, 6)
    finish(twice, 2)
    finish(twice, 4)
    np.testing.assert_array_equal(once.state.positions, twice.state.positions)


def test_loads_are_taken_at_the_time_of_each_stage() -> None:
    times: list[float] = []

    def gravity(time: float) -> Array:
        times.append(time)
        return np.array([0.0, -9.81, 0.0])

    finish(bar(integrator="SDIRK2", step=0.1, gravity=gravity), 2)
    a = 1 - np.sqrt(0.5)
    assert sorted(set(times)) == pytest.approx([0.1 * a, 0.1, 0.1 + 0.1 * a, 0.2])


def test_gravity_pulls_the_way_it_points(integrator: str) -> None:
    for axis in range(3):
        gravity = np.zeros(3)
        gravity[axis] = 1.0
        simulation = bar(integrator=integrator, gravity=tuple(gravity))
        moved = finish(simulation, 2).positions - MESH.positions
        assert moved[:, axis].sum() > 0
        assert moved[:, axis].sum() > 2 * np.abs(np.delete(moved, axis, axis=1).sum(axis=0)).max()
