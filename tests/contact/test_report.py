"""Forces of contact that a step reports, held against laws of mechanics; checks, and failures that name the pair."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest

import qlb
from qlb import (
    Body,
    Contact,
    ContactPair,
    InputError,
    Obstacle,
    Placement,
    Plane,
    Simulation,
    StepFailed,
    StepResult,
    Tolerance,
)
from qlb.results import Run, RunWriter

H = 5e-3
G = np.array([0.0, -9.81, 0.0])
BLOCK = qlb.TetMesh.box((0.2, 0.1, 0.2), cells=(2, 1, 2))
JELLY = qlb.StableNeoHookean(young=2e5, poisson=0.3)
GROUND = Plane((0, 0, 0), (0, 1, 0), name="ground")
EXACT = Tolerance(relative=1e-8, step=0)


def block(height: float, name: str = "block", velocity: tuple[float, float, float] = (0, 0, 0), x: float = 0) -> Body:
    return Body(BLOCK, JELLY, placement=Placement(translation=(x, height, 0)), name=name, velocity=velocity)


def simulate(*bodies: Body, **settings) -> Simulation:
    defaults = {"obstacles": [GROUND], "integrator": "BDF1", "solver": "ND", "step": H, "tolerance": EXACT}
    return Simulation(list(bodies), **defaults | {"threads": 1} | settings)


def record(simulation: Simulation, directory: Path, steps: int) -> list[StepResult]:
    results = []
    with RunWriter(directory, {"scene": "mine"}, simulation) as writer:
        for result in simulation.run(steps):
            writer.record(result)
            results.append(result)
    return results


def test_forces_of_contact_are_what_changes_momentum_beside_gravity():
    """Newton's second law for each body, in the form that BDF1 has it: M (v - v_k)/h = M g + contact."""
    ramp = Obstacle(
        [[0.225, 0.001, -1], [1, 0.3, -1], [1, 0.3, 2], [0.225, 0.001, 2]], [[0, 2, 1], [0, 3, 2]], name="ramp"
    )
    bodies = block(0.004, "low", (1.0, 0, 0.2)), block(0.11, "high", (1.0, 0, 0), x=0.02)
    simulation = simulate(*bodies, obstacles=[GROUND, ramp], contact=Contact(friction=0.4))
    mass = simulation.system.mass[:, None]
    pushed = set()
    for _ in range(24):
        before = simulation.state
        result = simulation.advance()
        total = np.zeros(3)
        for body in bodies:
            nodes = simulation.nodes_of(body)
            change = (mass * (result.velocities - before.velocities))[nodes].sum(axis=0) / H
            force = result.contact.on(body)
            np.testing.assert_allclose(force, change - mass[nodes].sum() * G, atol=2e-4)
            total += force
        for name in ("low", "high", "ground", "ramp"):
            pushed |= {name} if np.abs(result.contact.on(name)).max() > 1 else set()
        total += result.contact.on(GROUND) + result.contact.on(ramp)
        np.testing.assert_allclose(total, 0, atol=1e-9)
    assert pushed == {"low", "high", "ground", "ramp"}


@pytest.mark.parametrize("integrator", ["BDF2", "SDIRK2", "quasistatic"])
def test_a_body_at_rest_weighs_on_the_ground(integrator):
    simulation = simulate(block(0.009), integrator=integrator, step=1e-2, damping=qlb.Damping(mass=50, stiffness=0.02))
    if integrator == "quasistatic":
        simulation.pin(simulation.mesh.nodes_where(lambda x: x[:, 1] > 0.1), axes="xz")
    contact = list(simulation.run(120))[-1].contact
    weight = simulation.system.mass.sum() * 9.81
    np.testing.assert_allclose(contact.on("ground"), [0, -weight, 0], atol=1e-3 * weight)
    np.testing.assert_allclose(contact.on("block"), -contact.on("ground"), atol=1e-10)
    below = contact.forces[:, 1] > 0
    np.testing.assert_array_equal(np.flatnonzero(below), simulation.mesh.nodes_where(lambda x: x[:, 1] < 0.01))
    assert contact.count == below.sum()
    assert 0 < contact.minimum_distance < simulation.system.contact.dhat


def test_each_plane_has_its_own_share_of_friction():
    """A block that slides along the edge between two planes: mu times the normal force of each, against the slip."""
    wall = Plane((-0.004, 0, 0), (1, 0, 0), name="wall")
    pairs = [
        ContactPair(between=("block", "wall"), friction=0.1),
        ContactPair(between=("block", "ground"), friction=0.4),
    ]
    simulation = simulate(
        block(0.004, velocity=(0, 0, 5.0)),
        step=2e-2,
        obstacles=[GROUND, wall],
        gravity=(-5.0, -9.81, 0),
        contact=Contact(pairs=pairs, friction_passes=4),
    )
    for result in simulation.run(30):
        contact = result.contact
    floor, side = contact.on("ground"), contact.on("wall")
    assert floor[1] < -1
    assert side[0] < -1
    assert floor[2] == pytest.approx(-0.4 * floor[1], rel=0.02)
    assert side[2] == pytest.approx(-0.1 * side[0], rel=0.02)
    np.testing.assert_allclose(contact.plane_forces, [floor, side])
    np.testing.assert_allclose(floor + side + contact.on("block"), 0, atol=1e-10)


