"""Bodies and obstacles as one set of nodes and tets."""

from __future__ import annotations

from collections.abc import Callable, Iterable, Sequence
from functools import cached_property
from typing import TypeVar

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray
from qlb.bodies.body import Body
from qlb.bodies.obstacles import Obstacle, Plane
from qlb.errors import InputError
from qlb.materials.fibres import Fibres
from qlb.materials.material import Material, per_element
from qlb.mesh.tet_mesh import TetMesh
from qlb.settings import PerElement

T = TypeVar("T")


class Assembly:
    """What a system is made of.

    A group is a body or an obstacle: body b is group b, obstacle o is group len(bodies) + o. Nodes come group by group;
    those of obstacles belong to no tet and have no mass. Tets come body by body. Planes have no nodes.

    Attributes:
        bodies: in the order given.
        obstacles: surfaces, in the order given.
        planes: in the order given.
        mesh: nodes and tets of all bodies as they lie at rest, n nodes.
        system_mesh: the same with the q vertices of the obstacles behind; `mesh` itself where there are none.
        node_begin: first node of each group, and n + q, shape (groups + 1,).
        tet_begin: first tet of each body, and m, shape (bodies + 1,).

    Raises:
        InputError: no body, something else among the bodies or obstacles, one given twice, a name given twice.
    """

    def __init__(self, bodies: Iterable[Body], obstacles: Iterable[Obstacle | Plane] = ()) -> None:
        self.bodies, given = _checked("bodies", bodies, Body), _checked("obstacles", obstacles, Obstacle, Plane)
        if not self.bodies:
            raise InputError("a simulation needs a body, and none is given")
        _require_distinct([*self.bodies, *given])
        self.obstacles = tuple(o for o in given if isinstance(o, Obstacle))
        self.planes = tuple(p for p in given if isinstance(p, Plane))
        placed = [body.placed for body in self.bodies]
        self.mesh = TetMesh.union(placed)
        vertices = [obstacle.vertices for obstacle in self.obstacles]
        self.system_mesh = self.mesh.with_loose_nodes(np.concatenate(vertices) if vertices else np.empty((0, 3)))
        counts = [len(mesh.positions) for mesh in placed] + [len(v) for v in vertices]
        self.node_begin = np.cumsum([0, *counts])
        self.tet_begin = np.cumsum([0, *(len(mesh.tets) for mesh in placed)])

    @property
    def body_nodes(self) -> int:
        """n, the number of nodes of all bodies."""
        return len(self.mesh.positions)

    @cached_property
    def groups(self) -> IntArray:
        """The group of each node, shape (n + q,)."""
        counts = np.diff(self.node_begin)
        return np.repeat(np.arange(len(counts), dtype=np.int32), counts)

    @cached_property
    def obstacle_triangles(self) -> IntArray:
        """Triangles of all obstacles in node indices of the system, shape (t, 3)."""
        begin = self.node_begin[len(self.bodies) :]
        shifted = [o.triangles + k for o, k in zip(self.obstacles, begin[:-1], strict=True)]
        return np.concatenate([np.empty((0, 3)), *shifted]).astype(np.int32)

    @cached_property
    def surface_faces(self) -> IntArray:
        """Outward boundary triangles of all bodies, then the triangles of the obstacles, shape (f, 3)."""
        return np.concatenate([self.mesh.boundary_triangles(), self.obstacle_triangles])

    def velocities(self) -> FloatArray:
        """Initial velocities [m/s], shape (n + q, 3); those of obstacles are zero."""
        still = np.zeros((int(self.node_begin[-1]) - self.body_nodes, 3))
        return np.concatenate([*(np.asarray(body.velocity) for body in self.bodies), still])

    def group_of(self, which: int | str | Body | Obstacle) -> int:
        """The group of a body or obstacle, given itself, its name or its group. Raises `InputError` for none."""
        members: Sequence[Body | Obstacle] = [*self.bodies, *self.obstacles]
        if isinstance(which, int | np.integer) and not isinstance(which, bool):
            if 0 <= which < len(members):
                return int(which)
            raise InputError(f"group {which} is out of range: must be in [0, {len(members) - 1}]")
        if isinstance(which, str):
            names = [member.name for member in members]
            if which and which in names:
                return names.index(which)
            known = ", ".join(repr(name) for name in names if name) or "none has a name"
            raise InputError(f"no body or obstacle has the name {which!r}: {known}")
        for group, member in enumerate(members):
            if member is which:
                return group
        raise InputError(f"{type(which).__name__} is not among the bodies and obstacles of this simulation")

    @cached_property
    def labels(self) -> list[str]:
        """What each group, then each plane is called: its name, or its kind and number, as "plane 0"."""
        labels = [body.name or f"body {k}" for k, body in enumerate(self.bodies)]
        labels += [obstacle.name or f"obstacle {k}" for k, obstacle in enumerate(self.obstacles)]
        return labels + [plane.name or f"plane {k}" for k, plane in enumerate(self.planes)]

    def nodes_of(self, which: int | str | Body | Obstacle) -> IntArray:
        """Nodes of a body or obstacle, shape (k,); see `group_of`."""
        begin, end = self.node_begin[self.group_of(which) :][:2]
        return np.arange(begin, end, dtype=np.int32)

    @cached_property
    def materials(self) -> list[Material]:
        """The material of each body, with its parameters on the body's placed mesh.

        Raises:
            InputError: a parameter that does not fit; where there are several bodies, the message names the body.
        """
        return [self.on_body(b, body.material.on) for b, body in enumerate(self.bodies)]

    def on_body(self, b: int, take: Callable[[TetMesh], T]) -> T:
        """`take` of the placed mesh of body `b`; an `InputError` gets the name of the body."""
        body = self.bodies[b]
        try:
            return take(body.placed)
        except InputError as error:
            if len(self.bodies) == 1:
                raise
            raise InputError(f"body {repr(body.name) if body.name else b}: {error}") from None

    def per_element(self, value: Callable[[Material], PerElement]) -> FloatArray:
        """A property of the material of each tet, shape (m,)."""
        counts = np.diff(self.tet_begin)
        return np.concatenate([per_element(m, value(m), int(k)) for m, k in zip(self.materials, counts, strict=True)])


