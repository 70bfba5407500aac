"""Nodes that are let go: when, with which velocity, to which order, and to the same bits after a break.

Held against what must be: free flight, a fine run, the system that never held them, an unbroken run.
"""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

from qlb import Damping, InputError, Simulation, SolverSettings, StableNeoHookean, State, TetMesh, Translation
from qlb.integrators import INTEGRATORS
from qlb.results import Run, RunWriter
from qlb.solvers import SOLVERS
from tests.simulation.bars import MESH, TWIST, bar
from tests.support import TIGHT, Array, finish, fitted_slope, left_end, right_end, small_bar

STILL = (0.0, 0.0, 0.0)


def everything(mesh: TetMesh) -> Array:
    return np.arange(len(mesh.positions))


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_a_body_let_go_in_zero_gravity_flies_on_with_the_velocity_of_its_script(integrator: str) -> None:
    velocity = np.array([0.5, -1.0, 2.0])
    simulation = Simulation(MESH, material=StableNeoHookean(), gravity=STILL, integrator=integrator, threads=1)
    simulation.move(everything(MESH), Translation(tuple(velocity)), until=0.05)
    for result in simulation.run(12):
        np.testing.assert_allclose(result.velocities, np.broadcast_to(velocity, MESH.positions.shape), atol=1e-9)
        np.testing.assert_allclose(result.positions, MESH.positions + velocity * result.time, atol=1e-10)
    assert not simulation.system.held.fixed.any()


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2"])
def test_nodes_let_go_have_the_velocity_of_their_script_to_second_order(integrator: str) -> None:
    def speeding_up(anchors: Array, time: float) -> Array:
        return anchors + np.array([0.0, np.sin(3 * time), 0.0])

    errors = []
    for count in (8, 16, 32):
        simulation = Simulation(
            MESH, material=StableNeoHookean(), gravity=STILL, integrator=integrator, step=0.4 / count, threads=1
        )
        simulation.move(everything(MESH), speeding_up, until=0.4)
        last = finish(simulation, count)
        np.testing.assert_array_equal(last.velocities, simulation.state.velocities)
        errors.append(np.abs(last.velocities - [0.0, 3 * np.cos(1.2), 0.0]).max())
    assert fitted_slope([8, 16, 32], errors) == pytest.approx(-2, abs=0.1)


@pytest.mark.parametrize(("until", "first_free"), [(0.03, 4), (0.03 - 1e-12, 4), (0.031, 5), (0.0001, 2), (0.07, 8)])
def test_the_first_step_that_begins_then_or_later_takes_nodes_as_free(until: float, first_free: int) -> None:
    simulation, nodes = bar(), right_end(MESH)
    simulation.pin(nodes, until=until)
    for result in simulation.run(first_free):
        moved = not np.array_equal(result.positions[nodes], MESH.positions[nodes])
        assert moved == (result.step == first_free)
        held = simulation.system.held.fixed[nodes].any()
        assert held == (result.step < first_free - 1)


def test_only_the_directions_that_were_let_go_are_free() -> None:
    simulation, nodes = bar(), right_end(MESH)
    simulation.pin(nodes, axes="y", until=0.02)
    simulation.pin(nodes, axes="xz")
    last = finish(simulation, 5)
    rest = MESH.positions[nodes]
    np.testing.assert_array_equal(last.positions[nodes][:, [0, 2]], rest[:, [0, 2]])
    assert (last.positions[nodes, 1] < rest[:, 1]).all()


@pytest.mark.parametrize("solver", SOLVERS)
def test_from_then_on_it_is_the_system_that_never_held_them(solver: str) -> None:
    settings = SolverSettings(max_iterations=5000)
    simulation = bar(solver=solver, tolerance=TIGHT, solver_settings=settings)
    simulation.move(right_end(MESH), TWIST, until=0.05)
    finish(simulation, 5)
    fresh = bar(solver=solver, tolerance=TIGHT, solver_settings=settings)
    fresh.restore(State(0.05, simulation.state.positions, simulation.state.velocities), 5, {})
    ends = [finish(one, 5).positions for one in (simulation, fresh)]
    np.testing.assert_array_equal(*ends)


@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("cut", [2, 3, 4, 5])
def test_a_run_cut_around_the_release_gives_the_same_bits(
    tmp_path: Path, integrator: str, solver: str, cut: int
) -> None:
    def make() -> Simulation:
        simulation = bar(integrator=integrator, solver=solver, solver_settings=SolverSettings(max_iterations=5000))
        simulation.move(right_end(MESH), TWIST, until=0.035)
        return simulation

    whole, first, second = make(), make(), make()
    finish(whole, 7)
    with RunWriter(tmp_path, {"scene": "mine"}, first) as writer:
        for result in first.run(cut):
            writer.record(result)
    second.restore(*Run(tmp_path).load_checkpoint())
    finish(second, 7 - cut)
    np.testing.assert_array_equal(second.state.positions, whole.state.positions)
    np.testing.assert_array_equal(second.state.velocities, whole.state.velocities)


@pytest.mark.slow
@pytest.mark.parametrize(("integrator", "order"), [("BDF1", 0.9), ("BDF2", 1.85), ("SDIRK2", 1.9)])
def test_the_order_is_kept_across_the_release(integrator: str, order: float) -> None:
    mesh = small_bar((3, 1, 1))

    def sway(anchors: Array, time: float) -> Array:
        return anchors + 0.05 * (1 - np.cos(8 * time)) * np.array([0.3, 1.0, 0.5])

    def end(count: int, name: str) -> Array:
        simulation = Simulation(
            mesh,
            material=StableNeoHookean(young=1e3, poisson=0.3),
            gravity=STILL,
            integrator=name,
            step=0.4 / count,
            tolerance=TIGHT,
            threads=1,
        )
        simulation.pin(left_end(mesh))
        simulation.move(right_end(mesh), sway, until=0.2)
        return finish(simulation, count).positions

    reference = end(1600, "SDIRK2")
    counts = [40, 80, 160]
    errors = [np.abs(end(count, integrator) - reference).max() for count in counts]
    assert -fitted_slope(counts, errors) > order, errors


def test_statistics_go_on_across_the_release(tmp_path: Path) -> None:
    simulation = bar(damping=Damping(mass=1.0))
    simulation.pin(right_end(MESH), until=0.03)
    with RunWriter(tmp_path, {"scene": "mine"}, simulation) as writer:
        for result in simulation.run(6):
            writer.record(result)
    run = Run(tmp_path)
    assert run.iterations_per_step().steps.tolist() == [1, 2, 3, 4, 5, 6]
    assert run.summary["factorizations"] == run.stats["factorizations"].sum() >= 2
    seconds = {part: run.stats[f"seconds_{part}"].sum() for part in run.summary["seconds"]}
    assert run.summary["seconds"]["factor"] == pytest.approx(seconds["factor"], rel=1e-3, abs=1e-5)


@pytest.mark.parametrize("until", [0, 0.0, -1.0, float("nan"), float("inf"), "soon", True])
def test_a_time_that_is_none_is_refused(until: object) -> None:
    simulation, nodes = bar(), right_end(MESH)
    with pytest.raises(InputError, match=r"until = .* is out of range: must be > 0 s, or None"):
        simulation.pin(nodes, until=until)  # type: ignore[arg-type]
    with pytest.raises(InputError, match="until"):
        simulation.move(nodes, TWIST, until=until)  # type: ignore[arg-type]
