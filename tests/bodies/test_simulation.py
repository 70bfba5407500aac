"""Bodies and obstacles through time."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import (
    Body,
    Damping,
    Fibres,
    InputError,
    Keyframes,
    MooneyRivlin,
    Obstacle,
    Placement,
    Plane,
    PointForce,
    Pressure,
    Rotation,
    Simulation,
    StableNeoHookean,
    State,
    Translation,
    VertexAnimation,
)
from tests.energies.user_energies import Springs
from tests.support import TIGHT, finish, left_end, small_bar

SOLVERS = ["ND", "QLF", "QLB", "QLA"]
INTEGRATORS = ["BDF1", "BDF2", "SDIRK2", "quasistatic"]
TRIANGLE = np.array([[5.0, 0, 0], [6, 0, 0], [5, 1, 0]])
TILT = Obstacle(TRIANGLE, [[0, 1, 2]], motion=Rotation((0, 0, 1), (5, 0, 0), 0.5), name="tilt")
SOFT = StableNeoHookean(young=2e4)


def pinned(simulation: Simulation, *bodies: int) -> Simulation:
    """`simulation` with the left ends of some bodies held."""
    for b in bodies or range(len(simulation.bodies)):
        nodes = simulation.nodes_of(b)
        simulation.pin(nodes[left_end(simulation.bodies[b].mesh)])
    return simulation


@pytest.mark.parametrize("solver", ["ND", "QLA"])
@pytest.mark.parametrize("integrator", ["BDF2", "SDIRK2"])
def test_two_bodies_far_apart_move_as_each_alone(solver, integrator):
    mesh = small_bar()
    first = Body(mesh, SOFT, fibres=[Fibres(modulus=1e4)])
    second = Body(
        mesh,
        MooneyRivlin(),
        velocity=(1.0, 0.5, 0),
        placement=Placement(scale=0.7, rotation=(0.1, 0.2, 0.3), translation=(0, 5, 0)),
    )
    settings = {
        "solver": solver,
        "integrator": integrator,
        "tolerance": TIGHT,
        "threads": 1,
        "damping": Damping(viscosity=2.0, mass=0.1, stiffness=1e-4),
    }
    together = finish(pinned(Simulation([first, second], **settings), 0), 8)
    alone = [
        finish(pinned(Simulation(first, **settings)), 8),
        finish(Simulation([second], **settings), 8),
    ]
    for name in ("positions", "velocities"):
        expected = np.concatenate([getattr(state, name) for state in alone])
        np.testing.assert_allclose(getattr(together, name), expected, atol=1e-8)
    assert np.abs(alone[1].positions - second.placed.positions).max() > 0.05


def test_a_mesh_and_a_body_of_it_are_the_same_to_the_bit():
    mesh = small_bar()
    velocity = np.random.default_rng(0).normal(size=mesh.positions.shape)
    a = Simulation(mesh, material=SOFT, fibres=[Fibres()], velocity=velocity, threads=1)
    b = Simulation([Body(mesh, SOFT, fibres=[Fibres()], velocity=velocity)], threads=1)
    assert a.mesh is mesh
    assert b.mesh is mesh
    np.testing.assert_array_equal(finish(a, 3).positions, finish(b, 3).positions)


def test_each_free_body_keeps_its_momentum():
    mesh = small_bar()
    spin = np.cross([0, 0, 3.0], mesh.positions)
    bodies = [
        Body(mesh, SOFT, velocity=spin - (-1, 0, 0)),
        Body(mesh, MooneyRivlin(density=500), velocity=-spin, placement=Placement(translation=(0, 3, 0))),
    ]
    simulation = Simulation(bodies, gravity=(0, 0, 0), tolerance=TIGHT, threads=1, obstacles=[TILT])
    mass = simulation.system.mass[:, None]
    before = simulation.state
    after = finish(simulation, 5)
    for b in (0, 1):
        nodes = simulation.nodes_of(b)
        expected = (mass * before.velocities)[nodes].sum(axis=0)
        np.testing.assert_allclose((mass * after.velocities)[nodes].sum(axis=0), expected, atol=1e-9)
    assert np.abs(expected).max() > 0.1


def test_loads_take_node_indices_of_the_whole():
    mesh = small_bar()
    bodies = [Body(mesh, SOFT), Body(mesh, SOFT, placement=Placement(translation=(0, 3, 0)))]
    simulation = Simulation(bodies, gravity=(0, 0, 0), obstacles=[TILT], threads=1)
    second = simulation.nodes_of(1)
    simulation.add(PointForce(second[:1], (0, 0, 1.0)))
    simulation.add(Pressure(simulation.mesh.faces_where(lambda x: x[:, 1] > 3.249), 100.0))
    state = finish(simulation, 2)
    np.testing.assert_allclose(state.positions[:16], mesh.positions, atol=1e-15)
    assert np.abs(state.positions[second] - bodies[1].placed.positions).max() > 1e-5


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("integrator", INTEGRATORS)
@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_an_obstacle_far_away_changes_nothing(solver, integrator, mass):
    # QLF and QLB do not get to statics of a bar that bends far, with or without obstacles: little gravity.
    states = []
    for obstacles in ((), (TILT, Plane((0, -9, 0), (0, 1, 0)))):
        simulation = Simulation(
            small_bar(),
            material=SOFT,
            solver=solver,
            integrator=integrator,
            mass=mass,
            gravity=lambda t: np.array([0, -5 * t, 0]),
            obstacles=obstacles,
            contact=False,
            threads=1,
        )
        states.append(finish(pinned(simulation), 4))
    np.testing.assert_allclose(states[1].positions[:16], states[0].positions, rtol=0, atol=1e-12)
    assert np.abs(states[0].positions - small_bar().positions).max() > 1e-6
    np.testing.assert_array_equal(states[1].positions[16:], TILT.motion(TRIANGLE, 4e-2))


MOTIONS = {
    "none": None,
    "translation": Translation((0, 1, 0)),
    "keyframes": Keyframes([0, 0.02, 0.05], translations=[[0, 0, 0], [1, 0, 0], [1, 1, 0]]),
    "animation": VertexAnimation([0.0, 0.03], [TRIANGLE, 2 * TRIANGLE]),
    "function": lambda x, t: x + np.sin(t),
    "elsewhere at first": lambda x, t: x + 1 + t,
}


@pytest.mark.parametrize("motion", MOTIONS.values(), ids=MOTIONS.keys())
@pytest.mark.parametrize("integrator", ["BDF2", "SDIRK2"])
def test_obstacles_are_where_their_motions_put_them(motion, integrator):
    obstacle = Obstacle(TRIANGLE, [[0, 1, 2]], motion=motion)
    simulation = Simulation(small_bar(), material=SOFT, obstacles=[obstacle], integrator=integrator, threads=1)
    nodes = simulation.nodes_of(obstacle)
    for state in [simulation.state, *simulation.run(5)]:
        expected = TRIANGLE if motion is None else motion(TRIANGLE, state.time)
        np.testing.assert_array_equal(state.positions[nodes], expected)


def test_velocities_of_an_obstacle_are_those_of_its_motion():
    obstacle = Obstacle(TRIANGLE, [[0, 1, 2]], motion=Translation((1, 2, 3)))
    simulation = Simulation(small_bar(), material=SOFT, obstacles=[obstacle], threads=1)
    state = finish(simulation, 3)
    np.testing.assert_allclose(state.velocities[simulation.nodes_of(obstacle)], [[1, 2, 3]] * 3, rtol=1e-12)


def test_the_nodes_of_an_obstacle_are_held_already():
    simulation = Simulation(small_bar(), material=SOFT, obstacles=[TILT])
    with pytest.raises(InputError, match="node 16 is held already"):
        simulation.pin(simulation.nodes_of("tilt"))


def test_a_wrong_motion_of_an_obstacle_is_refused_at_once():
    obstacle = Obstacle(TRIANGLE, [[0, 1, 2]], motion=lambda x, t: x[:2])
    with pytest.raises(InputError, match=r"a motion gave positions of shape \(2, 3\)"):
        Simulation(small_bar(), material=SOFT, obstacles=[obstacle])
    plane = Plane((0, 0, 0), (0, 1, 0), motion=lambda x, t: x * np.nan)
    with pytest.raises(InputError, match="the motion of a plane at time 0 s"):
        Simulation(small_bar(), material=SOFT, obstacles=[plane])


@pytest.mark.parametrize(("name", "value"), [("material", SOFT), ("fibres", [Fibres()]), ("velocity", (0, 0, 0))])
def test_what_bodies_have_themselves_is_refused_beside_them(name, value):
    with pytest.raises(InputError, match=f"{name} cannot be given beside bodies: each body has its own"):
        Simulation([Body(small_bar(), SOFT)], **{name: value})


def test_a_mesh_needs_a_material():
    with pytest.raises(InputError, match="material is missing: must be a Material"):
        Simulation(small_bar())


def test_the_material_of_several_bodies_is_not_one():
    one = Simulation([Body(small_bar(), SOFT)])
    assert one.material is SOFT
    assert one.fibres == ()
    several = Simulation([Body(small_bar(), SOFT), Body(small_bar(), SOFT)])
    with pytest.raises(InputError, match="there are 2 bodies, each with its own material"):
        _ = several.material


def test_a_restored_state_has_the_rows_of_obstacles():
    simulation = Simulation(small_bar(), material=SOFT, obstacles=[TILT])
    short = np.zeros((16, 3))
    with pytest.raises(InputError, match=r"shape of positions = \(16, 3\) is out of range: must be \(19, 3\)"):
        simulation.restore(State(0.0, short, short), 0, {})


def test_an_energy_may_tie_a_body_to_an_obstacle():
    carrier = Obstacle(TRIANGLE - [4, 0, 0], [[0, 1, 2]], motion=Translation((2, 0, 0)))
    simulation = Simulation(small_bar(), material=SOFT, gravity=(0, 0, 0), obstacles=[carrier], threads=1)
    hook = int(simulation.nodes_of(carrier)[0])
    end = int(np.argmax(simulation.mesh.positions[:, 0]))
    simulation.add(Springs([[end, hook]], stiffness=1e3, length=0.25))
    state = finish(simulation, 10)
    momentum = (simulation.system.mass[:, None] * state.velocities).sum(axis=0)
    assert momentum[0] > 0.1
