"""Where a solve starts: on a way on which nothing passes through anything."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Contact, Plane, Simulation
from qlb.integrators.integrator import Stage, State
from qlb.solvers.contact_matrix import SOON, ContactMatrix
from qlb.solvers.lead_in import SHARE, LeadIn
from qlb.system import StageProblem
from qlb.timing import Timer
from tests.contact.scenes import SOFT, UP, block, simulate
from tests.support import Array

DHAT = 4e-3
STEP = 1e-2


def above_the_ground(gap: float) -> Simulation:
    """A block `gap` [m] above a plane, by its lower side."""
    contact = Contact(dhat=DHAT, self_contact=False)
    return simulate(block(material=SOFT), Plane((0, -0.05 - gap, 0), UP), contact=contact)


def problem(simulation: Simulation, velocities: Array, *, inertial: bool = True) -> StageProblem:
    """BDF1 from where the simulation stands, at other velocities (n, 3) [m/s]."""
    x = simulation.state.positions
    stage = Stage(STEP, STEP, ((1.0, x),), velocities, inertial)
    return StageProblem(simulation.system, stage, State(0.0, x, velocities), Timer())


def start(of: StageProblem, *, predict: bool = True) -> Array:
    lead = LeadIn(of, predict=predict)
    found = lead.advance()
    assert lead.arrived
    assert found is not None
    return found - of.origin.positions


def test_what_touches_starts_along_the_way_of_inertia():
    simulation = above_the_ground(DHAT / 2)
    sliding = np.tile([1.0, 0.0, 0.5], (simulation.system.nodes, 1))
    np.testing.assert_allclose(start(problem(simulation, sliding)), STEP * sliding, rtol=1e-12)
    falling = np.tile([1.0, -1.0, 0.5], (simulation.system.nodes, 1))
    free = 0.9 * DHAT / 2 / STEP  # of the way to the plane; the step ends at 0.9 of the gap
    np.testing.assert_allclose(start(problem(simulation, falling)), SHARE * free * STEP * falling, rtol=1e-6)


def test_what_does_not_touch_starts_from_the_predictor():
    simulation = above_the_ground(10 * DHAT)
    falling = np.tile([0.0, -1.0, 0.0], (simulation.system.nodes, 1))
    of = problem(simulation, falling)
    np.testing.assert_allclose(start(of), of.predictor - of.origin.positions, rtol=1e-12)


@pytest.mark.parametrize("gap", [DHAT / 2, 10 * DHAT])
def test_without_a_guess_nothing_moves(gap):
    simulation = above_the_ground(gap)
    falling = np.tile([0.0, -1.0, 0.0], (simulation.system.nodes, 1))
    assert not start(problem(simulation, falling), predict=False).any()


def test_statics_start_where_they_are_in_contact():
    simulation = above_the_ground(DHAT / 2)
    assert not start(problem(simulation, np.ones((simulation.system.nodes, 3)), inertial=False)).any()


@pytest.mark.parametrize("gap", [DHAT / 2, 10 * DHAT])
def test_a_way_that_turns_the_body_inside_out_is_not_gone(gap):
    simulation = above_the_ground(gap)
    x = simulation.state.positions
    inward = -3 * (x - x.mean(axis=0)) / STEP * np.array([1.0, 0.0, 0.0])
    of = problem(simulation, inward)
    assert simulation.system.is_inverted(x + STEP * inward)
    assert not start(of).any()


def test_a_pattern_holds_pairs_that_may_soon_touch():
    tilted = block(at=(0.0, 0.1 + 1.1 * DHAT, 0.0), rotation=(0.0, 0.0, 0.03), cells=(6, 1, 6), name="upper")
    simulation = simulate([block(cells=(6, 1, 6), name="lower"), tilted], contact=Contact(dhat=DHAT))
    system, x = simulation.system, simulation.state.positions
    of = problem(simulation, np.zeros_like(x))
    assert system.contact is not None
    assert of.contact is not None
    point = of.contact.at(x)
    near = system.contact.candidates.near(x, SOON * DHAT)
    assert 0 < point.count < len(near)
    matrix = ContactMatrix(system, "supernodal", system.analyse())
    assert not matrix.fits(near).all()
    before = matrix.cholesky
    matrix.assemble(of.hessian(x, project=True), point, x)
    assert matrix.cholesky is not before
    assert matrix.fits(near).all()
    grown = matrix.cholesky
    matrix.assemble(of.hessian(x, project=True), point, x)
    assert matrix.cholesky is grown
