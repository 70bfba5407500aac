"""What contact refuses, warns of, or stops at; and what its settings mean."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import (
    Body,
    Contact,
    ContactPair,
    InputError,
    Obstacle,
    Plane,
    QlbWarning,
    Reason,
    StepFailed,
    TetMesh,
    Translation,
)
from tests.contact.scenes import SOFT, SOLVERS, STIFF, UP, block, box_surface, checked, simulate

CUBE = (0.2, 0.2, 0.2)


def closing(kind: str, solver: str, gap_at_end: float = 0.0, **given):
    """A floor, and a press that comes down on a cube until the gap between both is `gap_at_end` [m]."""
    press = Translation((0.0, -1.0, 0.0))
    if kind == "plane":
        moving: Plane | Obstacle = Plane((0, 0.11, 0), (0, -1, 0), motion=press, name="press")
    else:
        moving = Obstacle(*box_surface((0.6, 0.1, 0.6), (0, 0.16, 0)), motion=press, name="press")
    floor = Plane((0, -0.105, 0), UP, name="floor")
    body = block(CUBE, cells=(2, 2, 2), material=SOFT, name="cube")
    return simulate(body, floor, moving, solver=solver, step=0.01, contact=Contact(dhat=2e-3), **given)


@pytest.mark.parametrize("solver", ["ND"])
@pytest.mark.parametrize("kind", ["plane", pytest.param("plate", marks=pytest.mark.slow)])
def test_a_script_that_closes_a_gap_to_nothing_is_stopped(kind, solver):
    simulation, states = closing(kind, solver), []
    with pytest.raises(StepFailed) as caught:
        states.extend(checked(simulation, 40))
    failed = caught.value.result
    assert failed.reason is Reason.MOTION_BLOCKED
    detail = next(s.detail for s in failed.solves if s.reason is Reason.MOTION_BLOCKED)
    assert "press" in detail
    assert "cube" in detail
    assert "gap" in detail
    assert 10 <= len(states) == simulation.steps_done <= 21
    assert simulation.state.time == pytest.approx(0.01 * len(states))
    np.testing.assert_array_equal(simulation.state.positions, states[-1].positions)


def test_start_states_that_intersect_are_refused_with_the_pair():
    a, b = block(CUBE, name="a"), block(CUBE, (0.15, 0.05, 0.02), name="b")
    with pytest.raises(InputError, match=r"start state intersects: edge \([ab] node \d+ - .*passes through face"):
        simulate([a, b]).advance()
    plate = Obstacle(*box_surface((1, 0.1, 1), (0.03, -0.1, 0.02)), name="plate")
    with pytest.raises(InputError, match=r"intersects.*(a node \d+.*plate node|plate node \d+.*a node)"):
        simulate(a, plate).advance()
    with pytest.raises(InputError, match=r"a node \d+ is 0\.02 m behind floor \(and \d+ more nodes\)"):
        simulate(a, Plane((0, -0.08, 0), UP, name="floor")).advance()
    with pytest.raises(InputError, match="behind floor"):  # touching is refused, too
        simulate(a, Plane((0, -0.1, 0), UP, name="floor")).advance()


def test_a_body_wholly_inside_another_or_behind_a_plane():
    outer = block((0.6, 0.6, 0.6), name="outer")
    with pytest.raises(InputError, match="behind floor"):
        simulate(outer, Plane((0, 5, 0), UP, name="floor")).advance()


def test_dhat_larger_than_a_feature_warns_with_numbers():
    thin = block((0.2, 0.01, 0.2), cells=(4, 1, 4), name="sheet")
    with pytest.warns(QlbWarning, match=r"dhat = 0\.02 m is larger than features.*down to 0\.00962\d* m \(sheet node"):
        system = simulate(thin, Plane((0, -0.1, 0), UP), contact=Contact(dhat=0.02)).system
    start = system.rest
    at_rest = system.contact.evaluate(start, np.array([-10.0]), 1.0, np.zeros_like(start))
    assert at_rest.size == 0


@pytest.mark.parametrize("solver", SOLVERS)
def test_what_may_not_collide_passes(solver):
    ghost, wall = block(CUBE, (-0.25, 0, 0), velocity=(4.0, 0, 0), name="ghost"), block(CUBE, name="wall")
    floor = Plane((0, -0.05, 0), UP, name="floor")
    pairs = [ContactPair(between=(a, b), collide=False) for a, b in (("ghost", "wall"), ("floor", "wall"))]
    pairs.append(ContactPair(between=("ghost", "floor"), collide=False))
    simulation = simulate([ghost, wall], floor, solver=solver, gravity=(0, 0, 0), contact=Contact(pairs=pairs))
    simulation.pin(simulation.nodes_of("wall"))
    for result in simulation.run(12):
        assert result.solves[-1].contact.count == 0
    centre = simulation.state.positions[simulation.nodes_of("ghost"), 0].mean()
    assert centre == pytest.approx(-0.25 + 4 * 0.12, rel=1e-6)


def test_a_body_without_self_contact_may_fold_through_itself():
    body = block(CUBE, cells=(2, 2, 2))
    for own, expected in ((True, True), (False, False)):
        simulation = simulate(body, contact=Contact(self_contact=own))
        x = simulation.system.rest.copy()
        x[:, 1] *= -1  # inside out: faces of opposite sides still do not meet
        x[x[:, 0] > 0.05, 0] -= 0.25
        assert (simulation.system.contact.intersection(x, 0.0) is not None) == expected


def test_defaults_follow_the_meshes():
    a = Body(TetMesh.box(CUBE, cells=(2, 3, 4)), SOFT)
    b = block(CUBE, (1, 0, 0), material=STIFF)
    plate = Obstacle(*box_surface((9, 1, 9), (0, -3, 0)))
    model = simulate([a, b], plate).system.contact
    lengths = []
    for body in (a, b):
        x, faces = body.placed.positions, body.placed.boundary_triangles()
        edges = np.unique(np.sort(faces[:, [[0, 1], [1, 2], [2, 0]]].reshape(-1, 2), axis=1), axis=0)
        lengths.append(np.linalg.norm(x[edges[:, 0]] - x[edges[:, 1]], axis=1))
    assert model.dhat == pytest.approx(0.1 * np.concatenate(lengths).mean(), rel=1e-12)
    assert model.stiffness == 1e6
    everything = np.concatenate([a.placed.positions, b.placed.positions])
    assert model.friction_velocity == pytest.approx(1e-3 * np.linalg.norm(np.ptp(everything, axis=0)), rel=1e-12)
    given = simulate([a, b], contact=Contact(dhat=1e-3, stiffness=5.0, friction_velocity=0.1)).system.contact
    assert (given.dhat, given.stiffness, given.friction_velocity) == (1e-3, 5.0, 0.1)


def test_one_body_alone_has_no_contact_unless_asked():
    body = block(CUBE)
    assert simulate(body, contact=None).system.contact is None
    assert simulate(body).system.contact is not None
    assert simulate([body, block(CUBE, (1, 0, 0))], contact=False).system.contact is None


@pytest.mark.parametrize(
    ("pair", "message"),
    [
        ({"between": ("cube", "rock")}, r"contact\.pairs\.0: 'rock' is not known: must be one of cube, floor, wall"),
        ({"between": ("floor", "wall")}, r"contact\.pairs\.0: neither 'floor' nor 'wall' is a body"),
    ],
)
def test_pairs_that_do_not_exist_are_refused(pair, message):
    planes = Plane((0, -1, 0), UP, name="floor"), Plane((-1, 0, 0), (1, 0, 0), name="wall")
    with pytest.raises(InputError, match=message):
        _ = simulate(block(name="cube"), *planes, contact=Contact(pairs=[ContactPair(**pair)])).system


@pytest.mark.parametrize(
    "wrong",
    [{"dhat": 0.0}, {"dhat": -1.0}, {"stiffness": 0.0}, {"friction": -0.1}, {"friction_passes": 0}, {"mode": "glue"},
     {"friction_velocity": 0.0}, {"pairs": "a b"}, {"pairs": [{"between": ("a",)}]}],
)  # fmt: skip
def test_settings_out_of_range_are_named(wrong):
    with pytest.raises(InputError, match=next(iter(wrong))):
        Contact(**wrong)


def test_penalty_mode_does_not_refuse_a_start_that_intersects():
    a, b = block(CUBE, name="a"), block(CUBE, (0.197, 0.05, 0.02), name="b")
    simulation = simulate([a, b], contact=Contact(mode="penalty"), gravity=(0, 0, 0))
    gap = [r.positions[simulation.nodes_of(1), 0].mean() - r.positions[simulation.nodes_of(0), 0].mean()
           for r in simulation.run(5)]  # fmt: skip
    assert min(gap) > 0.197
