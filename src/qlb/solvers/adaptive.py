"""QLA: L-BFGS over one Cholesky factor that is kept, carried with the material, and made anew when that pays."""

from __future__ import annotations

from math import inf, log
from typing import ClassVar

import numpy as np

from qlb import _native
from qlb.arrays import FloatArray
from qlb.contact.stage import ContactPoint, Terms, joined
from qlb.integrators.integrator import Stage, State
from qlb.solvers.contact_base import ContactBase
from qlb.solvers.factor import Factor
from qlb.solvers.line_search import Point
from qlb.solvers.quasi_newton import FactoredLbfgs
from qlb.solvers.settings import Projection, SolverSettings, Tolerance
from qlb.solvers.work import cost_of_factor
from qlb.system import StageProblem, System
from qlb.timing import Timer

MAX_RESCUES = 3
PATIENCE = 5
DAMPING = 0.2
CROWD = 600  # terms of contact from which on the factor takes them in


class QLA(FactoredLbfgs):
    """L-BFGS over a factor that is kept: of B, the Hessian at some earlier initial guess, carried along as T B^-1 T^T.

    T is block-diagonal, for each node between the rotation R and the affine map A that the material around it has been
    through since then. R keeps shear and inertia as they are; A takes what keeps volumes to what keeps volumes, since
    d det F = cof F : dF, and the closer to incompressible a material is, the more that matters.

    With contact the factor holds inertia and elasticity alone, in double precision: next to stiff contacts single is
    too little. All contacts enter by Woodbury's formula, with half-solves for their nodes that last as long as the
    factor, and pairs hold the change of the gradient without contact, whose Hessian of the moment is known. Where there
    are too many, a step makes a factor with all contacts of the moment in it, and goes on by differences.

    It is made anew when that is expected to pay: before a solve, when the last one took more iterations than the mean
    cost of a solve with this factor; within a solve, when the iterations that are still to come cost more. A cost is
    counted in iterations, from the work of the mesh at hand (`qlb.solvers.work`), never from a clock.
    """

    name: ClassVar[str] = "QLA"
    defaults: ClassVar[dict[str, object]] = {
        "projection": "on-demand",
        "initial_guess": "predictor",
        "max_iterations": 5000,
        "window": 8,
        "precision": "auto",
    }

    def __init__(self, system: System, settings: SolverSettings, tolerance: Tolerance) -> None:
        if system.contact is not None and settings.precision in (None, "auto"):
            settings = settings.model_copy(update={"precision": "float64"})
        super().__init__(system, settings, tolerance)
        self.system = system
        kept = (self.factor.cholesky, system.blocks, system.held.fixed, system.threads)
        self._low_rank = None if system.contact is None else _native.WoodburyInverse(*kept)
        self._carried = self._low_rank or _native.CarriedInverse(*kept)
        self.kappa = cost_of_factor(self.factor.cholesky, self.settings.precision, len(system.mesh.tets))
        """Cost of assembly and factorisation, in iterations."""
        self._stretch = stretch_weight(system.incompressibility)
        self._reference: FloatArray | None = None  # positions at which the factor was taken
        self._kind: tuple[float, bool] | None = None  # its c, and whether it holds inertia
        self._solves = self._spent = 0  # solves with this factor, and their iterations
        self._stale = False
        self._crowded: Factor | None = None  # the factor with contact in it, for many contacts
        self._base: ContactBase | None = None  # what it holds; None where it is not in use

    @property
    def factorizations(self) -> int:
        """Factorisations tried so far."""
        return self.factor.count + (0 if self._crowded is None else self._crowded.count)

    def begin_step(self) -> None:
        """Forget a factor that holds contact: each step makes its own."""
        self._base = None

    @property
    def inverse(self) -> _native.InverseOperator:
        """B^-1, carried along, with the contacts of the moment."""
        return self._carried

    @property
    def columns(self) -> int:
        """Nodes whose half-solves are kept for contact."""
        if self._low_rank is None:
            return 0
        return self._low_rank.columns if self._base is None else self._crowded_inverse.columns

    def begin_solve(self, problem: StageProblem, point: Point, goal: float) -> None:
        """Start the account of a solve."""
        self._goal, self._iterations, self._rescues, self._indefinite = goal, 0, 0, False
        super().begin_solve(problem, point, goal)

    def prepare_factor(self, problem: StageProblem, point: Point) -> None:
        """Carry the factor to the initial guess, or make a new one there."""
        stale = self._stale or not self.settings.keep_factor or self._kind != _kind(problem)
        if stale or self._reference is None:
            self._refactor(problem, point, self.settings.projection)
            return
        self._mark(point)
        if self.settings.carry_factor:
            with problem.timer.section("solve"):
                self._carried.carry(point.x, self._reference, self._stretch)

    def direction(self, problem: StageProblem, point: Point) -> tuple[FloatArray, float]:
        """-H g, H from the pairs over the carried factor, which is made anew where contraction is too slow."""
        slow = self.settings.refactor_in_solve and self._needed(point) > self.kappa + PATIENCE
        if self._low_rank is None or point.contact is None:
            if slow:
                self._refactor(problem, point, self.settings.projection)
            return super().direction(problem, point)
        if slow:
            self._renew(problem, point, point.contact, self.settings.projection)
        with problem.timer.section("contact"):
            terms, known, inverse = self._terms(problem, point, point.contact)
            rest, forces = _split(problem, point, point.contact, terms)
        with problem.timer.section("solve"):
            p = np.empty_like(rest)
            slope = self.history.direction_with(rest, inverse, terms, p, -forces, known)
            self._p, self._known = p, _native.RankOneTerms(terms.nodes, terms.vectors, known)
            return p, slope

    def _terms(
        self, problem: StageProblem, point: Point, contact: ContactPoint
    ) -> tuple[_native.RankOneTerms, FloatArray, _native.WoodburyInverse]:
        """Terms of the Hessian of contact beside the factor, their stiffness in pairs, and the inverse with them.

        Pairs hold the change of friction themselves, since its terms are a bound.
        """
        assert self._low_rank is not None
        given = problem.contact_terms(point.x, contact)
        known = given[2].copy()
        known[contact.count : len(contact.terms()[2])] = 0.0
        if self._base is None and len(known) <= CROWD:
            terms = _native.RankOneTerms(*given)
            if self._low_rank.set_terms(terms):
                return terms, known, self._low_rank
        terms, removed = self._crowd_terms(problem, point, contact, given)
        return terms, np.concatenate([known, np.zeros(removed)]), self._crowded_inverse

    def _crowd_terms(
        self, problem: StageProblem, point: Point, contact: ContactPoint, given: Terms
    ) -> tuple[_native.RankOneTerms, int]:
        """Terms beside the factor with contact, which is made anew where they are many or their sum is not definite.

        Should that not help, the factor alone has to do.
        """
        if self._base is not None:
            terms, removed = self._beside_base(problem, contact, given)
            if np.count_nonzero(terms.stiffness) <= CROWD and self._crowded_inverse.set_terms(terms):
                return terms, removed
        self._take_in(problem, point, contact, self.settings.projection)
        terms, removed = self._beside_base(problem, contact, given)
        if not self._crowded_inverse.set_terms(terms):
            terms = _native.RankOneTerms(terms.nodes, terms.vectors, np.zeros(terms.size))
            self._crowded_inverse.set_terms(terms)
        return terms, removed

    def _beside_base(
        self, problem: StageProblem, contact: ContactPoint, given: Terms
    ) -> tuple[_native.RankOneTerms, int]:
        """Terms by which contact differs from what the factor holds; how many are what it has too many."""
        assert self._base is not None
        lacking, extra = self._base.difference(contact, given, problem.node_stiffness)
        terms = _native.RankOneTerms(*joined((given[0], given[1], lacking), extra))
        return terms, len(extra[2])

    def _take_in(self, problem: StageProblem, point: Point, contact: ContactPoint, projection: Projection) -> None:
        """Factorise with all contacts of the moment."""
        if self._crowded is None:
            self._crowded = Factor(self.system, self.settings.cholesky, "float64")
        if projection == "on-demand" and problem.system.is_inverted(point.x):
            projection = "always"
        self._crowded.update(problem, point.x, projection, contact.terms())
        system = self.system
        inverse = _native.WoodburyInverse(self._crowded.cholesky, system.blocks, system.held.fixed, system.threads)
        self._crowded_inverse, self._base = inverse, ContactBase.of(contact)
        self._mark(point)

    def _renew(self, problem: StageProblem, point: Point, contact: ContactPoint, projection: Projection) -> None:
        """A new factor here, of the kind in use."""
        if self._base is None:
            self._refactor(problem, point, projection)
        else:
            self.history.clear()
            self._take_in(problem, point, contact, projection)

    def accept(self, problem: StageProblem, old: Point, new: Point, *, limited: bool) -> None:
        """Store the pair, of the gradient without contact, and count the iteration.

        Where contact limits a step it is still being found, which a new factor does not shorten: contraction counts
        from the last such step.
        """
        if old.contact is None:
            self.history.push(old.x, new.x, old.smooth, new.smooth)
        else:
            y = _secant_gradient(new) - _secant_gradient(old)
            self.history.push(old.x, new.x, np.zeros_like(y), self._damped(problem, old, new.x - old.x, y))
        self._iterations += 1
        if limited:
            self._mark(new)

    def _damped(self, problem: StageProblem, old: Point, s: FloatArray, y: FloatArray) -> FloatArray:
        """The change y of the gradient over a step s, altered where it would soften the model too much at once.

        Powell 1978: y is mixed with B s until s.y >= 0.2 s.B s, B being the model without the terms that pairs leave
        out: B s follows from (B + C K C^T) p = -g.
        """
        system = problem.system
        Bs = -system.norm(s) / system.norm(self._p) * old.gradient
        self._known.add_product(s, Bs, -1.0)
        system.clear_held(Bs)
        sBs, sy = system.dot(s, Bs), system.dot(s, y)
        if sy >= DAMPING * sBs:
            return y
        share = (1 - DAMPING) * sBs / (sBs - sy)
        return share * y + (1 - share) * Bs

    def end_solve(self) -> None:
        """Decide whether the next solve needs a new factor: this one cost more than the mean with this factor."""
        iterations = self._iterations - self._marked_at
        self._solves += 1
        self._stale = iterations > (self.kappa + self._spent + iterations) / self._solves
        self._spent += iterations

    def recover(self, problem: StageProblem, point: Point) -> bool:
        """Drop the pairs; then make a new, projected factor here, at most three times a solve."""
        if super().recover(problem, point):
            return True
        if self._rescues == MAX_RESCUES:
            return False
        self._rescues += 1
        if point.contact is None:
            self._refactor(problem, point, "always")
        else:
            self._renew(problem, point, point.contact, "always")
        return True

    def save(self) -> dict[str, FloatArray]:
        """What the factor was made of, and the account of its use; for which pairs that with contact was analysed."""
        crowded = {} if self._crowded is None else {f"crowded_{k}": v for k, v in self._crowded.save().items()}
        if self._reference is None or self._kind is None:
            return crowded
        factor = self.factor
        flags = (self._stale, factor.projected, factor.raised)
        account = np.array([*self._kind, self._solves, self._spent, *flags], dtype=np.float64)
        saved = crowded | {"reference": self._reference, "account": account}
        if factor.shifted or not self.system.hessian_is_of_positions:
            saved["matrix"] = factor.matrix_values()  # many times larger; else it follows from the reference
        return saved

    def load(self, arrays: dict[str, FloatArray]) -> None:
        """Take it back, and factorise again."""
        crowded = {k.removeprefix("crowded_"): v for k, v in arrays.items() if k.startswith("crowded_")}
        self._crowded = self._base = None
        if crowded:
            self._crowded = Factor(self.system, self.settings.cholesky, "float64")
            self._crowded.load(crowded)
        self._reference = arrays.get("reference")
        if self._reference is None:
            return
        c, inertial, solves, spent, stale, projected, raised = arrays["account"]
        self._kind, self._solves, self._spent, self._stale = (c, bool(inertial)), int(solves), int(spent), bool(stale)
        values = arrays.get("matrix")
        if values is None:
            stage = Stage(0.0, c, ((1.0, self._reference),), np.zeros_like(self._reference), bool(inertial))
            then = StageProblem(self.system, stage, State(0.0, self._reference, stage.v_b), Timer())
            values = then.hessian(self._reference, project=bool(projected)).values
        self.factor.restore(values, projected=bool(projected), raised=bool(raised))
        if self._low_rank is not None:
            self._low_rank.forget()
        self._carried.reset()

    def _refactor(self, problem: StageProblem, point: Point, projection: Projection) -> None:
        self._reference = None  # until the new factor stands
        if projection == "on-demand" and (self._indefinite or problem.system.is_inverted(point.x)):
            projection = "always"
        self.factor.update(problem, point.x, projection)
        self._indefinite = self.factor.projected
        if self._low_rank is not None:
            self._low_rank.forget()
        self._carried.reset()
        self.history.clear()
        self._reference, self._kind = point.x, _kind(problem)
        self._solves = self._spent = 0
        self._stale = False
        self._mark(point)

    def _mark(self, point: Point) -> None:
        """Measure contraction from here on."""
        self._marked_at, self._marked = self._iterations, point.residual

    def _needed(self, point: Point) -> float:
        """Iterations that are still to come, at the mean contraction so far; 0 while there is too little to tell."""
        done = self._iterations - self._marked_at
        if done < PATIENCE:
            return 0.0
        rate = log(point.residual / self._marked) / done
        return log(self._goal / point.residual) / rate if rate < 0 else inf