def test_who_can_be_asked_for():
    simulation = simulate(block(0.004, ""), obstacles=[Plane((0, 0, 0), (0, 1, 0))])
    contact = simulation.advance().contact
    np.testing.assert_array_equal(contact.on(0), contact.on("body 0"))
    np.testing.assert_array_equal(contact.on(simulation.bodies[0]), contact.on(0))
    np.testing.assert_array_equal(contact.on("plane 0"), contact.plane_forces[0])
    with pytest.raises(InputError, match=r"'floor' is not known: must be one of body 0, plane 0"):
        contact.on("floor")
    with pytest.raises(InputError, match=r"the plane is not among"):
        contact.on(GROUND)
    with pytest.raises(InputError, match=r"group 3 is out of range"):
        contact.on(3)


def test_without_contact_there_is_no_report():
    simulation = simulate(block(0.004), contact=False)
    assert simulation.advance().contact is None


def test_penalties_report_their_forces():
    simulation = simulate(block(0.0005), contact=Contact(mode="penalty", dhat=2e-3))
    before = simulation.state
    result = simulation.advance()
    change = (simulation.system.mass[:, None] * (result.velocities - before.velocities)).sum(axis=0) / H
    force = result.contact.on("block")
    np.testing.assert_allclose(force, change - simulation.system.mass.sum() * G, atol=1e-4)
    assert force[1] > 1


def test_frames_hold_the_forces_and_the_summary_the_distance(tmp_path):
    simulation = simulate(block(0.004), contact=Contact(friction=0.2))
    results = record(simulation, tmp_path / "run", 4)
    run = Run(tmp_path / "run")
    assert run.frame(0).contact_forces is None
    for result in results:
        frame = run.frame(result.step)
        np.testing.assert_array_equal(frame.contact_forces, result.contact.forces)
        np.testing.assert_array_equal(frame.plane_forces, result.contact.plane_forces)
    assert run.summary["minimum_distance"] == min(r.contact.minimum_distance for r in results)
    assert run.summary["contact"]["dhat"] == simulation.system.contact.dhat
    last = np.flatnonzero(np.diff(run.stats["step"], append=-1))
    assert run.stats["contacts"][last].tolist() == [r.contact.count for r in results]


def test_a_check_stops_where_a_body_has_passed_through_the_ground():
    contact = Contact(mode="penalty", stiffness=10.0, check=True)
    simulation = simulate(block(0.02, velocity=(0, -3.0, 0)), contact=contact, tolerance=Tolerance())
    with pytest.raises(StepFailed, match=r"^step \d+ \(time \S+ s\) intersects: block node \d+ is \S+ m behind ground"):
        list(simulation.run(20))
    assert 0 < simulation.steps_done < 20
    assert simulation.system.contact.intersection(simulation.state.positions, simulation.state.time) is None


def test_a_check_names_the_bodies_that_pass_through_each_other(tmp_path):
    contact = Contact(mode="penalty", stiffness=1.0, check=True)
    bodies = block(0.5, "low"), block(0.62, "high", (0.3, -6.0, 0.2))
    simulation = simulate(*bodies, contact=contact, gravity=(0, 0, 0), tolerance=Tolerance())
    with pytest.raises(StepFailed, match="intersects: edge") as caught:
        record(simulation, tmp_path / "run", 20)
    assert "low" in str(caught.value)
    assert "high" in str(caught.value)
    run = Run(tmp_path / "run")
    assert (run.summary["status"], run.summary["converged"]) == ("failed", False)
    assert run.frame_steps == list(range(simulation.steps_done + 1))


def test_a_check_lets_contact_pass():
    contact = Contact(friction=0.3, check=True)
    assert len(list(simulate(block(0.02, velocity=(0.5, -3.0, 0)), contact=contact).run(8))) == 8


def test_a_script_that_leaves_no_room_is_stopped_in_words(tmp_path):
    lid = Plane((0, 0.11, 0), (0, -1, 0), motion=qlb.Translation((0, -10.0, 0)), name="lid")
    simulation = simulate(block(0.004), obstacles=[GROUND, lid], integrator="BDF1", tolerance=Tolerance())
    with pytest.raises(StepFailed, match=r"motion_blocked.*scripted motion can go only \S+ % of its way"):
        record(simulation, tmp_path / "run", 4)
    run = Run(tmp_path / "run")
    assert "scripted motion" in run.summary["error"]
    assert run.frame_steps == list(range(simulation.steps_done + 1))


def test_friction_of_contacts_that_have_come_apart_fits_into_newtons_matrix():
    """Its normals and nodes are those of the last solve, so that its stencils need not be among the contacts of now."""
    bodies = block(0.002, "low", (0.3, 0, 0)), block(0.11, "high", x=0.01)
    simulation = simulate(*bodies, contact=Contact(friction=0.3), integrator="SDIRK2", step=1e-2, tolerance=Tolerance())
    assert all(result.converged for result in simulation.run(60))
