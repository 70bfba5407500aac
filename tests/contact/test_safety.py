"""Nothing passes through anything, in scenes made to break that; checked after every step."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Body, Contact, Obstacle, Plane, Rotation, StableNeoHookean, TetMesh, Translation, shapes
from tests.contact.scenes import SOFT, SOLVERS, UP, block, box_surface, checked, simulate
from tests.support import left_end, right_end

CUBE = (0.2, 0.2, 0.2)


def squeezed(kind: str, solver: str, speed: float = 0.25, **given):
    """A cube between two plates that close to half its height in 0.2 s, and stop."""
    dhat, motions = 2e-3, [UntilThen((0, side * speed, 0), 0.2) for side in (1, -1)]
    if kind == "planes":
        plates = [Plane((0, -s * 0.102, 0), (0, s, 0), motion=m) for s, m in zip((1, -1), motions, strict=True)]
    else:
        plates = [
            Obstacle(*box_surface((0.6, 0.1, 0.6), (0.01, -s * 0.152, 0.02)), motion=m)
            for s, m in zip((1, -1), motions, strict=True)
        ]
    body = block(CUBE, cells=(3, 3, 3), material=SOFT)
    return simulate(body, *plates, solver=solver, gravity=(0, 0, 0), contact=Contact(dhat=dhat), **given)


class UntilThen:
    """A translation that stops."""

    def __init__(self, velocity: tuple[float, float, float], stop: float) -> None:
        self.velocity, self.stop = np.asarray(velocity, dtype=float), stop

    def __call__(self, anchors, time):
        return anchors + min(time, self.stop) * self.velocity


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", ["planes", "plates"])
def test_a_block_squeezed_to_half(kind, solver):
    simulation = squeezed(kind, solver)
    for _ in checked(simulation, 24):
        pass
    body = simulation.state.positions[simulation.nodes_of(0)]
    assert np.ptp(body[:, 1]) < 0.104
    assert np.ptp(body[:, 0]) > 0.22


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("kind", ["plane", "plate"])
def test_impact_at_100_m_per_s(kind, solver):
    ground = Plane((0, 0, 0), UP) if kind == "plane" else Obstacle(*box_surface((2, 0.1, 2), (0.03, -0.05, 0.02)))
    material = StableNeoHookean(young=5e7, poisson=0.4, density=1000)
    body = block(CUBE, (0, 0.2, 0), cells=(2, 2, 2), rotation=(0.2, 0.1, 0.3), material=material, velocity=(0, -100, 0))
    simulation = simulate(body, ground, solver=solver, step=1e-3)
    surface = np.unique(body.mesh.boundary_triangles())
    lowest = [result.positions[surface, 1].min() for result in checked(simulation, 20)]
    assert 0 < min(lowest) < simulation.system.contact.dhat
    assert simulation.state.velocities[simulation.nodes_of(0), 1].mean() > 0  # on its way back


def needle(at, *, down: bool, edge: bool = False, thickness: float = 2e-3, **given) -> Body:
    """A thin pyramid of two tets, its tip exactly at `at`, or a wedge with its edge there along z."""
    s = 1.0 if down else -1.0
    base = np.array([[-1, 40 * s, -1], [1, 40 * s, -1], [1, 40 * s, 1], [-1, 40 * s, 1]], dtype=float)
    if edge:
        x = np.vstack([base, [[0, 0, -20], [0, 0, 20]]])
        tets = np.array([[0, 1, 4, 3], [1, 2, 5, 3], [1, 4, 3, 5]])
    else:
        x, tets = np.vstack([base, [[0, 0, 0]]]), np.array([[0, 1, 2, 4], [0, 2, 3, 4]])
    volumes = np.linalg.det(x[tets[:, 1:]] - x[tets[:, :1]])
    tets[volumes < 0] = tets[volumes < 0][:, [1, 0, 2, 3]]
    return Body(TetMesh(thickness * x + at, tets), StableNeoHookean(young=1e6, poisson=0.3), **given)


ALIGNED = {
    "spike on spike": (False, False),
    "spike on edge": (False, True),
    "edge on edge": (True, True),
}


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("case", ALIGNED.values(), ids=ALIGNED.keys())
def test_sharp_things_exactly_aligned(case, solver):
    upper = needle((0, 2e-3, 0), down=True, edge=case[0], velocity=(0, -2, 0))
    lower = needle((0, 0, 0), down=False, edge=case[1])
    contact = Contact(dhat=5e-4)
    simulation = simulate([upper, lower], solver=solver, step=5e-4, gravity=(0, 0, 0), contact=contact)
    simulation.pin(simulation.nodes_of(1)[:4])
    contacts = [result.solves[-1].contact.count for result in checked(simulation, 20)]
    assert max(contacts) > 0
    # the tip of the upper one is not below that of the lower one beside it: it was stopped or went past
    moved = simulation.state.velocities[simulation.nodes_of(0), 1].mean()
    assert moved > -1.9


@pytest.mark.parametrize("solver", SOLVERS)
@pytest.mark.parametrize("shift", [(0.0, 0.0, 0.0), (0.05, 0.0, 0.0), (0.1, 0.0, 0.1)], ids=["whole", "half", "cell"])
def test_cubes_with_faces_edges_and_vertices_exactly_over_each_other(shift, solver):
    upper = block(CUBE, (shift[0], 0.21, shift[2]), cells=(2, 2, 2), material=SOFT, velocity=(0, -1, 0))
    lower = block(CUBE, cells=(2, 2, 2), material=SOFT)
    ground = Plane((0, -0.101, 0), UP)
    simulation = simulate([lower, upper], ground, solver=solver, contact=Contact(dhat=2e-3))
    contacts = [result.solves[-1].contact.count for result in checked(simulation, 15)]
    assert max(contacts) >= 9


def twisting(turns: float, way: float):
    """A motion that turns an end about the x axis and brings it nearer, in one second."""

    def at(anchors, time):
        turn = Rotation((1, 0, 0), (0, 0.02, 0.02), turns, stop=1.0)(anchors, time)
        return turn + min(time, 1.0) * np.array([way, 0, 0])

    return at


def test_a_bar_twisted_two_turns_into_itself():
    """Each end makes a turn, against each other's way; the ends come nearer, and the bar winds about itself."""
    mesh = TetMesh.box((0.6, 0.04, 0.04), cells=(24, 2, 2))
    body = Body(mesh, StableNeoHookean(young=2e4, poisson=0.35, density=1000))
    simulation = simulate(body, step=0.02, contact=Contact(), integrator="BDF1", gravity=(0, -1, 0))
    simulation.move(left_end(mesh), twisting(1.0, 0.2))
    simulation.move(right_end(mesh), twisting(-1.0, -0.2))
    contacts = [result.solves[-1].contact.count for result in checked(simulation, 52)]
    assert max(contacts) > 20


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["ND", "QLA"])
def test_ten_boxes_heavy_above_light(solver):
    """Densities from 100 below to 10000 above."""
    bodies = [
        block(
            (0.1, 0.1, 0.1),
            (0.0, 0.0505 + 0.1005 * k, 0.0),
            rotation=(0.0, 0.3 * k, 0.0),
            cells=(2, 2, 2),
            material=StableNeoHookean(young=1e6, poisson=0.3, density=density),
        )
        for k, density in enumerate(np.geomspace(100, 10000, 10))
    ]
    simulation = simulate(bodies, Plane((0, 0, 0), UP), solver=solver, contact=Contact(friction=0.3))
    for _ in checked(simulation, 40):
        pass
    tops = [simulation.state.positions[simulation.nodes_of(k), 1].mean() for k in range(10)]
    assert (np.diff(tops) > 0.08).all()


