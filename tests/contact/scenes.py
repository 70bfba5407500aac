"""Scenes of contact through time, and an independent check of every step: IPC Toolkit and plane distances."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import ipctk
import numpy as np

from qlb import (
    Body,
    Contact,
    Obstacle,
    Placement,
    Plane,
    Simulation,
    SolverSettings,
    StableNeoHookean,
    StepResult,
    TetMesh,
    Tolerance,
)
from qlb.integrators.sdirk2 import A
from tests.support import Array

SOLVERS = ["ND", "QLB", "QLA"]
BEST_NEWTON = SolverSettings(projection="on-demand", initial_guess="predictor")
BY_GRADIENT = Tolerance(relative=1e-7, step=0.0)
SOFT = StableNeoHookean(young=2e4, poisson=0.4, density=1000)
STIFF = StableNeoHookean(young=1e6, poisson=0.3, density=1000)
UP = (0.0, 1.0, 0.0)


def simulate(bodies: Body | Sequence[Body], *obstacles: Obstacle | Plane, solver: str = "ND", **given) -> Simulation:
    """One thread, contact on, SDIRK2; Newton at its best."""
    settings = BEST_NEWTON if solver == "ND" else SolverSettings(max_iterations=1500)
    defaults = {"contact": Contact(), "integrator": "SDIRK2", "threads": 1, "solver_settings": settings}
    return Simulation(bodies, obstacles=obstacles, solver=solver, **(defaults | given))


def block(
    size: tuple[float, float, float] = (0.2, 0.1, 0.2),
    at: tuple[float, float, float] = (0.0, 0.0, 0.0),
    *,
    cells: tuple[int, int, int] = (2, 1, 2),
    material: StableNeoHookean = STIFF,
    rotation: tuple[float, float, float] = (0.0, 0.0, 0.0),
    **given,
) -> Body:
    """A box whose middle is `at`, turned about it."""
    mesh = TetMesh.box(size, cells=cells)
    shift = tuple(np.asarray(at) - 0.5 * np.asarray(size))
    return Body(mesh, material, placement=Placement(rotation=rotation, translation=shift), **given)


def box_surface(size: Sequence[float], at: Sequence[float] = (0.0, 0.0, 0.0)) -> tuple[Array, Array]:
    """Vertices and outward triangles of a box, two triangles a side."""
    mesh = TetMesh.box(tuple(size), cells=(1, 1, 1))
    return mesh.positions - 0.5 * np.asarray(size) + np.asarray(at), mesh.boundary_triangles()


class Watch:
    """Says of positions whether anything passes through anything, without qlb's contact code."""

    def __init__(self, simulation: Simulation) -> None:
        ipctk.set_num_threads(1)
        system = simulation.system
        faces = np.asfortranarray(system.surface_faces)
        self.mesh = ipctk.CollisionMesh(np.asfortranarray(system.rest), ipctk.edges(faces), faces)
        self.planes = simulation.assembly.planes
        self.surface = np.unique(faces[: len(simulation.mesh.boundary_triangles())])

    def require_apart(self, positions: Array, time: float) -> None:
        assert not ipctk.has_intersections(self.mesh, np.asfortranarray(positions)), f"at {time:g} s"
        for plane in self.planes:
            gaps = (positions[self.surface] - plane.point_at(time)) @ np.asarray(plane.normal)
            assert gaps.min() > 0, f"{gaps.min():.3g} m behind {plane.name} at {time:g} s"


def checked(simulation: Simulation, steps: int) -> Iterator[StepResult]:
    """`simulation.run`, each step converged and checked."""
    watch = Watch(simulation)
    watch.require_apart(simulation.state.positions, simulation.state.time)
    for result in simulation.run(steps):
        assert result.converged
        assert np.isfinite(result.positions).all()
        watch.require_apart(result.positions, result.time)
        yield result


def finish_checked(simulation: Simulation, steps: int) -> StepResult:
    """The last of `steps` checked steps."""
    return list(checked(simulation, steps))[-1]


def contact_forces(simulation: Simulation, result: StepResult) -> Array:
    """Contact and friction at the end of a step, on every node [N], shape (n, 3); of BDF1 and SDIRK2."""
    c = {"BDF1": 1.0, "SDIRK2": A, "quasistatic": 0.0}[simulation.integrator.name] * simulation.step
    point = result.solves[-1].contact
    assert point is not None
    return -point.gradient / (c**2 if c else 1.0)
