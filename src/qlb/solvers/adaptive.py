"""QLA: L-BFGS over one Cholesky factor that is kept, carried with the material, and made anew when that pays."""

from __future__ import annotations

from math import inf, log
from typing import ClassVar

import numpy as np

from qlb import _native
from qlb.arrays import FloatArray
from qlb.contact.stage import ContactPoint
from qlb.errors import InputError
from qlb.integrators.integrator import Stage, State
from qlb.solvers.contact_base import CROWD, NEAR, ContactBase
from qlb.solvers.line_search import LEARNT, Point
from qlb.solvers.quasi_newton import FactoredLbfgs
from qlb.solvers.settings import Projection, SolverSettings, Tolerance
from qlb.solvers.work import cost_of_factor, cost_of_terms
from qlb.system import StageProblem, System
from qlb.timing import Timer

MAX_RESCUES = 3
PATIENCE = 5
DAMPING = 0.2
COLUMN = 0.02  # cost of the half-solves of a node, in iterations
RENT = 3.5  # times the cost of a factor that terms beside it may cost until another is made
OUTSIDE = 60  # terms that do not fit into its pattern, from which on it is extended for them


class QLA(FactoredLbfgs):
    """L-BFGS over a factor that is kept: of B, the Hessian at some earlier initial guess, carried along as T B^-1 T^T.

    T is block-diagonal, for each node between the rotation R and the affine map A that the material around it has been
    through since then. R keeps shear and inertia as they are; A takes what keeps volumes to what keeps volumes, since
    d det F = cof F : dF, and the closer to incompressible a material is, the more that matters.

    With contact the factor holds the contacts of then, too, as far as they fit into its pattern, in which those with
    planes and obstacles always do. By what the contacts of the moment differ enters by Woodbury's formula, the smaller
    differences only while they are few, with half-solves for their nodes that last as long as the factor, and pairs
    hold the change of the gradient without contact, whose Hessian of the moment is known.

    It is made anew when that is expected to pay: before a solve, when the last one took more iterations than the mean
    cost of a solve with this factor; within a solve, when the iterations that are still to come cost more, when the
    terms beside it are too many, or when they have cost some times a new one. A cost is counted in iterations, from the
    work of the mesh at hand (`qlb.solvers.work`), never from a clock.
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
        super().__init__(system, settings, tolerance)
        self.system = system
        self._low_rank: _native.WoodburyInverse | None = None
        self._over_factor()
        self._stretch = stretch_weight(system.incompressibility)
        self._reference: FloatArray | None = None  # positions at which the factor was taken
        self._kind: tuple[float, bool] | None = None  # its c, and whether it holds inertia
        self._base: ContactBase | None = None  # the contacts in it
        self._solves = self._spent = 0  # solves with this factor, and their iterations
        self._has_column = np.zeros(system.nodes, dtype=bool)  # nodes with half-solves over this factor
        self._zeros = np.zeros((system.nodes, 3))
        self._beside = 0.0  # cost of the terms beside this factor, in iterations
        self._stale = False

    def _over_factor(self) -> None:
        """See to what depends on the analysis of the factor."""
        system, cholesky = self.system, self.factor.cholesky
        self._analysed = cholesky
        kept = (cholesky, system.blocks, system.held.fixed, system.threads)
        if system.contact is None:
            self._carried: _native.CarriedInverse | _native.WoodburyInverse = _native.CarriedInverse(*kept)
        elif not isinstance(cholesky, _native.SupernodalCholesky):
            raise InputError("cholesky = 'cholmod': must be 'supernodal' for QLA in contact, which needs half-solves")
        else:
            self._carried = self._low_rank = _native.WoodburyInverse(*kept)
        self._measures = (cholesky, self.settings.precision, len(system.mesh.tets))
        self.kappa = cost_of_factor(*self._measures)
        """Cost of assembly and factorisation, in iterations."""

    @property
    def inverse(self) -> _native.InverseOperator:
        """B^-1, carried along, with the contacts of the moment."""
        return self._carried

    @property
    def columns(self) -> int:
        """Nodes whose half-solves are kept for contact."""
        return 0 if self._low_rank is None else self._low_rank.columns

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
                if self._low_rank is not None:
                    self._low_rank.set_terms(_no_terms())
                self._carried.carry(point.x, self._reference, self._stretch)

    def direction(self, problem: StageProblem, point: Point) -> tuple[FloatArray, float]:
        """-H g, H from the pairs over the carried factor, which is made anew where contraction is too slow."""
        contact = point.contact
        touches = contact is not None and contact.count > 0  # then it is slow because contact is still being found
        if not touches and self.settings.refactor_in_solve and self._needed(point) > self.kappa + PATIENCE:
            self._refactor(problem, point, self.settings.projection)
        if self._low_rank is None or contact is None:
            return super().direction(problem, point)
        with problem.timer.section("contact"):
            terms, known = self._terms(problem, point, contact)
            rest, forces = _split(problem, point, contact, terms)
        with problem.timer.section("solve"):
            p = np.empty_like(rest)
            slope = self.history.direction_with(rest, self._low_rank, terms, p, -forces, known)
            self._p, self._terms_there, self._known = p, terms, known
            return p, slope

    def _terms(
        self, problem: StageProblem, point: Point, contact: ContactPoint
    ) -> tuple[_native.RankOneTerms, FloatArray]:
        """Terms of the Hessian of contact beside the factor, and their stiffness in pairs.

        Pairs hold half the change of friction themselves, since its terms are a bound. The factor is made anew where
        terms are too many or their sum is not definite, and once more where double precision is still to be had; should
        that not help, it has to do by itself.
        """
        given = problem.contact_terms(point.x, contact)
        terms, done = self._beside_factor(problem, contact, given, most=self.kappa)
        anew = not done
        while anew:
            self._refactor(problem, point, self.settings.projection)
            terms, done = self._beside_factor(problem, contact, given)
            anew = not done and self.factor.raise_precision()
        if not done:
            terms = _native.RankOneTerms(terms.nodes, terms.vectors, np.zeros(terms.size))
            assert self._low_rank is not None
            self._low_rank.set_terms(terms)
        known = np.zeros(terms.size)
        known[: given.size] = given.stiffness
        known[contact.count : contact.count + 2 * len(contact.sliding_keys)] *= 1 - LEARNT
        return terms, known

    def _beside_factor(
        self, problem: StageProblem, contact: ContactPoint, given: _native.RankOneTerms, most: float = inf
    ) -> tuple[_native.RankOneTerms, bool]:
        """Terms by which contact differs from what the factor holds; whether they are in place beside it.

        They are not where they are too many, half-solves for their nodes cost more than `most` iterations, all terms
        beside this factor so far have cost some times that, or the sum is not definite.
        """
        assert self._low_rank is not None
        assert self._base is not None
        terms, framed = self._base.difference(contact, given, self._low_rank, problem.node_stiffness)
        beside = np.flatnonzero(terms.stiffness)
        fresh = np.zeros(self.system.nodes, dtype=bool)
        fresh[terms.nodes[beside]] = True
        fresh &= ~self._has_column
        new = COLUMN * np.count_nonzero(fresh)
        if len(beside) > CROWD or new > most or self._beside > RENT * most:
            return terms, False
        self._has_column |= fresh
        self._beside += new + cost_of_terms(len(beside), *self._measures)
        return terms, self._low_rank.set_terms(terms, framed)

    def accept(self, problem: StageProblem, old: Point, new: Point, *, limited: bool) -> None:
        """Store the pair, of the gradient without contact, and count the iteration.

        Where contact limits a step it is still being found, which a new factor does not shorten: contraction counts
        from the last such step.
        """
        if old.contact is None:
            self.history.push(old.x, new.x, old.smooth, new.smooth)
        else:
            y = new.secant - old.secant
            self.history.push(old.x, new.x, self._zeros, self._damped(problem, old, new.x - old.x, y))
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
        self._terms_there.add_product(s, Bs, -1.0, self._known)
        system.clear_held(Bs)
        sBs, sy = system.dot(s, Bs), system.dot(s, y)
        if sy >= DAMPING * sBs:
            return y
        share = (1 - DAMPING) * sBs / (sBs - sy)
        return share * y + (1 - share) * Bs

    def end_solve(self) -> None:
        """Decide whether the next solve needs a new factor: where this one cost more than the mean with this factor."""
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
        if point.contact is not None and point.contact.count:
            self.factor.raise_precision()
        self._refactor(problem, point, "always")
        return True

    def save(self) -> dict[str, FloatArray]:
        """What the factor was made of, and the account of its use; for which pairs it was analysed."""
        saved = super().save()
        if self._reference is None or self._kind is None:
            return saved
        factor = self.factor
        flags = (self._stale, factor.projected, factor.raised)
        account = np.array([*self._kind, self._solves, self._spent, self._beside, *flags], dtype=np.float64)
        saved |= {"reference": self._reference, "account": account}
        if self._base is not None:
            saved |= self._base.save() | {"has_column": self._has_column.astype(np.float64)}
        if factor.shifted or not self.system.hessian_is_of_positions:
            saved["matrix"] = factor.matrix_values()  # many times larger; else it follows from the reference
        return saved

    def load(self, arrays: dict[str, FloatArray]) -> None:
        """Take it back, and factorise again."""
        super().load(arrays)
        if self.factor.cholesky is not self._analysed:
            self._over_factor()
        self._base = None
        self._reference = arrays.get("reference")
        if self._reference is None:
            return
        c, inertial, solves, spent, self._beside, stale, projected, raised = (float(v) for v in arrays["account"])
        self._kind, self._solves, self._spent, self._stale = (c, bool(inertial)), int(solves), int(spent), bool(stale)
        values = arrays.get("matrix")
        if values is None:
            stage = Stage(0.0, c, ((1.0, self._reference),), np.zeros_like(self._reference), bool(inertial))
            then = StageProblem(self.system, stage, State(0.0, self._reference, stage.v_b), Timer())
            values = then.hessian(self._reference, project=bool(projected)).values
        if self._low_rank is not None:
            self._base = ContactBase.load(arrays)
            self._has_column = arrays["has_column"] != 0
        if self._low_rank is not None:
            self._low_rank.forget()
        self._carried.reset()
        contact = None if self._base is None else self._base.held
        self.factor.restore(values, projected=bool(projected), raised=bool(raised), contact=contact)

    def _refactor(self, problem: StageProblem, point: Point, projection: Projection) -> None:
        """A factor of the Hessian here, with the contacts of the moment that fit into its pattern.

        The pattern is extended where those that do not are many.
        """
        self._reference = None  # until the new factor stands
        if projection == "on-demand" and self._indefinite:
            projection = "always"
        contact = None
        if point.contact is not None:
            contact = self._take_in(point.contact, problem.node_stiffness)
        self.factor.update(problem, point.x, projection, contact)
        self._indefinite = self.factor.projected
        if self.factor.cholesky is not self._analysed:
            self._over_factor()
        if self._low_rank is not None:
            self._low_rank.forget()
        self._carried.reset()
        self.history.clear()
        self._reference, self._kind = point.x, _kind(problem)
        self._solves = self._spent = 0
        self._beside = 0.0
        self._has_column[:] = False
        self._stale = False
        self._mark(point)

    def _take_in(self, contact: ContactPoint, scale: float) -> _native.RankOneTerms:
        """What of the contacts of the moment goes into the factor that is about to be made."""
        terms = contact.terms()
        fits = self.factor.fits(terms.nodes)
        if np.count_nonzero(terms.stiffness[~fits] > NEAR[-1][0] * scale) > OUTSIDE:
            fits[:] = True
        self._base = ContactBase.of(contact, fits)
        return self._base.held

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


def _no_terms() -> _native.RankOneTerms:
    return _native.RankOneTerms(np.empty((0, 4), dtype=np.int32), np.empty((0, 4, 3)), np.empty(0))


def stretch_weight(incompressibility: float) -> float:
    """Weight of A in T = (1 - w) R + w A, from the mean of (lambda + 2 mu)/E: 0 up to nu = 0.43, almost 1/2 at 0.499.

    At 1/2, T = R (1 + S)/2 stays well-conditioned for any A = R S, flat or large. The rule is ours, from counts of
    iterations over nu.
    """
    return 0.5 * max(0.0, 1.0 - 3.0 / incompressibility)


def _kind(problem: StageProblem) -> tuple[float, bool]:
    return problem.stage.c, problem.stage.inertial
