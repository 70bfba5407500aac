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
        self.normals: FloatArray = np.array([plane.normal for plane in around.planes]).reshape(-1, 3)
        self.dhat = self._resolve_dhat()
        self.stiffness = settings.stiffness or around.young
        self.barrier = _native.Barrier(self.surface, self.dhat, self.stiffness, around.threads, settings.mode)
        vertices = self.surface.vertices
        self.vertices: IntArray = vertices[around.groups[vertices] < around.bodies]
        """surface nodes of bodies"""
        self._near_planes = self.plane_allowed[:, around.groups[self.vertices]].T != 0

    @property
    def is_barrier(self) -> bool:
        """Whether nothing may pass through anything."""
        return self.settings.mode == "barrier"

    @property
    def has_friction(self) -> bool:
        """Whether anything slides with friction."""
        return bool(self.friction.any())

    def offsets(self, time: float) -> FloatArray:
        """Of the planes at `time` [s]: n.x = offset on each, shape (q,) [m]."""
        points = np.array([plane.point_at(time) for plane in self.around.planes]).reshape(-1, 3)
        return np.asarray(np.einsum("qi,qi->q", self.normals, points))

    def plane_gaps(self, x: FloatArray, offsets: FloatArray) -> FloatArray:
        """Distances [m] of `vertices` from each plane, shape (v, q); infinite where they may not touch."""
        gaps = x[self.vertices] @ self.normals.T - offsets
        return np.where(self._near_planes, gaps, np.inf)

    def describe(self, node: int) -> str:
        """A node by its body or obstacle."""
        group = int(self.around.groups[node])
        first = int(np.argmax(self.around.groups == group))
        return f"{self.around.names[group]} node {node - first}"

    def intersection(self, x: FloatArray, time: float) -> str | None:
        """What passes through what at positions `x` (n, 3) [m], in words; None where nothing does."""
        gaps = self.plane_gaps(x, self.offsets(time))
        if gaps.size and not gaps.min() > 0:
            v, q = np.unravel_index(np.argmin(gaps), gaps.shape)
            plane = self.around.names[len(self.around.names) - len(self.around.planes) + int(q)]
            count = int((gaps <= 0).sum())
            return f"{self.describe(self.vertices[v])} is {-gaps[v, q]:.4g} m behind {plane}{_more(count, 'node')}"
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

    def _resolve_dhat(self) -> float:
        """The distance that was set, with a warning where it is larger than a feature; else the default."""
        edges, groups = self.surface.edges, self.around.groups
        lengths = np.linalg.norm(self.around.rest[edges[:, 0]] - self.around.rest[edges[:, 1]], axis=1)
        mean = float(lengths[groups[edges[:, 0]] < self.around.bodies].mean())
        wanted = self.settings.dhat or DHAT_OF_EDGE * mean
        gap, body = self._smallest_rest_gap(wanted)
        if gap >= wanted:
            return wanted
        if self.settings.dhat is None:
            return 0.5 * gap
        warnings.warn(
            f"contact.dhat = {wanted:.4g} m is larger than a feature of {body}: parts of it that are {gap:.4g} m apart"
            f" at rest push each other; below {gap:.4g} m nothing is prestressed",
            QlbWarning,
            stacklevel=2,
        )
        return wanted

    def _smallest_rest_gap(self, within: float) -> tuple[float, str]:
        """The smallest distance between parts of one body at rest that do not meet, up to `within` [m]; the body."""
        smallest, body = np.inf, ""
        rest, faces, groups = self.around.rest, self.around.faces, self.around.groups
        still = np.zeros_like(rest)
        for b in range(self.around.bodies) if self.settings.self_contact else ():
            own = np.ascontiguousarray(faces[groups[faces[:, 0]] == b])
            alone = np.zeros((groups.max() + 1,) * 2, dtype=np.uint8)
            alone[b, b] = 1
            search = _native.Candidates(_native.ContactSurface(rest, own, groups, alone), self.around.threads)
            search.build(rest, still, 0.0, within)
            gap = search.minimum_distance(rest)
            if gap < smallest:
                smallest, body = gap, self.around.names[b]
        return smallest, body


def _tables(settings: Contact, around: Surroundings) -> tuple[FloatArray, np.ndarray]:
    """mu, and whether they may touch, of each two groups or planes (g, g)."""
    names, count = list(around.names), len(around.names)
    friction = np.full((count, count), settings.friction)
    allowed = np.zeros((count, count), dtype=bool)
    for a, b in combinations_with_replacement(range(count), 2):
        allowed[a, b] = allowed[b, a] = a < around.bodies and (a != b or settings.self_contact)
    for k, pair in enumerate(settings.pairs):
        for name in pair.between:
            if name not in names:
                raise InputError(f"contact.pairs.{k}: {name!r} is not known: must be one of {', '.join(names)}")
        a, b = (names.index(name) for name in pair.between)
        if min(a, b) >= around.bodies:
            raise InputError(f"contact.pairs.{k}: neither {names[a]!r} nor {names[b]!r} is a body")
        allowed[a, b] = allowed[b, a] = pair.collide
        if pair.friction is not None:
            friction[a, b] = friction[b, a] = pair.friction
    return friction * allowed, allowed


def _more(count: int, what: str) -> str:
    return "" if count == 1 else f" (and {count - 1} more {what}{'s' if count > 2 else ''})"
