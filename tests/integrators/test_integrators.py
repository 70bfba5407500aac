"""The integrators alone, on linear problems whose stages are solved by hand."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from qlb import State
from qlb.integrators import INTEGRATORS, Integrator, Stage
from tests.support import Array, fitted_slope

DYNAMIC = [name for name, kind in INTEGRATORS.items() if kind.order > 0]
A = 1 - np.sqrt(0.5)  # (2 - sqrt 2)/2
OMEGA, ALPHA = 3.0, 0.8


def state(x: float, v: float, time: float = 0.0, previous: State | None = None) -> State:
    return State(time, np.array([x]), np.array([v]), previous)


def oscillator(stage: Stage) -> Array:
    # x - x_b - c v_b = c^2 (-omega^2 x - alpha (x - x_b)/c), solved for x
    c = stage.c
    return (stage.x_b + c * stage.v_b + c * ALPHA * stage.x_b) / (1 + c * ALPHA + (c * OMEGA) ** 2)


def forced(stage: Stage) -> Array:
    # x'' = cos t
    return stage.x_b + stage.c * stage.v_b + stage.c**2 * np.cos(stage.time)


def constant(stage: Stage) -> Array:
    # x'' = -9.81
    return stage.x_b + stage.c * stage.v_b - 9.81 * stage.c**2


def advance(integrator: Integrator, last: State, h: float, solve: object) -> State:
    steps = integrator.step(last, h)
    stage = next(steps)
    while True:
        try:
            stage = steps.send(solve(stage))  # type: ignore[operator]
        except StopIteration as end:
            x, v = end.value
            return State(last.time + h, x, v, last.without_history())


def run(name: str, start: State, h: float, count: int, solve: object) -> State:
    integrator = INTEGRATORS[name]()
    for _ in range(count):
        start = advance(integrator, start, h, solve)
    return start


def stages(name: str, last: State, h: float, *solutions: Array) -> list[Stage]:
    steps = INTEGRATORS[name]().step(last, h)
    return [next(steps), *(steps.send(solution) for solution in solutions)]


def test_bdf1_stage_is_that_of_the_supplement() -> None:
    (stage,) = stages("BDF1", state(2.0, 3.0, time=1.0), 0.1)
    assert (stage.time, stage.c, stage.x_b[0], stage.v_b[0]) == (1.1, 0.1, 2.0, 3.0)


def test_bdf2_stage_is_that_of_the_supplement() -> None:
    (stage,) = stages("BDF2", state(2.0, 3.0, time=1.0, previous=state(1.7, 2.0, time=0.9)), 0.1)
    assert (stage.time, stage.c) == pytest.approx((1.1, 0.2 / 3))
    assert (stage.x_b[0], stage.v_b[0]) == pytest.approx(((8 - 1.7) / 3, 10 / 3))


def test_sdirk2_stages_are_those_of_the_supplement() -> None:
    first, second = stages("SDIRK2", state(2.0, 3.0, time=1.0), 0.1, np.array([2.09]))
    assert (first.time, first.c, first.x_b[0], first.v_b[0]) == pytest.approx((1 + 0.1 * A, 0.1 * A, 2.0, 3.0))
    v = (2.09 - 2.0) / (0.1 * A)
    assert (second.time, second.c) == pytest.approx((1.1, 0.1 * A))
    assert second.x_b[0] == pytest.approx(2.0 + (1 - A) * 0.1 * v)
    assert second.v_b[0] == pytest.approx(3.0 + (1 - A) / A * (v - 3.0))


def test_quasistatic_stage_has_no_inertia() -> None:
    (stage,) = stages("quasistatic", state(2.0, 3.0, time=1.0), 0.1)
    assert not stage.inertial
    assert stage.time == pytest.approx(1.1)


def test_quasistatic_velocity_is_the_mean_over_the_step() -> None:
    end = advance(INTEGRATORS["quasistatic"](), state(2.0, 3.0), 0.1, lambda stage: np.array([2.5]))
    assert end.velocities[0] == pytest.approx(5.0)


def test_bdf2_starts_with_a_step_of_sdirk2() -> None:
    start = state(1.0, 0.5)
    assert run("BDF2", start, 0.1, 1, oscillator).positions == run("SDIRK2", start, 0.1, 1, oscillator).positions


def test_bdf2_uses_its_own_formula_from_the_second_step_on() -> None:
    # 3/2 y_2 - 2 y_1 + 1/2 y_0 = h y_2' for both x and v
    h, first = 0.1, run("BDF2", state(1.0, 0.5), 0.1, 1, oscillator)
    second = advance(INTEGRATORS["BDF2"](), first, h, oscillator)
    x, v = second.positions, second.velocities
    assert 1.5 * x - 2 * first.positions + 0.5 * 1.0 == pytest.approx(h * v)
    assert 1.5 * v - 2 * first.velocities + 0.5 * 0.5 == pytest.approx(h * (-(OMEGA**2) * x - ALPHA * v))


@pytest.mark.parametrize("h", [0.01, 0.3, 10.0])
@pytest.mark.parametrize("name", ["BDF1", "SDIRK2"])
def test_a_step_is_that_of_the_stability_function(name: str, h: float) -> None:
    # y' = K y: y_1 = R(hK) y_0, R = 1/(1 - z) for BDF1 and (1 + (1 - 2a) z)/(1 - a z)^2 for SDIRK2
    hK, I = h * np.array([[0.0, 1.0], [-(OMEGA**2), -ALPHA]]), np.eye(2)  # noqa: E741
    implicit = np.linalg.inv(I - (hK if name == "BDF1" else A * hK))
    R = implicit if name == "BDF1" else implicit @ implicit @ (I + (1 - 2 * A) * hK)
    end = run(name, state(1.3, -0.4), h, 1, oscillator)
    np.testing.assert_allclose([end.positions[0], end.velocities[0]], R @ [1.3, -0.4], rtol=1e-12)


def exact_oscillator(time: float) -> tuple[float, float]:
    """x and v of x'' + alpha x' + omega^2 x = 0 from (1, 0)."""
    rate = complex(-ALPHA / 2, np.sqrt(OMEGA**2 - ALPHA**2 / 4))
    other = rate.conjugate()
    x = (rate * np.exp(other * time) - other * np.exp(rate * time)) / (rate - other)
    v = rate * other * (np.exp(other * time) - np.exp(rate * time)) / (rate - other)
    return x.real, v.real