def assemble(
    given: TetMesh | Body | Sequence[Body],
    material: Material | None,
    fibres: Sequence[Fibres],
    velocity: npt.ArrayLike | None,
    obstacles: Iterable[Obstacle | Plane],
) -> Assembly:
    """The assembly that arguments of `Simulation` or `System` mean: one mesh with its material, or bodies.

    Raises:
        InputError: a mesh without material; material, fibres or velocity beside bodies, which have their own.
    """
    if isinstance(given, TetMesh):
        if not isinstance(material, Material):
            problem = "is missing" if material is None else f"= {material!r} is out of range"
            raise InputError(f"material {problem}: must be a Material, such as qlb.StableNeoHookean()")
        still = (0.0, 0.0, 0.0)
        body = Body(given, material, fibres=tuple(fibres), velocity=still if velocity is None else velocity)
        return Assembly([body], obstacles)
    beside = {"material": material is not None, "fibres": bool(fibres), "velocity": velocity is not None}
    for name, is_given in beside.items():
        if is_given:
            raise InputError(f"{name} cannot be given beside bodies: each body has its own")
    return Assembly([given] if isinstance(given, Body) else given, obstacles)


def _checked(what: str, given: Iterable[T], *kinds: type) -> tuple[T, ...]:
    allowed = " or ".join(kind.__name__ for kind in kinds)
    if not isinstance(given, Iterable):
        raise InputError(f"{what} = {type(given).__name__} must be a sequence of {allowed}")
    members = tuple(given)
    for k, member in enumerate(members):
        if not isinstance(member, kinds):
            raise InputError(f"number {k} of the {what} is a {type(member).__name__}, must be {allowed}")
    return members


def _require_distinct(members: Sequence[Body | Obstacle | Plane]) -> None:
    """Raise `InputError` where one stands there twice, or two have one name."""
    if len({id(member) for member in members}) < len(members):
        raise InputError("a body or obstacle is given more than once")
    names = [member.name for member in members if member.name]
    twice = next((name for k, name in enumerate(names) if name in names[:k]), None)
    if twice is not None:
        raise InputError(f"the name {twice!r} is given to more than one body or obstacle")
