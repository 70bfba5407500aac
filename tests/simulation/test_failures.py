"""What happens to a step that does not converge."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Reason, SolverSettings, StepFailed
from tests.simulation.bars import bar
from tests.solvers.problems import WrongGradient
from tests.support import finish, start_at

FEW = SolverSettings(max_iterations=3)
HARD = {"solver": "ND", "step": 0.05, "solver_settings": FEW}


@pytest.fixture
def _hopeless(monkeypatch: pytest.MonkeyPatch) -> None:
    """Gives every stage problem a gradient that points the wrong way, so that no solve gets anywhere."""
    monkeypatch.setattr("qlb.simulation.StageProblem", WrongGradient)


def test_stop_raises_and_keeps_the_state() -> None:
    simulation = bar(integrator="BDF1", **HARD)
    before = simulation.state
    with pytest.raises(StepFailed) as caught:
        simulation.advance()
    assert simulation.state is before
    assert simulation.steps_done == 0
    result = caught.value.result
    assert result.reason is Reason.MAX_ITERATIONS
    assert (result.step, result.iterations, result.converged) == (1, 3, False)


def test_the_message_says_what_failed_when_and_how_far_it_got() -> None:
    simulation = bar(integrator="BDF1", **HARD)
    with pytest.raises(
        StepFailed,
        match=r"^step 1 \(time 0\.05 s\) did not converge: max_iterations after 3 iterations of ND,"
        r" \|g\| = \S+ \(\S+ of \|g\(x_k\)\|\)$",
    ):
        simulation.advance()


def test_a_later_failure_keeps_the_last_good_state() -> None:
    simulation = bar(integrator="BDF1", solver="ND", step=0.05, solver_settings=SolverSettings(max_iterations=4))
    done = []
    with pytest.raises(StepFailed, match=r"^step 3 "):
        done.extend(simulation.run(10))
    assert len(done) == simulation.steps_done == 2
    np.testing.assert_array_equal(simulation.state.positions, done[-1].positions)


@pytest.mark.usefixtures("_hopeless")
def test_stop_ends_at_the_first_stage_that_fails() -> None:
    with pytest.raises(StepFailed) as caught:
        bar(integrator="SDIRK2").advance()
    assert caught.value.result.reason is Reason.LINE_SEARCH_FAILED
    assert len(caught.value.result.solves) == 1


def test_halve_takes_in_parts_what_fails_as_a_whole() -> None:
    simulation = bar(integrator="BDF1", on_failure="halve", **HARD)
    result = simulation.advance()
    assert (result.parts, result.converged) == (2, True)
    assert [solve.reason.converged for solve in result.solves] == [False, True, True]
    assert result.reason is Reason.CONVERGED_RELATIVE
    assert result.time == pytest.approx(0.05)
    assert (simulation.state.time, simulation.steps_done) == (0.05, 1)


def test_two_halves_are_two_steps_of_half_the_length() -> None:
    halved = bar(integrator="BDF1", on_failure="halve", **HARD)
    halved.advance()
    twice = bar(integrator="BDF1", **(HARD | {"step": 0.025}))
    finish(twice, 2)
    np.testing.assert_array_equal(halved.state.positions, twice.state.positions)
    np.testing.assert_array_equal(halved.state.velocities, twice.state.velocities)


def test_halves_that_fail_are_halved_again() -> None:
    simulation = bar(integrator="BDF1", on_failure="halve", **(HARD | {"step": 0.1}))
    parts = [result.parts for result in simulation.run(4)]
    assert max(parts) >= 4
    assert simulation.state.time == pytest.approx(0.4)


def test_a_cut_step_of_bdf2_is_taken_by_sdirk2() -> None:
    simulation = bar(integrator="BDF2", on_failure="halve", **HARD)
    simulation.advance()
    before = simulation.state
    result = simulation.advance()
    assert result.parts == 2
    alone = bar(integrator="SDIRK2", **(HARD | {"step": 0.025}))
    start_at(alone, before.positions, before.velocities)
    finish(alone, 2)
    np.testing.assert_array_equal(result.positions, alone.state.positions)


def test_after_a_cut_step_bdf2_goes_on_with_its_own_formula() -> None:
    simulation = bar(integrator="BDF2", on_failure="halve", **HARD)
    finish(simulation, 2)
    assert simulation.state.previous is not None
    assert simulation.state.time - simulation.state.previous.time == pytest.approx(0.05)


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_cut_steps_stay_close_to_whole_ones(integrator: str) -> None:
    cut = bar(
        integrator=integrator, on_failure="halve", **(HARD | {"solver_settings": SolverSettings(max_iterations=2)})
    )
    whole = bar(integrator=integrator, solver="ND", step=0.05)
    parts = [result.parts for result in cut.run(4)]
    finish(whole, 4)
    assert max(parts) > 1
    # The same times at a smaller step: apart by the truncation error of 0.05 s, here some centimetres.
    assert np.abs(cut.state.positions - whole.state.positions).max() < 0.1


@pytest.mark.usefixtures("_hopeless")
def test_halve_gives_up_at_a_256th_and_keeps_the_state() -> None:
    simulation = bar(integrator="BDF1", on_failure="halve")
    before = simulation.state
    with pytest.raises(StepFailed) as caught:
        simulation.advance()
    assert simulation.state is before
    # The whole, a half, a quarter, ... a 256th: nine solves, none of which converged.
    assert len(caught.value.result.solves) == 9
    assert "did not converge" in str(caught.value)


def test_accept_goes_on_and_says_so() -> None:
    simulation = bar(integrator="BDF1", on_failure="accept", **HARD)
    results = list(simulation.run(3))
    assert [result.converged for result in results] == 3 * [False]
    assert [result.reason for result in results] == 3 * [Reason.MAX_ITERATIONS]
    assert simulation.steps_done == 3
    np.testing.assert_array_equal(simulation.state.positions, results[-1].positions)


@pytest.mark.usefixtures("_hopeless")
def test_accept_solves_every_stage() -> None:
    result = bar(integrator="SDIRK2", on_failure="accept").advance()
    assert len(result.solves) == 2
    assert not result.converged


def test_accept_marks_no_step_that_converged() -> None:
    for result in bar(on_failure="accept").run(3):
        assert result.converged


@pytest.mark.parametrize("on_failure", ["stop", "halve"])
@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_a_step_that_is_not_finite_keeps_the_state(integrator: str, on_failure: str) -> None:
    simulation = bar(integrator=integrator, on_failure=on_failure, velocity=(0.0, 1e200, 0.0))
    before = simulation.state
    with pytest.raises(StepFailed) as caught:
        simulation.advance()
    assert caught.value.result.reason is Reason.NOT_FINITE
    assert simulation.state is before


def test_accept_says_of_a_step_that_it_was_not_finite() -> None:
    simulation = bar(integrator="BDF1", on_failure="accept", velocity=(0.0, 1e200, 0.0))
    result = simulation.advance()
    assert result.reason is Reason.NOT_FINITE
    assert np.isfinite(simulation.state.positions).all()
    assert np.isfinite(simulation.state.velocities).all()


def test_the_simulation_can_go_on_after_a_failure() -> None:
    # The failed attempt has left no trace in the solver: the same step with room to converge gives the same bits.
    # QLA may have made a new factor on the way, which leads to the same solution within the tolerance.
    for solver in ("ND", "QLF", "QLB", "QLA"):
        simulation, calm = (bar(integrator="BDF2", solver=solver, step=0.05) for _ in range(2))
        finish(simulation, 2)
        roomy = simulation.solver.settings
        simulation.solver.settings = roomy.model_copy(update={"max_iterations": 1})
        with pytest.raises(StepFailed):
            simulation.advance()
        simulation.solver.settings = roomy
        error = np.abs(finish(simulation, 2).positions - finish(calm, 4).positions).max()
        assert error <= (1e-6 if solver == "QLA" else 0.0)
