"""The time loop, and the one door for scripts."""

from __future__ import annotations

import os
from collections.abc import Iterable, Iterator, Sequence
from dataclasses import replace
from typing import Literal, TypeVar

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray, vectors
from qlb.bodies import Body, Obstacle, Plane
from qlb.bodies.assembly import assemble
from qlb.contact import Contact
from qlb.contact.report import ContactReport
from qlb.energies import Acceleration, Damping, Energy
from qlb.errors import InputError
from qlb.integrators import INTEGRATORS, Integrator, Origin, State
from qlb.materials import Fibres, Material
from qlb.mesh.tet_mesh import TetMesh
from qlb.solvers import SOLVERS, Descent, SolveResult, SolverSettings, Tolerance
from qlb.step_result import StepFailed, StepResult, failure_message
from qlb.system import HeldNodes, Motion, StageProblem, System
from qlb.system.system import MassKind
from qlb.timing import Timer

T = TypeVar("T")
OnFailure = Literal["stop", "halve", "accept"]
MAX_HALVINGS = 8


class Simulation:
    """One or several elastic bodies, integrated through time.

    Args:
        bodies: the mesh of one body at rest, where it starts; or one or several `Body`, each with its own mesh,
            material, fibres and initial velocity.
        material: a hyperelastic material, for a mesh.
        fibres: families of fibres that are added to it.
        obstacles: surfaces and planes that stand still or move by a script. They are given here and not added later,
            because their vertices are nodes of the system, behind those of the bodies: arrays over nodes have their
            final length from the start.
        integrator: "BDF1", "BDF2", "SDIRK2" or "quasistatic".
        solver: "QLA" (the fastest), or "ND", "QLF", "QLB" as in the paper.
        step: h [s], > 0.
        gravity: acceleration [m/s^2], shape (3,), or a function of time [s] that gives it.
        velocity: initial velocity of a mesh [m/s], shape (3,) or (n, 3); at rest by default.
        mass: "lumped" or "consistent".
        damping: Rayleigh's two kinds and Kelvin-Voigt viscosity; none by default.
        contact: how bodies touch themselves, each other and obstacles; False for not at all. By default `Contact()`
            where there are several bodies or an obstacle, and not at all for one body alone.
        tolerance: when a solve has converged.
        solver_settings: settings of the solver.
        on_failure: what to do about a step that does not converge: "stop" raises `StepFailed`; "halve" takes it in two
            halves, and those again, down to h/256, before it raises; "accept" goes on from where it ended, marked as
            not converged.
        threads: for the kernels and BLAS; all that this process may use if None.

    Raises:
        InputError: an argument is out of range; the message names it.
    """

    def __init__(
        self,
        bodies: TetMesh | Body | Sequence[Body],
        *,
        material: Material | None = None,
        fibres: Sequence[Fibres] = (),
        obstacles: Iterable[Obstacle | Plane] = (),
        integrator: str = "BDF2",
        solver: str = "QLA",
        step: float = 1e-2,
        gravity: Acceleration = (0.0, -9.81, 0.0),
        velocity: npt.ArrayLike | None = None,
        mass: MassKind = "lumped",
        damping: Damping | None = None,
        contact: Contact | Literal[False] | None = None,
        tolerance: Tolerance | None = None,
        solver_settings: SolverSettings | None = None,
        on_failure: OnFailure = "stop",
        threads: int | None = None,
    ) -> None:
        self._integrator = _choose("integrator", integrator, INTEGRATORS)()
        self._solver_class = _choose("solver", solver, SOLVERS)
        _require("step", step, "> 0 s", _is_number(step) and step > 0)
        _require("damping", damping, "a Damping", isinstance(damping, Damping | None))
        _require("mass", mass, "'lumped' or 'consistent'", mass in ("lumped", "consistent"))
        _require("on_failure", on_failure, "'stop', 'halve' or 'accept'", on_failure in ("stop", "halve", "accept"))
        _require("threads", threads, ">= 1", threads is None or (isinstance(threads, int) and threads >= 1))
        _require("tolerance", tolerance, "a Tolerance", isinstance(tolerance, Tolerance | None))
        _require("contact", contact, "a Contact or False", contact is False or isinstance(contact, Contact | None))
        settings_fit = isinstance(solver_settings, SolverSettings | None)
        _require("solver_settings", solver_settings, "a SolverSettings", settings_fit)
        self.assembly = assemble(bodies, material, fibres, velocity, obstacles)
        self.mesh = self.assembly.mesh
        """All bodies at rest, n nodes; those of one body after the other."""
        self.step = float(step)
        self.gravity = gravity if callable(gravity) else tuple(vectors("gravity", gravity, (3,)))
        self.mass: MassKind = mass
        self.damping = damping or Damping()
        if contact is None and (len(self.assembly.bodies) > 1 or self.assembly.obstacles or self.assembly.planes):
            contact = Contact()
        self.contact: Contact | None = contact or None
        self.tolerance = tolerance or Tolerance()
        self.solver_settings = solver_settings or SolverSettings()
        self.on_failure: OnFailure = on_failure
        self.threads = threads or available_threads()
        self.timer = Timer()
        """Wall-clock seconds by part, from the first step on."""
        self._held = HeldNodes(len(self.assembly.system_mesh.positions))
        self._energies: list[Energy] = []
        self._steps_done = 0
        self._contact_now: ContactReport | None = None
        self._state = self._initial_state()
        self._system: System | None = None
        self._solver: Descent | None = None

    def _initial_state(self) -> State:
        """At rest; obstacles where their motions have them at time 0."""
        whole = self.assembly
        positions = whole.system_mesh.positions
        for obstacle in whole.obstacles:
            self._held.hold(whole.nodes_of(obstacle), positions, obstacle.motion)
        if any(obstacle.motion is not None for obstacle in whole.obstacles):
            positions = self._held.place(positions, 0.0)
        for plane in whole.planes:
            plane.point_at(0.0)
        return State(0.0, positions, whole.velocities())

    def nodes_of(self, body: int | str | Body | Obstacle) -> IntArray:
        """Nodes of a body or obstacle, given itself, its name, or its number: bodies from 0, then obstacles.

        Raises:
            InputError: there is no such body or obstacle.
        """
        return self.assembly.nodes_of(body)

    def pin(self, nodes: npt.ArrayLike, axes: str = "xyz") -> None:
        """Hold nodes where they are now, in all or some directions. Raises `InputError` (see `HeldNodes.hold`)."""
        self._before_first_step("pin nodes")
        self._held.hold(nodes, self._state.positions, axes=axes)

    def move(self, nodes: npt.ArrayLike, motion: Motion, axes: str = "xyz") -> None:
        """Move nodes by a script, in all or some directions: `Translation`, `Rotation`, `Keyframes` or any function
        motion(positions at time 0 (k, 3), time [s]) -> positions (k, 3) [m]. Raises `InputError` as `pin` does.
        """
        self._before_first_step("move nodes")
        self._held.hold(nodes, self._state.positions, motion, axes)

    def add(self, energy: Energy) -> None:
        """Add a load (`PointForce`, `Traction`, `Pressure`) or an energy of your own (`StencilEnergy`, `NodalEnergy`).

        Raises:
            InputError: it does not fit the mesh; the message names what does not.
        """
        self._before_first_step("add energies")
        _require("energy", energy, "an Energy", isinstance(energy, Energy))
        energy.node_sets(self.assembly.system_mesh)
        self._energies.append(energy)

    def _before_first_step(self, what: str) -> None:
        if self._system is not None:
            raise InputError(f"cannot {what} after the first step")

    @property
    def bodies(self) -> tuple[Body, ...]:
        """The bodies, in the order of their nodes."""
        return self.assembly.bodies

    @property
    def material(self) -> Material:
        """The material of the one body. Raises `InputError` where there are several, which have each their own."""
        return self._one_body().material

    @property
    def fibres(self) -> tuple[Fibres, ...]:
        """The fibres of the one body; as `material`."""
        return tuple(self._one_body().fibres)

    def _one_body(self) -> Body:
        if len(self.bodies) > 1:
            raise InputError(f"there are {len(self.bodies)} bodies, each with its own material and fibres: see bodies")
        return self.bodies[0]

    @property
    def integrator(self) -> Integrator:
        """The time integrator."""
        return self._integrator

    @property
    def state(self) -> State:
        """Time, positions and velocities now."""
        return self._state

    @property
    def steps_done(self) -> int:
        """How many steps lie behind `state`."""
        return self._steps_done

    @property
    def contact_now(self) -> ContactReport | None:
        """Contact at the end of the last step; None before the first, and where nothing can touch."""
        return self._contact_now

    @property
    def system(self) -> System:
        """The mechanical system; made when first asked for."""
        if self._system is None:
            self._system = System(
                self.assembly,
                gravity=self.gravity,
                mass=self.mass,
                damping=self.damping,
                energies=self._energies,
                held=self._held,
                contact=self.contact,
                threads=self.threads,
            )
            if self._system.contact is not None:
                self._system.contact.require_free(self._state.positions, self._state.time)
        return self._system

    @property
    def solver(self) -> Descent:
        """The nonlinear solver, which owns the factor; made when first asked for."""
        if self._solver is None:
            self._solver = self._solver_class(self.system, self.solver_settings, self.tolerance)
            self.timer.restart()
        return self._solver

    def restore(self, state: State, steps_done: int, solver: dict[str, FloatArray]) -> None:
        """Go on from a checkpoint: a state, the number of steps behind it, and what `solver.save()` gave then.

        Raises:
            InputError: positions or velocities of another shape, or not finite.
        """
        shape = self.assembly.system_mesh.positions.shape
        for name, values in (("positions", state.positions), ("velocities", state.velocities)):
            _require(f"shape of {name}", np.shape(values), str(shape), np.shape(values) == shape)
            vectors(name, values, shape)
        self._state, self._steps_done, self._contact_now = state, steps_done, None
        self.solver.load(solver)

    def run(self, steps: int) -> Iterator[StepResult]:
        """Take `steps` time steps, yielding each. Raises `StepFailed` as `advance` does."""
        for _ in range(steps):
            yield self.advance()

    def advance(self) -> StepResult:
        """Take one time step.

        Raises:
            StepFailed: the step did not converge and `on_failure` is not "accept"; or it ends in an intersection, and
                `contact.check` asks for none. The state stays as it was.
        """
        state, solves = self._take(self._integrator, self._state, self.step)
        parts = 1
        if self.on_failure == "halve" and not all(s.reason.converged for s in solves):
            state, solves, parts = self._take_halves(self._state, self.step, solves)
        step = self._steps_done + 1
        result = StepResult(
            step, state.time, state.positions, state.velocities, solves, self._contact_report(solves[-1]), parts
        )
        if not result.converged and (self.on_failure != "accept" or not _finite(state)):
            raise StepFailed(failure_message(result, self.solver.name), result)
        self._check_contact(result)
        last = self._state
        self._state = replace(state, time=last.time + self.step, previous=last.without_history())
        self._contact_now = result.contact
        self._steps_done = step
        return result

    def _contact_report(self, solve: SolveResult) -> ContactReport | None:
        point, forces = solve.contact, solve.forces
        if point is None or forces is None:
            return None
        return ContactReport(
            forces.nodes, point.count, point.minimum_distance, forces.planes, forces.energy, self.assembly
        )

    def _check_contact(self, result: StepResult) -> None:
        """Raise `StepFailed` where the settings of contact ask for a check, and something passes through something."""
        model = self.system.contact
        if model is not None and model.settings.check:
            found = model.intersection(result.positions, result.time)
            if found is not None:
                raise StepFailed(f"step {result.step} (time {result.time:g} s) intersects: {found}", result)

    def _take(self, integrator: Integrator, state: State, h: float) -> tuple[State, list[SolveResult]]:
        """One step of `h`; stops at the first stage that fails, unless failed steps are to be accepted."""
        solver, solves = self.solver, list[SolveResult]()
        origin = Origin(state.positions, state.time)
        solver.begin_step()
        if self.system.contact is not None:
            self.system.contact.stale = True
        stages = integrator.step(state, h)
        stage = next(stages)
        while True:
            solve = solver.solve(StageProblem(self.system, stage, state, self.timer, origin=origin))
            solves.append(solve)
            origin = Origin(solve.positions, stage.time)
            if not solve.reason.converged and self.on_failure != "accept":
                return State(state.time + h, solve.positions, stage.velocity(solve.positions)), solves
            try:
                stage = stages.send(solve.positions)
            except StopIteration as end:
                x, v = end.value
                return State(state.time + h, x, v), solves

    def _take_halves(
        self, start: State, h: float, solves: list[SolveResult], depth: int = 1
    ) -> tuple[State, list[SolveResult], int]:
        """The step as two halves by a one-step method, each cut again where it fails."""
        integrator, state, parts = self._integrator.one_step_method(), start.without_history(), 0
        for _ in range(2):
            end, tried = self._take(integrator, state, h / 2)
            solves, pieces = solves + tried, 1
            if not tried[-1].reason.converged and depth < MAX_HALVINGS:
                end, solves, pieces = self._take_halves(state, h / 2, solves, depth + 1)
            parts += pieces
            state = State(end.time, end.positions, end.velocities)
            if not solves[-1].reason.converged:
                break
        return state, solves, max(parts, 2)


def available_threads() -> int:
    """How many CPUs this process may run on."""
    if hasattr(os, "sched_getaffinity"):
        return len(os.sched_getaffinity(0))
    return os.cpu_count() or 1


def _finite(state: State) -> bool:
    return bool(np.isfinite(state.positions).all() and np.isfinite(state.velocities).all())


def _choose(what: str, name: str, choices: dict[str, type[T]]) -> type[T]:
    if name not in choices:
        raise InputError(f"{what} = {name!r} is not known: must be one of {', '.join(choices)}")
    return choices[name]


def _is_number(value: object) -> bool:
    return isinstance(value, int | float | np.number) and bool(np.isfinite(value))


def _require(name: str, value: object, allowed: str, ok: bool) -> None:
    if not ok:
        raise InputError(f"{name} = {value!r} is out of range: must be {allowed}")
