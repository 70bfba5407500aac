"""Contact in one stage: energy and forces at a point, and how far a step may go."""

from __future__ import annotations

from copy import copy
from dataclasses import dataclass, field, replace

import numpy as np

from qlb import _native
from qlb.arrays import FloatArray, LongArray
from qlb.contact.friction import LaggedFriction
from qlb.contact.model import ContactModel
from qlb.contact.report import ContactForces
from qlb.integrators.integrator import Origin, Stage
from qlb.timing import Timer

PLANE_SHARE = 0.9  # of the way to a plane that a step may go
ALONG = 0.2  # of friction's stiffness across the sliding, what its model has along it at least
MARGIN = 0.5  # of dhat, by which candidates outlast the motion that they were searched for


@dataclass(frozen=True)
class ContactPoint:
    """Contact and friction at a point, multiplied by c^2 as everything in a stage."""

    energy: float
    gradient: FloatArray
    """shape (n, 3), held nodes included: minus the forces, times c^2"""
    contacts: _native.ContactSet
    friction: _native.FrictionTerms | None = None
    sliding: FloatArray | None = None
    """the part of the gradient that is friction's, shape (n, 3)"""
    sliding_keys: LongArray = field(default_factory=lambda: np.empty(0, dtype=np.int64))
    """pairs of primitives that friction is of, ascending, shape (f,)"""
    secant: FloatArray | None = None
    """by how much each friction has grown along the change of its slip since the point before, over that change (f,)"""

    def terms(self, more: _native.RankOneTerms | None = None) -> _native.RankOneTerms:
        """The Hessian along the normals, then that of friction, as a sum of k a a^T; and `more` after them."""
        return _native.contact_terms(self.contacts, self.friction, ALONG, self.secant, more)

    def sliding_terms(self) -> _native.RankOneTerms:
        """The Hessian of friction, two terms a contact that was lagged.

        Its stiffness is mu lambda f1(u)/u across the sliding u, and at least a part of that along it, where the Hessian
        has nothing once a contact slides: with all of it the quadratic would lie above its potential, with nothing a
        step that turns u round goes too far. And at least what the last step has shown, where it turned u round.
        """
        return _native.contact_terms(None, self.friction, ALONG, self.secant)

    def after(self, before: ContactPoint) -> ContactPoint:
        """The same, with what the step from the point `before` tells of friction lagged at the same point."""
        new, old = self.friction, before.friction
        if new is None or old is None or not np.array_equal(self.sliding_keys, before.sliding_keys):
            return self
        return replace(self, secant=new.secant(old))

    @property
    def count(self) -> int:
        """Active contacts."""
        return self.contacts.size

    @property
    def minimum_distance(self) -> float:
        """[m]; infinite where nothing touches."""
        return self.contacts.minimum_distance


