"""With contact and friction, too, the same input gives the same bits: twice, in pieces, with more threads."""

from __future__ import annotations

import pytest

from qlb import Contact, Obstacle, Plane, Simulation, Tolerance, Translation
from tests.contact.scenes import SOFT, UP, block, box_surface, simulate
from tests.simulation.test_repeatability import assert_same_bits, resumed
from tests.support import finish

STEPS = 9
SOLVERS = ["ND", pytest.param("QLF", marks=pytest.mark.slow), "QLB", "QLA"]


def two_cubes(solver: str, threads: int = 1) -> Simulation:
    """Two cubes that land on each other and on a plane, pushed by a plate, with friction."""
    ground = Plane((0, -0.103, 0), UP)
    wall = Obstacle(*box_surface((0.1, 0.3, 0.5), (-0.16, 0.01, 0.02)), motion=Translation((0.2, 0, 0)))
    cubes = [
        block((0.2, 0.2, 0.2), at, cells=(2, 2, 2), material=SOFT, rotation=turn, velocity=(0.0, -1.0, 0.0))
        for at, turn in (((0, 0, 0), (0.0, 0.02, 0.0)), ((0.05, 0.22, 0.02), (0.1, 0.2, 0.05)))
    ]
    contact, tolerance = Contact(dhat=4e-3, friction=0.3), Tolerance(relative=1e-3)
    return simulate(
        cubes, ground, wall, solver=solver, contact=contact, threads=threads, tolerance=tolerance, on_failure="accept"
    )


def rows(simulation: Simulation, steps: int) -> list:
    return [
        (row.residual, row.energy, row.step_length, row.contacts, row.minimum_distance, row.step_bound)
        for result in simulation.run(steps)
        for solve in result.solves
        for row in solve.rows
    ]


@pytest.mark.parametrize("solver", SOLVERS)
def test_the_same_run_twice_and_with_more_threads_gives_the_same_bits(solver):
    runs = [two_cubes(solver, threads) for threads in (1, 1, 2)]
    first, *others = [rows(run, STEPS) for run in runs]
    assert max(row[3] for row in first) > 10
    for simulation, found in zip(runs[1:], others, strict=True):
        assert found == first
        assert_same_bits(simulation.state, runs[0].state)


@pytest.mark.parametrize("solver", SOLVERS)
def test_a_run_cut_in_two_in_the_middle_of_contact_gives_the_same_bits(solver):
    whole, first = two_cubes(solver), two_cubes(solver)
    finish(whole, STEPS)
    counts = [row[3] for row in rows(first, 5)]
    assert max(counts[-5:]) > 0
    second = resumed(first, two_cubes(solver))
    finish(second, STEPS - 5)
    assert_same_bits(second.state, whole.state)


@pytest.mark.parametrize("crowd", [3, 12])
def test_so_does_one_whose_factor_is_analysed_anew_for_its_contacts(crowd, monkeypatch):
    """From `crowd` terms on QLA's factor takes them in, with a pattern that grows with the pairs that touch."""
    monkeypatch.setattr("qlb.solvers.adaptive.CROWD", crowd)
    monkeypatch.setattr("qlb.solvers.adaptive.OUTSIDE", 0)
    whole, first = two_cubes("QLA"), two_cubes("QLA")
    finish(whole, STEPS)
    finish(first, 6)
    assert {"stencils", "base_keys"} <= set(first.solver.save())
    second = resumed(first, two_cubes("QLA"))
    finish(second, STEPS - 6)
    assert_same_bits(second.state, whole.state)
