"""What does not change from step to step about contact: surfaces, planes, who touches whom, and how stiffly."""

from __future__ import annotations

import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from itertools import combinations_with_replacement

import numpy as np

from qlb import _native
from qlb.arrays import FloatArray, IntArray
from qlb.bodies import Plane
from qlb.contact.settings import Contact
from qlb.errors import InputError, QlbWarning
from qlb.setting_keys import SettingError

DHAT_OF_EDGE = 0.1
CREEP = 1e-3  # friction_velocity as a part of the bodies' extent a second


@dataclass(frozen=True)
class Surroundings:
    """What a contact model is made of. Groups are the bodies, then the obstacles; planes come after them."""

    rest: FloatArray
    """positions of bodies at rest and obstacles at time 0 [m], shape (n, 3)"""
    faces: IntArray
    """outward triangles of bodies, and those of obstacles, shape (f, 3)"""
    groups: IntArray
    """of each node, shape (n,)"""
    bodies: int
    """number of groups that are bodies"""
    names: Sequence[str]
    """of groups, then of planes"""
    planes: Sequence[Plane]
    young: float
    """largest Young's modulus [Pa]"""
    threads: int


class ContactModel:
    """Surfaces that may touch, with all settings resolved.

    Attributes:
        dhat: distance at which contact begins to act [m].
        stiffness: kappa [Pa].
        friction_velocity: [m/s].
        friction: mu of each two groups or planes, shape (g, g).
        extent: diagonal of the bodies' bounding box at rest [m].

    Raises:
        InputError: a pair names something that does not exist.
    """

    def __init__(self, settings: Contact, around: Surroundings) -> None:
        self.settings = settings
        self.around = around
        of_bodies = around.rest[around.groups < around.bodies]
        self.extent = float(np.linalg.norm(np.ptp(of_bodies, axis=0)))
        self.friction_velocity = settings.friction_velocity or CREEP * self.extent
        self.friction, may_touch = _tables(settings, around)
        groups = len(around.names) - len(around.planes)
        self.plane_allowed = np.ascontiguousarray(may_touch[groups:, :groups], dtype=np.uint8)
        allowed = np.ascontiguousarray(may_touch[:groups, :groups], dtype=np.uint8)
        self.surface = _native.ContactSurface(around.rest, around.faces, around.groups, allowed)
        self.candidates = _native.Candidates(self.surface, around.threads)
        self.stale = True
        """Whether candidates are of an earlier step: none outlasts one, so that a resumed run finds the same."""
        self.normals: FloatArray = np.array([plane.normal for plane in around.planes]).reshape(-1, 3)
        self.dhat = settings.dhat or self._default_dhat()
        self.stiffness = settings.stiffness or around.young
        self.barrier = _native.Barrier(self.surface, self.dhat, self.stiffness, around.threads, settings.mode)
        vertices = self.surface.vertices
        self.vertices: IntArray = vertices[around.groups[vertices] < around.bodies]
        """surface nodes of bodies"""
        self.near_planes = np.ascontiguousarray(self.plane_allowed[:, around.groups[self.vertices]].T)
        """whether each of `vertices` is held out by each plane, shape (v, q)"""
        if self.is_barrier:
            self._limit_features()

    def resolved(self) -> dict[str, str | float]:
        """What the settings have come to, as plain data."""
        names = ("dhat", "stiffness", "friction_velocity")
        return {"mode": self.settings.mode, **{name: float(getattr(self, name)) for name in names}}

    @property
    def is_barrier(self) -> bool:
        """Whether nothing may pass through anything."""
        return self.settings.mode == "barrier"

    @property
    def has_friction(self) -> bool:
        """Whether anything slides with friction."""
        return bool(self.friction.any())

    def evaluate(self, x: FloatArray, offsets: FloatArray, scale: float, gradient: FloatArray) -> _native.ContactSet:
        """The contacts at `x` (n, 3) [m] among the candidates; `scale` dPhi/dx is added to `gradient` (n, 3)."""
        planes = np.empty((len(offsets), 4))
        planes[:, :3], planes[:, 3] = self.normals, offsets
        pairs = self.candidates.vertex_faces, self.candidates.edge_edges
        return self.barrier.evaluate(x, *pairs, planes, self.plane_allowed, scale, gradient)

    def offsets(self, time: float) -> FloatArray:
        """Of the planes at `time` [s]: n.x = offset on each, shape (q,) [m]."""
        points = np.array([plane.point_at(time) for plane in self.around.planes]).reshape(-1, 3)
        return np.asarray(np.einsum("qi,qi->q", self.normals, points))

    def plane_gaps(self, x: FloatArray, offsets: FloatArray) -> FloatArray:
        """Distances [m] of `vertices` from each plane, shape (v, q); infinite where they may not touch."""
        gaps = (x @ self.normals.T)[self.vertices] - offsets
        return np.where(self.near_planes != 0, gaps, np.inf)

    def plane_of(self, contacts: _native.ContactSet) -> IntArray:
        """The plane of each contact, or a negative number for one between two surfaces, shape (k,)."""
        return np.asarray(contacts.groups[:, 1] - self.plane_allowed.shape[1])

    def describe(self, node: int) -> str:
        """A node by its body or obstacle."""
        group = int(self.around.groups[node])
        first = int(np.argmax(self.around.groups == group))
        return f"{self.around.names[group]} node {node - first}"

    def plane_name(self, plane: int) -> str:
        """A plane by its name, or its number."""
        return self.around.names[len(self.around.names) - len(self.around.planes) + plane]

    def intersection(self, x: FloatArray, time: float) -> str | None:
        """What passes through what at positions `x` (n, 3) [m], in words; None where nothing does."""
        gaps = self.plane_gaps(x, self.offsets(time))
        if gaps.size and not gaps.min() > 0:
            v, q = np.unravel_index(np.argmin(gaps), gaps.shape)
            count = int((gaps <= 0).sum())
            behind = f"{-gaps[v, q]:.4g} m behind {self.plane_name(int(q))}"
            return f"{self.describe(self.vertices[v])} is {behind}{_more(count, 'node')}"
        pairs = self.candidates.intersections(x)
        if len(pairs) == 0:
            return None
        edge, face = self.surface.edges[pairs[0, 0]], self.surface.faces[pairs[0, 1]]
        ends, corners = (" - ".join(self.describe(int(node)) for node in nodes) for nodes in (edge, face))
        return f"edge ({ends}) passes through face ({corners}){_more(len(pairs), 'pair')}"

    def require_free(self, x: FloatArray, time: float) -> None:
        """Raise `InputError` where the start state intersects, with the pair named."""
        found = self.intersection(x, time) if self.is_barrier else None
        if found is not None:
            raise InputError(f"the start state intersects: {found}; move bodies or obstacles apart")

    def _default_dhat(self) -> float:
        """A tenth of the mean edge of the bodies' surfaces."""
        edges, groups = self.surface.edges, self.around.groups
        lengths = np.linalg.norm(self.around.rest[edges[:, 0]] - self.around.rest[edges[:, 1]], axis=1)
        return DHAT_OF_EDGE * float(lengths[groups[edges[:, 0]] < self.around.bodies].mean())

    def _limit_features(self) -> None:
        """Let parts of one body that are nearer than dhat at rest act from half that distance on.

        Else a body would be strained by itself at rest. Warns where dhat was set by the user.
        """
        rest = self.around.rest
        self.candidates.build(rest, np.zeros_like(rest), 0.0, self.dhat)
        far_away = np.full(len(self.normals), -np.inf)
        near = self.evaluate(rest, far_away, 1.0, np.zeros_like(rest))
        own = near.groups[:, 0] == near.groups[:, 1]
        if not own.any():
            return
        self.barrier.limit_pairs(near.key[own], 0.5 * near.distance[own])
        if self.settings.dhat is not None:
            k = int(np.flatnonzero(own)[np.argmin(near.distance[own])])
            nodes = ", ".join(self.describe(int(node)) for node in dict.fromkeys(near.nodes[k]))
            warnings.warn(
                f"contact.dhat = {self.dhat:.4g} m is larger than features of the bodies: {own.sum()} pairs are nearer"
                f" at rest, down to {near.distance[k]:.4g} m ({nodes}); such pairs act from half their distance at"
                " rest on",
                QlbWarning,
                stacklevel=2,
            )


def _tables(settings: Contact, around: Surroundings) -> tuple[FloatArray, np.ndarray]:
    """mu, and whether they may touch, of each two groups or planes (g, g)."""
    names, count = list(around.names), len(around.names)
    friction = np.full((count, count), settings.friction)
    allowed = np.zeros((count, count), dtype=bool)
    for a, b in combinations_with_replacement(range(count), 2):
        allowed[a, b] = allowed[b, a] = a < around.bodies and (a != b or settings.self_contact)
    for k, pair in enumerate(settings.pairs):
        key = f"contact.pairs.{k}"
        for name in pair.between:
            if name not in names:
                known = f"must be one of {', '.join(names)}"
                raise SettingError(key, f"{key}: {name!r} is not known: {known}")
        a, b = (names.index(name) for name in pair.between)
        if min(a, b) >= around.bodies:
            raise SettingError(key, f"{key}: neither {names[a]!r} nor {names[b]!r} is a body")
        allowed[a, b] = allowed[b, a] = pair.collide
        if pair.friction is not None:
            friction[a, b] = friction[b, a] = pair.friction
    return friction * allowed, allowed


def _more(count: int, what: str) -> str:
    return "" if count == 1 else f" (and {count - 1} more {what}{'s' if count > 2 else ''})"
