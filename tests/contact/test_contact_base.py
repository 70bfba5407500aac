"""Contacts in QLA's factor: with the difference they make up the Hessian of now, by dense sums; they outlast steps."""

from __future__ import annotations

from dataclasses import replace

import numpy as np
import pytest

from qlb import Contact, Plane, Simulation, _native
from qlb.contact.stage import ALONG, ContactPoint, StageContact
from qlb.integrators.integrator import Origin, Stage
from qlb.solvers import QLA
from qlb.solvers.contact_base import ContactBase
from qlb.timing import Timer
from tests.contact.reference_difference import Terms, arrays, reference_difference
from tests.contact.scenes import SOFT, UP, block, simulate
from tests.support import Array

DHAT = 4e-3
STEP = 1e-2


def resting() -> Simulation:
    """A block with its underside half of dhat above a plane with friction."""
    contact = Contact(dhat=DHAT, friction=0.3)
    return simulate(block(material=SOFT), Plane((0, -0.05 - DHAT / 2, 0), UP), solver="QLA", contact=contact)


def dense(terms: Terms | _native.RankOneTerms, count: int) -> Array:
    nodes, vectors, stiffness = arrays(terms) if isinstance(terms, _native.RankOneTerms) else terms
    columns = np.zeros((len(nodes), count, 3))
    for slot in range(4):
        columns[np.arange(len(nodes)), nodes[:, slot]] += vectors[:, slot]
    columns = columns.reshape(len(nodes), -1).T
    return (columns * stiffness) @ columns.T


def at(simulation: Simulation, x: Array, slid_from: Array) -> ContactPoint:
    """Contact at `x`, with friction lagged there, after a slip from `slid_from`."""
    model = simulation.system.contact
    assert model is not None
    model.stale = True
    stage = Stage(STEP, STEP, ((1.0, slid_from),), np.zeros_like(x))
    return StageContact(model, stage, STEP**2, Origin(x, STEP), Timer()).at(x)


def moved(simulation: Simulation, rng: np.random.Generator) -> tuple[ContactPoint, ContactPoint, Array]:
    """Contact now and then: stiffer here, softer there, gone at some nodes, with friction turned."""
    x = simulation.state.positions
    after = x + np.array([1e-5, 0, 0]) + rng.uniform(-0.4 * DHAT, 0.6 * DHAT, size=(len(x), 1)) * np.array(UP)
    return at(simulation, after, x), at(simulation, x, x + rng.uniform(-1e-5, 1e-5, size=x.shape)), x


def test_the_terms_are_those_of_the_contacts_and_then_two_for_each_that_slides(rng):
    _, point, _ = moved(resting(), rng)
    friction, secant = point.friction, rng.uniform(-1, 2, size=len(point.sliding_keys))
    assert friction is not None
    secant *= friction.stiffness[1::2]
    normal = point.contacts.gamma[:, :, None] * point.contacts.normal[:, None, :]
    turning = friction.gamma[:, :, None] * friction.axis[:, None, :]
    along = np.maximum(friction.stiffness[::2], ALONG * friction.stiffness[1::2])
    stiffness = friction.stiffness.copy()
    stiffness[::2] = np.maximum(along, np.minimum(secant, stiffness[1::2]))
    assert not np.array_equal(stiffness[::2], along)
    found = replace(point, secant=secant).terms(point.sliding_terms())
    kept = slice(0, found.size - friction.stiffness.size)
    np.testing.assert_array_equal(found.nodes[kept], np.concatenate([point.contacts.nodes, friction.nodes]))
    np.testing.assert_array_equal(found.vectors[kept], np.concatenate([normal, turning]))
    np.testing.assert_array_equal(found.stiffness[kept], np.concatenate([point.contacts.stiffness, stiffness]))
    np.testing.assert_array_equal(found.vectors[kept.stop :], turning)
    np.testing.assert_array_equal(found.stiffness[kept.stop :: 2], along)


@pytest.mark.parametrize("held", [1.0, 0.5])
def test_what_the_factor_holds_and_what_goes_beside_it_is_the_hessian_of_now(held, monkeypatch, rng):
    monkeypatch.setattr("qlb.solvers.contact_base.NEAR", ((0.0, 1.0),))
    simulation = resting()
    now, then, x = moved(simulation, rng)
    assert 0 < now.count < then.count
    base = ContactBase.of(then, rng.random(len(then.terms().stiffness)) < held)
    terms, _ = base.difference(now, now.terms(), simulation.solver.inverse, 1.0)
    found = dense(base.held, len(x)) + dense(terms, len(x))
    wanted = dense(now.terms(), len(x))
    np.testing.assert_allclose(found, wanted, atol=1e-9 * np.abs(wanted).max())


def test_by_default_the_model_is_near_enough_along_every_direction(rng):
    simulation = resting()
    now, then, x = moved(simulation, rng)
    scale = 0.05 * then.terms().stiffness.max()
    base = ContactBase.of(then, np.ones(len(then.terms().stiffness), dtype=bool))
    terms, _ = base.difference(now, now.terms(), simulation.solver.inverse, scale)
    own = scale * np.eye(3 * len(x))  # stands for the bodies
    found = dense(base.held, len(x)) + dense(terms, len(x))
    model, wanted = own + found, own + dense(now.terms(), len(x))
    factor = np.linalg.inv(np.linalg.cholesky(model))
    spread = np.linalg.eigvalsh(factor @ wanted @ factor.T)
    assert spread.min() > 0.45
    assert spread.max() < 2.2
    assert np.count_nonzero(terms.stiffness) < len(then.terms().stiffness)


