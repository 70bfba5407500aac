"""The one minimisation problem behind every implicit stage of every integrator."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass
from functools import cached_property

import numpy as np

from qlb import _native
from qlb.arrays import FloatArray
from qlb.contact.stage import ContactPoint, StageContact
from qlb.integrators.integrator import Origin, Stage, State
from qlb.system.system import System
from qlb.timing import Timer

MOVE = 1.5  # times the way that inertia would take: as far as one iteration goes with contact
BENDING = 0.1  # of the stiffness of the bodies, from which on the turning of normals is taken into account


@dataclass(frozen=True)
class Evaluation:
    """E and its gradient at a point."""

    energy: float
    """[kg m^2; J in quasistatics]"""
    gradient: FloatArray
    """[kg m; N in quasistatics], shape (n, 3), zero at held degrees of freedom"""
    smooth: FloatArray
    """the gradient without contact"""
    contact: ContactPoint | None


class StageProblem:
    """E(x) = 1/2 |x - x_hat|_M^2 + c^2 (Psi(x) - f.x) + c alpha/2 |x - x_b|_M^2, over the free degrees of freedom.

    Its gradient is g(x) = M (x - x_hat) - c^2 f(x, v) with v = (x - x_b)/c and x_hat = x_b + c v_b; mass-proportional
    damping f = -alpha M v has the potential written above. The two mass terms are one:
    (1 + c alpha)/2 |x - x_b - c v_b/(1 + c alpha)|_M^2 up to a constant. A quasistatic stage has no mass terms and
    c^2 = 1. Gradients have zeros, and positions the prescribed values, at the held degrees of freedom.
    """

    def __init__(
        self,
        system: System,
        stage: Stage,
        state: State,
        timer: Timer,
        guess: FloatArray | None = None,
        origin: Origin | None = None,
    ) -> None:
        """`guess` (n, 3) [m]: where terms take what they lag; the predictor by default. `origin`: `state`, too."""
        self.system = system
        self.stage = stage
        self.timer = timer
        self._state = state
        self.start: FloatArray = system.held.place(state.positions, stage.time)
        """x_k [m] with the held nodes where they are at the stage's time, shape (n, 3)."""
        self._mass_scale = 1.0 + stage.c * system.damping.mass if stage.inertial else 0.0
        self._target = stage.x_b + stage.c / max(self._mass_scale, 1.0) * stage.v_b
        self._guess = self.predictor if guess is None else guess
        at_stage = {term: potential for term in system.terms if (potential := term.at(stage, self._guess)) is not None}
        self._terms = list(at_stage.values())
        self._viscosity = next(filter(system.takes_along, self._terms), None)
        self._added = [at_stage[term] for term in system.added if term in at_stage]
        self.origin = origin or Origin(state.positions, state.time)
        self._last: tuple[FloatArray, float, FloatArray] | None = None
        self.contact: StageContact | None = None
        """Contact in this stage, where the system has any."""
        if system.contact is not None:
            self.contact = StageContact(system.contact, stage, self.force_scale, self.origin, timer)

    def refreshed(self, x: FloatArray, end: ContactPoint | None) -> StageProblem | None:
        """The problem with what it lags taken at `x` (n, 3) [m], contact `end` there; None where that is of no need.

        With inertia the predictor is near enough for the order of the integrator; statics has no time step that would
        make what is lagged small. Friction is taken anew as often as its settings say.
        """
        lagged = not self.stage.inertial and any(term.lagged for term in self.system.terms)
        slides = self.contact is not None and self.contact.may_lag_friction
        if not lagged and not slides:
            return None
        problem = copy(self)
        if lagged:
            problem = StageProblem(self.system, self.stage, self._state, self.timer, x, self.origin)
        if self.contact is not None and end is not None:
            problem.contact = self.contact.refreshed(end)
        return problem

    @property
    def force_scale(self) -> float:
        """What forces are multiplied by in g: c^2, or 1 in quasistatics."""
        return self.stage.c**2 if self.stage.inertial else 1.0

    @cached_property
    def residual_scale(self) -> float:
        """|c^2 E_i V_i^(2/3)| over the nodes: the residual of a strain of order one (after Zhu et al. 2018)."""
        return self.force_scale * self.system.norms.stiffness

    @cached_property
    def residual_rounding(self) -> float:
        """What rounding of the positions leaves of |g|: some eps of mass and stiffness times the largest coordinate.

        The stiffness of energies that were added is not known: what they make of such a change is measured.
        """
        system, extent = self.system, float(np.abs(self.start[: self.system.assembly.body_nodes]).max())
        spring = system.norms.spring
        if self.stage.inertial:
            damping = system.damping.stiffness * spring + system.norms.viscous_spring
            spring += damping / self.stage.c
        estimate = 1e-15 * extent * (self._mass_scale * system.norms.mass + self.force_scale * spring)
        return estimate + self._change_of_added(4e-16 * extent)

    def _change_of_added(self, size: float) -> float:
        """|dg| of the energies that were added when positions move by up to `size` [m]; 0 where it is not finite."""
        if not self._added:
            return 0.0
        golden = 0.5 * (5**0.5 - 1)  # its multiples fill [0, 1) evenly: no two neighbours move alike
        moves = size * (2 * (golden * np.arange(self.start.size) % 1.0) - 1).reshape(self.start.shape)
        change = np.zeros_like(self.start)
        with self.timer.section("gradient"):
            for potential in self._added:
                potential.add_value_gradient(self.start, -self.force_scale, change)
                potential.add_value_gradient(self.start + moves, self.force_scale, change)
        found = self.residual(self.system.clear_held(change))
        return found if np.isfinite(found) else 0.0

    @cached_property
    def energy_rounding(self) -> float:
        """What rounding may leave of E when the element energies cancel: some eps c^2 sum_e (lambda + 2 mu)_e V_e."""
        return 1e-15 * self.force_scale * self.system.energy_scale

    def evaluate(self, x: FloatArray, *, on_way: bool = False) -> Evaluation:
        """E and its gradient at positions `x` (n, 3) [m], contact included.

        `on_way`: whether `x` is on the way that contact has bounded last.
        """
        energy, smooth = self.value_gradient(x)
        if self.contact is None:
            return Evaluation(energy, smooth, smooth, None)
        contact = self.contact.at(x, on_way=on_way)
        gradient = self.system.clear_held(smooth + contact.gradient)
        return Evaluation(energy + contact.energy, gradient, smooth, contact)

    def value_gradient(self, x: FloatArray) -> tuple[float, FloatArray]:
        """E without contact and its gradient at positions `x` [m].

        In kg m^2 and kg m (J and N in quasistatics); the gradient has shape (n, 3), zero at held degrees of freedom.
        What was found last is not worked out again: where a solve ends the next pass begins.
        """
        if self._last is not None and np.array_equal(self._last[0], x):
            return self._last[1:]
        system = self.system
        with self.timer.section("gradient"):
            energy, gradient = self._stored_energy(x)
            for potential in self._terms:
                if potential is not self._viscosity:
                    energy += potential.add_value_gradient(x, self.force_scale, gradient)
            if self.stage.inertial:
                energy += system.inertia.add_value_gradient(x, self._target, self._mass_scale, gradient)
        self._last = x.copy(), energy, system.clear_held(gradient)
        return self._last[1:]

    def _stored_energy(self, x: FloatArray) -> tuple[float, FloatArray]:
        """What the bodies store, and what viscosity adds where one loop does both, with the gradient of that."""
        if self._viscosity is not None:
            return self.system.viscous_energy(x, self._viscosity, self.force_scale)
        energy, gradient = self.system.stored_energy(x, self.force_scale)
        return energy, gradient.copy()

    def hessian(
        self, x: FloatArray, *, project: bool, matrix: _native.BlockMatrix | None = None
    ) -> _native.BlockMatrix:
        """H = (1 + c alpha) M + c^2 d2Psi/dx2 at `x` without contact, each element's part projected to PSD where asked.

        Written to `matrix`, or to a new one.
        """
        with self.timer.section("hessian"):
            system = self.system
            matrix = matrix or _native.BlockMatrix(system.pattern)
            matrix.set_zero(system.threads)
            for potential in (*system.potentials, *self._terms):
                potential.add_hessian(x, self.force_scale, project, matrix)
            if self.stage.inertial:
                system.inertia.add_hessian(self._mass_scale, matrix)
            return matrix

    def contact_terms(self, x: FloatArray, contact: ContactPoint) -> _native.RankOneTerms:
        """The Hessian of `contact` at `x` (n, 3) [m] as a sum of rank-one terms, those along the normals first.

        How normals turn is in it where that counts beside the stiffness of the bodies: where forces are large.
        """
        assert self.system.contact is not None
        bending = self.system.contact.barrier.bending(x, contact.contacts, BENDING * self.node_stiffness)
        return contact.terms(bending)

    @cached_property
    def node_stiffness(self) -> float:
        """About the mean diagonal entry of the Hessian without contact."""
        system = self.system
        return float(np.mean(self._mass_scale * system.mass + 10 * self.force_scale * system.spring))

    @cached_property
    def plausible_move(self) -> float:
        """How far one iteration may move a node where there is contact [m].

        Some times the way that inertia alone would take from where the solve comes from; without inertia, the extent
        of the bodies. Longer search directions come from an ill-conditioned model, and searching the way for what they
        meet is dear.
        """
        assert self.system.contact is not None
        model = self.system.contact
        if not self.stage.inertial:
            return model.extent
        way = max(float(np.abs(x - self.origin.positions).max()) for x in (self.start, self.predictor, self.inertial))
        return min(model.extent, MOVE * way + 5 * model.dhat)

    @property
    def inertial(self) -> FloatArray:
        """Where inertia alone leads [m], shape (n, 3), held nodes exact."""
        return self.system.held.place(self._target, self.stage.time)

    @cached_property
    def predictor(self) -> FloatArray:
        """x_k + t v_k + t^2/2 (v_k - v_{k-1})/h, t the stage's time into the step; held nodes exact.

        In quasistatics x_k + (x_k - x_{k-1}). The terms of an earlier step are left out where there is none.
        """
        state, t = self._state, self.stage.time - self._state.time
        guess = state.positions + t * state.velocities
        if self.stage.inertial and state.previous is not None:
            h = state.time - state.previous.time
            guess += 0.5 * t**2 / h * (state.velocities - state.previous.velocities)
        return self.system.held.place(guess, self.stage.time)

    def residual(self, gradient: FloatArray) -> float:
        """|g| over the free degrees of freedom."""
        return self.system.norm(gradient)