def funnel(top: float, bottom: float, height: float, wall: float = 0.02, sides: int = 24) -> tuple:
    """A closed surface: a ring between two cones about the y axis, its lower end at 0."""
    angle = 2 * np.pi * np.arange(sides) / sides
    rings = [(bottom, 0.0), (top, height), (top + wall, height), (bottom + wall, 0.0)]
    x = np.concatenate([np.stack([r * np.cos(angle), 0 * angle + y, r * np.sin(angle)], axis=1) for r, y in rings])
    k, faces = np.arange(sides), []
    for ring in range(4):
        a, b = sides * ring, sides * ((ring + 1) % 4)
        faces += [np.stack([a + k, b + k, b + (k + 1) % sides], axis=1)]
        faces += [np.stack([a + k, b + (k + 1) % sides, a + (k + 1) % sides], axis=1)]
    return x, np.concatenate(faces)


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["ND", "QLA"])
def test_a_ball_through_a_tight_moving_funnel(solver):
    """A neck of three quarters of the ball comes over it from below, while a rod above holds the ball back."""
    ball = Body(shapes.ball(0.1, tets=1500), SOFT, name="ball")
    x, triangles = funnel(0.16, 0.075, 0.2)
    tube = Obstacle(x - [0, 0.25, 0], triangles, motion=Translation((0, 0.5, 0)), name="funnel")
    rod = Obstacle(*box_surface((0.04, 0.5, 0.04), (0, 0.36, 0)), name="rod")
    touching = Contact(dhat=2e-3, friction=0.1)
    simulation = simulate(ball, tube, rod, solver=solver, gravity=(0, 0, 0), contact=touching, step=0.01)
    for _ in checked(simulation, 60):
        pass
    ball_y, tube_y = (simulation.state.positions[simulation.nodes_of(k), 1] for k in ("ball", "funnel"))
    assert ball_y.min() < tube_y.max() - 0.1, "the ball is not in it"