@pytest.mark.parametrize("crowd", [600, 60, 45, 1])
@pytest.mark.parametrize("softness", [1e-3, 0.05, 1.0])
def test_what_differs_is_what_numpy_finds(softness, crowd, rng, monkeypatch):
    """In a frame that has turned, by the dense sums of all terms beside the factor."""
    monkeypatch.setattr("qlb.solvers.contact_base.CROWD", crowd)
    simulation = resting()
    now, then, x = moved(simulation, rng)
    base = ContactBase.of(then, rng.random(len(then.terms().stiffness)) < 0.8)
    inverse, scale = simulation.solver.inverse, softness * then.terms().stiffness.max()
    inverse.carry(x @ (np.eye(3) + rng.uniform(-0.02, 0.02, size=(3, 3))), x, 0.0)
    terms, framed = base.difference(now, now.terms(), inverse, scale)
    lacking, change = reference_difference(base, now, inverse, scale)
    np.testing.assert_array_equal(terms.stiffness[: len(lacking)], lacking)
    assert framed == len(change[2])
    assert framed > 0
    assert np.count_nonzero(lacking) < len(lacking)
    others = terms.nodes[-framed:], terms.vectors[-framed:], terms.stiffness[-framed:]
    found, wanted = dense(others, len(x)), dense(change, len(x))
    np.testing.assert_allclose(found, wanted, atol=1e-9 * scale)


def test_the_more_terms_there_are_the_coarser_is_what_counts_as_near(rng, monkeypatch):
    simulation = resting()
    now, then, _ = moved(simulation, rng)
    base, inverse = ContactBase.of(then, np.ones(then.terms().size, dtype=bool)), simulation.solver.inverse
    scale = 0.05 * then.terms().stiffness.max()

    def terms_left(crowd: int) -> int:
        monkeypatch.setattr("qlb.solvers.contact_base.CROWD", crowd)
        return int(np.count_nonzero(base.difference(now, now.terms(), inverse, scale)[0].stiffness))

    fine, coarse = terms_left(10**6), terms_left(0)
    assert 0 < coarse < fine
    assert terms_left(fine) == fine
    assert coarse <= terms_left(fine - 1) < fine
    monkeypatch.setattr("qlb.solvers.contact_base.NEAR", ())
    with pytest.raises(ValueError, match="levels: none"):
        terms_left(1)


def test_a_base_out_of_order_is_refused(rng):
    simulation = resting()
    now, then, _ = moved(simulation, rng)
    base = ContactBase.of(then, np.ones(len(then.terms().stiffness), dtype=bool))
    for name in ("keys", "sliding"):
        broken = replace(base, **{name: getattr(base, name)[::-1].copy()})
        with pytest.raises(ValueError, match="must be ascending"):
            broken.difference(now, now.terms(), simulation.solver.inverse, 1.0)


def test_a_saved_base_comes_back(rng):
    _, then, _ = moved(resting(), rng)
    base = ContactBase.of(then, np.ones(len(then.terms().stiffness), dtype=bool))
    again = ContactBase.load(base.save())
    np.testing.assert_array_equal(again.keys, base.keys)
    np.testing.assert_array_equal(again.sliding, base.sliding)
    for part, expected in zip(arrays(again.terms), arrays(base.terms), strict=True):
        np.testing.assert_array_equal(part, expected)


def test_friction_that_a_step_has_turned_round_holds_along_its_slip():
    simulation = resting()
    x, slip = simulation.state.positions, np.array([1e-3, 0, 0])
    model = simulation.system.contact
    assert model is not None
    stage = Stage(STEP, STEP, ((1.0, x),), np.zeros_like(x))
    contact = StageContact(model, stage, STEP**2, Origin(x, STEP), Timer())
    before, turned, further = (contact.at(x + part * slip) for part in (1, -1, 2))
    across = turned.sliding_terms().stiffness[1::2]
    assert (turned.sliding_terms().stiffness[::2] < 0.3 * across).all()
    np.testing.assert_allclose(turned.after(before).sliding_terms().stiffness[::2], across)
    for point in (further.after(before), turned.after(replace(before, friction=None))):
        assert (point.sliding_terms().stiffness[::2] < 0.3 * point.sliding_terms().stiffness[1::2]).all()


def extended(solver: QLA, node: int) -> str:
    """The precision of the factor once its pattern is extended for a pair."""
    solver.factor.load({"stencils": np.array([[0.0, 1.0, node, 17.0]])})
    assert isinstance(solver.factor.cholesky, _native.SupernodalCholesky)
    return solver.factor.cholesky.precision


def test_a_factor_whose_pattern_is_extended_stays_in_single_precision():
    solver = resting().solver
    assert isinstance(solver, QLA)
    first = solver.factor.cholesky
    assert extended(solver, 16) == "compact"
    assert solver.factor.cholesky is not first
    assert solver.factor.raise_precision()
    assert extended(solver, 15) == "float64"


def test_contacts_that_last_stay_in_the_factor():
    """A block pressed by a plane: a factor that holds them serves for many steps, with few terms beside it."""
    plane = Plane((0, -0.05 - DHAT, 0), UP, motion=lambda x, time: x + np.array([0, 0.02 * time, 0]))
    body = block(material=SOFT, cells=(6, 3, 6))
    contact = Contact(dhat=DHAT)
    top = Plane((0, 0.05 + DHAT / 2, 0), (0.0, -1.0, 0.0))
    simulation = simulate(body, plane, top, solver="QLA", contact=contact, gravity=(0.0, 0.0, 0.0))
    results = list(simulation.run(40))
    assert all(result.converged for result in results)
    late = [solve for result in results[15:] for solve in result.solves]
    assert all(solve.rows[-1].contacts > 90 for solve in late)
    assert sum(solve.factorizations for solve in late) <= 0.4 * len(late)
    solver = simulation.solver
    assert isinstance(solver, QLA)
    assert np.mean([solve.rows[-1].columns for solve in late]) < 30