class StageContact:
    """The contact energy of a stage, with friction lagged at an earlier point."""

    def __init__(self, model: ContactModel, stage: Stage, scale: float, origin: Origin, timer: Timer) -> None:
        """`scale`: c^2, or 1 in quasistatics; `origin`: where the solve comes from, friction is first taken there."""
        self.model, self._stage, self._scale, self._timer = model, stage, scale, timer
        self._from, self._to = model.offsets(origin.time), model.offsets(stage.time)
        self._offsets = self._from
        self._still = np.zeros_like(origin.positions)
        self._friction: LaggedFriction | None = None
        self._at_plane: tuple[int, int] | None = None  # node and plane that bounded the last step
        self.friction_pass = 1
        if model.has_friction:
            self._lag_friction(self.at(origin.positions).contacts)
        self._offsets = self._to

    @property
    def may_lag_friction(self) -> bool:
        """Whether friction is to be taken anew after the solve."""
        return self.model.has_friction and self.friction_pass < self.model.settings.friction_passes

    def refreshed(self, end: ContactPoint) -> StageContact:
        """The same stage with friction lagged where a solve found its `end`."""
        following = copy(self)
        following.friction_pass += 1
        if self.model.has_friction:
            following._lag_friction(end.contacts)
        return following

    @property
    def planes_move(self) -> bool:
        """Whether a plane is elsewhere than where the solve comes from."""
        return not np.array_equal(self._from, self._to)

    def set_fraction(self, s: float) -> None:
        """Put the planes at the part `s` of their way to where they are in the stage."""
        self._offsets = self._to if s == 1 else (1 - s) * self._from + s * self._to

    def _lag_friction(self, contacts: _native.ContactSet) -> None:
        """Take normal forces and directions of sliding from `contacts`."""
        self._friction = LaggedFriction(self.model, contacts, self._scale, self._plane_motion())

    def at(self, x: FloatArray, *, on_way: bool = False) -> ContactPoint:
        """Contact at positions `x` (n, 3) [m]; `on_way`: on the last way given to `bound`, up to that."""
        model = self.model
        if not (on_way and model.is_barrier):
            self.cover(x, None)
        with self._timer.section("contact"):
            gradient = np.zeros(x.shape)
            contacts = model.evaluate(x, self._offsets, self._scale, gradient)
            friction = None if self._friction is None else self._friction.whole
            if self._friction is None or friction is None:
                return ContactPoint(contacts.energy, gradient, contacts)
            sliding = np.zeros(x.shape)
            terms = self._slide(friction, x, sliding)
            gradient += sliding
            keys = self._friction.keys
            return ContactPoint(contacts.energy + terms.energy, gradient, contacts, terms, sliding, keys)

    def forces(self, x: FloatArray, point: ContactPoint) -> ContactForces:
        """Forces at positions `x` (n, 3) [m], where contact was found to be `point`."""
        model, scale = self.model, self._scale
        contacts, plane = point.contacts, model.plane_of(point.contacts)
        planes = np.zeros((len(model.normals), 3))
        np.add.at(planes, plane[plane >= 0], -contacts.force[plane >= 0, None] * contacts.normal[plane >= 0])
        for q, total in enumerate(planes):
            friction = None if self._friction is None else self._friction.on_plane(q)
            if friction is not None:
                gradient = np.zeros_like(x)
                self._slide(friction, x, gradient)
                total += gradient.sum(axis=0)
        return ContactForces(-point.gradient / scale, planes / scale, contacts.energy / scale)

    def _slide(self, friction: _native.Friction, x: FloatArray, gradient: FloatArray) -> _native.FrictionTerms:
        epsilon = self.model.friction_velocity * self._stage.c
        return friction.evaluate(x, self._stage.x_b, epsilon, self._scale, gradient)

    def cover(self, x: FloatArray, p: FloatArray | None) -> None:
        """See to it that the candidates hold every pair that may act somewhere on the way x -> x + p."""
        candidates = self.model.candidates
        p = self._still if p is None else p
        with self._timer.section("candidates"):
            if self.model.stale or not candidates.covers(x, p):
                candidates.build(x, p, MARGIN * self.model.dhat, self.model.barrier.reach)
                self.model.stale = False

    def bound(self, x: FloatArray, p: FloatArray, *, moving_planes: bool = False) -> float:
        """The largest part of a step p (n, 3) [m] from `x` that keeps all gaps open; 1 where the whole step does.

        With `moving_planes`, they go to where they are in the stage at the same time.
        """
        if not self.model.is_barrier:
            return 1.0
        with self._timer.section("candidates"):
            at_plane = self._plane_bound(x, p, moving_planes)
        way = p if at_plane == 1 else at_plane * p
        self.cover(x, way)
        with self._timer.section("candidates"):
            between_pairs = self.model.candidates.step_bound(x, way)
        if between_pairs < 1:
            self._at_plane = None
        return at_plane * between_pairs

    def limiting(self) -> str:
        """What bounded the last step below 1, in words; empty where nothing did."""
        model = self.model
        if self._at_plane is not None:
            node, plane = self._at_plane
            return f"{model.describe(node)}, {model.plane_name(plane)}"
        if model.candidates.limiting is None:
            return ""
        nodes = np.asarray(model.candidates.limiting)
        return ", ".join(dict.fromkeys(model.describe(int(node)) for node in nodes))

    def _plane_bound(self, x: FloatArray, p: FloatArray, moving_planes: bool) -> float:
        model = self.model
        motion = self._to - self._offsets if moving_planes else np.zeros(len(self._offsets))
        planes = model.vertices, model.normals, self._offsets, model.near_planes
        part, node, plane = _native.plane_bound(*planes, x, p, motion, PLANE_SHARE)
        self._at_plane = None if plane < 0 else (node, plane)
        return part

    def _plane_motion(self) -> FloatArray:
        """How far the planes move over c [m], shape (q, 3)."""
        model, stage = self.model, self._stage
        ends = [
            np.array([p.point_at(t) for p in model.around.planes]).reshape(-1, 3)
            for t in (stage.time - stage.c, stage.time)
        ]
        return np.asarray(ends[1] - ends[0])