@pytest.mark.parametrize("name", DYNAMIC)
@pytest.mark.parametrize("problem", ["damped oscillator", "load in time"])
def test_order_on_a_scalar_problem(name: str, problem: str) -> None:
    order = INTEGRATORS[name].order
    # At 0.8 s no leading error of x or v passes through zero. The higher the order, the sooner rounding is met.
    counts, T = np.array([400, 800, 1600]) // 2**order, 0.8
    solve, exact = (
        (oscillator, exact_oscillator(T)) if problem == "damped oscillator" else (forced, (2 - np.cos(T), np.sin(T)))
    )
    ends = [run(name, state(1.0, 0.0), T / n, n, solve) for n in counts]
    for found, value in (("positions", exact[0]), ("velocities", exact[1])):
        slope = fitted_slope(T / counts, np.array([abs(getattr(end, found)[0] - value) for end in ends]))
        assert order - 0.1 <= slope <= order + 0.1, f"{found} converge with slope {slope:.3f}"


def test_sdirk2_errs_less_than_bdf2() -> None:
    exact = exact_oscillator(1.0)[0]
    errors = [
        abs(run(name, state(1.0, 0.0), 0.005, 200, oscillator).positions[0] - exact) for name in ("BDF2", "SDIRK2")
    ]
    assert errors[0] > 4 * errors[1]


@pytest.mark.parametrize("name", [name for name in DYNAMIC if INTEGRATORS[name].order > 1])
def test_constant_acceleration_is_integrated_exactly(name: str) -> None:
    end = run(name, state(1.0, 2.0), 0.1, 20, constant)
    assert end.positions[0] == pytest.approx(1 + 2 * 2.0 - 9.81 / 2 * 4.0, rel=1e-12)
    assert end.velocities[0] == pytest.approx(2 - 9.81 * 2.0, rel=1e-12)


def test_bdf1_falls_too_far_by_half_a_step_of_speed() -> None:
    # x_n = x_0 + v_0 t - g t (t + h)/2
    end = run("BDF1", state(1.0, 2.0), 0.1, 20, constant)
    assert end.positions[0] == pytest.approx(1 + 2 * 2.0 - 9.81 / 2 * 2.0 * 2.1, rel=1e-12)


@pytest.mark.parametrize("name", DYNAMIC)
def test_stiff_modes_are_damped_out(name: str) -> None:
    # L-stability: with h omega = 3e4 hardly anything is left after a few steps.
    end = run(name, state(1.0, 0.0), 1e4, 5, oscillator)
    assert abs(end.positions[0]) < 1e-3


@pytest.mark.parametrize("name", DYNAMIC)
@pytest.mark.parametrize("h", [0.05, 0.5, 5.0])
def test_an_undamped_oscillation_never_grows(name: str, h: float) -> None:
    def undamped(stage: Stage) -> Array:
        return (stage.x_b + stage.c * stage.v_b) / (1 + (stage.c * OMEGA) ** 2)

    last, energies = state(1.0, 0.0), []
    for _ in range(30):
        last = advance(INTEGRATORS[name](), last, h, undamped)
        energies.append(last.velocities[0] ** 2 + (OMEGA * last.positions[0]) ** 2)
    assert max(energies) <= OMEGA**2 * (1 + 1e-12)
    assert energies[-1] < OMEGA**2


def test_both_stages_of_sdirk2_have_one_c() -> None:
    first, second = stages("SDIRK2", state(0.0, 1.0), 0.37, np.array([0.1]))
    assert first.c == second.c


def test_one_step_methods_need_no_history() -> None:
    for name, integrator in INTEGRATORS.items():
        method = integrator().one_step_method()
        assert method.name == {"BDF2": "SDIRK2"}.get(name, name)
        next(method.step(state(0.0, 1.0), 0.1))


def test_a_state_forgets_its_history() -> None:
    with_history = replace(state(1.0, 2.0), previous=state(0.9, 2.0))
    assert with_history.without_history().previous is None
    assert with_history.without_history().positions is with_history.positions


def test_orders_are_those_of_the_literature() -> None:
    known = {"BDF1": 1, "BDF2": 2, "SDIRK2": 2, "quasistatic": 0}
    assert {name: INTEGRATORS[name].order for name in known} == known


def test_names_are_those_of_the_registry() -> None:
    assert {name: integrator.name for name, integrator in INTEGRATORS.items()} == {n: n for n in INTEGRATORS}