def _split(
    problem: StageProblem, point: Point, contact: ContactPoint, terms: _native.RankOneTerms
) -> tuple[FloatArray, FloatArray]:
    """The gradient as a rest (n, 3) minus forces (t,) along terms: beside stiff contacts their sum would drown it."""
    forces = np.zeros(terms.size)
    forces[: contact.count] = contact.contacts.force
    rest = point.gradient.copy()
    terms.add_combination(forces, rest)
    return problem.system.clear_held(rest), forces


def _secant_gradient(point: Point) -> FloatArray:
    """The gradient that pairs hold the change of: without contact, but with friction."""
    if point.contact is None or point.contact.sliding is None:
        return point.smooth
    return point.smooth + point.contact.sliding


def stretch_weight(incompressibility: float) -> float:
    """Weight of A in T = (1 - w) R + w A, from the mean of (lambda + 2 mu)/E: 0 up to nu = 0.43, almost 1/2 at 0.499.

    At 1/2, T = R (1 + S)/2 stays well-conditioned for any A = R S, flat or large. The rule is ours, from counts of
    iterations over nu.
    """
    return 0.5 * max(0.0, 1.0 - 3.0 / incompressibility)


def _kind(problem: StageProblem) -> tuple[float, bool]:
    return problem.stage.c, problem.stage.inertial
