"""Arguments of a simulation are checked and named, and reach what they are for."""

from __future__ import annotations

import os

import numpy as np
import pytest

from qlb import InputError, QlbError, Simulation, SolverSettings, StableNeoHookean, State, Tolerance
from tests.simulation.bars import MESH, bar
from tests.support import Array

N = len(MESH.positions)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"step": 0.0}, "step = 0.0 is out of range: must be > 0 s"),
        ({"step": -0.01}, "step = -0.01 is out of range: must be > 0 s"),
        ({"step": float("nan")}, "step = nan is out of range: must be > 0 s"),
        ({"step": float("inf")}, "step = inf is out of range: must be > 0 s"),
        ({"damping": 5.0}, "damping = 5.0 is out of range: must be a Damping"),
        ({"mass": "full"}, "mass = 'full' is out of range: must be 'lumped' or 'consistent'"),
        ({"on_failure": "retry"}, "on_failure = 'retry' is out of range: must be 'stop', 'halve' or 'accept'"),
        ({"threads": 0}, "threads = 0 is out of range: must be >= 1"),
        ({"threads": -2}, "threads = -2 is out of range: must be >= 1"),
        ({"integrator": "RK4"}, "integrator = 'RK4' is not known: must be one of BDF1, BDF2, SDIRK2, quasistatic"),
        ({"solver": "SGD"}, "solver = 'SGD' is not known: must be one of ND, QLF, QLB, QLA"),
    ],
)
def test_a_wrong_argument_is_named_with_its_value_and_range(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        bar(**arguments)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("name", "value"),
    [
        ("step", "fast"),
        ("damping", "much"),
        ("threads", 1.5),
        ("integrator", None),
        ("velocity", np.zeros((3, 3))),
        ("velocity", np.zeros(2)),
        ("velocity", np.zeros((N + 1, 3))),
        ("velocity", (0.0, float("nan"), 0.0)),
        ("velocity", "down"),
        ("gravity", (0.0, -9.81)),
        ("gravity", (0.0, float("nan"), 0.0)),
        ("gravity", "down"),
        ("material", "SNH"),
        ("tolerance", 1e-6),
        ("solver_settings", {"window": 3}),
    ],
    ids=lambda value: str(value)[:20].replace("\n", " "),
)
def test_an_argument_of_the_wrong_kind_is_named(name: str, value: object) -> None:
    with pytest.raises(InputError, match=name) as caught:
        bar(**{name: value})
    assert "\n" not in str(caught.value)


def test_a_velocity_that_is_not_finite_is_named_with_its_node() -> None:
    velocity = np.zeros((N, 3))
    velocity[7, 1] = np.nan
    with pytest.raises(InputError, match=r"velocity.* 7 .*nan.*finite"):
        bar(velocity=velocity)


@pytest.mark.parametrize(
    "gravity",
    [
        pytest.param(lambda time: np.zeros(2), id="two numbers"),
        pytest.param(lambda time: np.array([0.0, np.nan, 0.0]), id="nan"),
        pytest.param(lambda time: None, id="nothing"),
    ],
)
def test_a_wrong_load_in_time_stops_the_step_and_keeps_the_state(gravity: object) -> None:
    simulation = bar(gravity=gravity)
    before = simulation.state
    with pytest.raises(QlbError):
        simulation.advance()
    assert simulation.state is before
    assert simulation.steps_done == 0


def test_a_parameter_for_another_number_of_elements_is_refused() -> None:
    with pytest.raises(InputError, match=r"shape \(2,\), must be one number or \(96,\)"):
        bar(material=StableNeoHookean(young=[1.0, 2.0])).advance()


@pytest.mark.parametrize("shape", [(3,), (N, 3)], ids=["one for all", "one each"])
def test_initial_velocity(shape: tuple[int, ...], rng: np.random.Generator) -> None:
    velocity = rng.normal(size=shape)
    simulation = bar(velocity=velocity)
    np.testing.assert_array_equal(simulation.state.velocities, np.broadcast_to(velocity, (N, 3)))


def test_the_velocity_that_was_given_stays_its_owners(rng: np.random.Generator) -> None:
    velocity = rng.normal(size=(N, 3))
    simulation = bar(velocity=velocity)
    expected = velocity.copy()
    velocity[:] = 7.0
    np.testing.assert_array_equal(simulation.state.velocities, expected)


def test_threads_default_to_what_the_process_may_use() -> None:
    simulation = Simulation(MESH, material=StableNeoHookean())
    assert simulation.threads == len(os.sched_getaffinity(0))


def test_settings_reach_the_solver() -> None:
    settings, tolerance = SolverSettings(window=3), Tolerance(relative=1e-3)
    simulation = bar(solver_settings=settings, tolerance=tolerance)
    assert simulation.solver.settings.window == 3
    assert simulation.solver.tolerance is tolerance


def bad_states() -> dict[str, tuple[Array, Array]]:
    x, v = MESH.positions, np.zeros((N, 3))
    return {
        "too few nodes": (x[:-1], v[:-1]),
        "velocities of another shape": (x, v[:-1]),
        "nan": (np.where(x == x.max(), np.nan, x), v),
    }


@pytest.mark.parametrize("kind", bad_states())
def test_a_state_that_does_not_fit_the_mesh_is_not_restored(kind: str) -> None:
    with pytest.raises(InputError):
        bar().restore(State(0.0, *bad_states()[kind]), 0, {})
