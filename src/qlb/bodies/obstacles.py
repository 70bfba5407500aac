"""Obstacles: surfaces and planes that stand still or move by a script, whatever pushes against them."""

from __future__ import annotations

from dataclasses import KW_ONLY, dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any, Self

import numpy as np
import numpy.typing as npt

from qlb.arrays import FloatArray, IntArray, vectors
from qlb.errors import InputError
from qlb.mesh.files import read_surface
from qlb.mesh.geometry import SLIVER, longest_edges, triangle_areas

if TYPE_CHECKING:
    from qlb.system.motions import Motion


@dataclass(frozen=True, eq=False)
class Obstacle:
    """A surface of triangles, closed or open, which stands still or moves by a script.

    Args:
        vertices: [m], shape (q, 3).
        triangles: vertex indices, shape (t, 3).
        motion: where the vertices are at each time: `Translation`, `Rotation`, `Keyframes`, `VertexAnimation` or any
            function motion(vertices (q, 3), time [s]) -> positions (q, 3) [m]; None if it stands still.
        name: by which it can be asked for, or "".

    Raises:
        InputError: a vertex that is not finite, an index out of range, a triangle that names a vertex twice or has no
            area, arrays of another shape. The message names the first such vertex or triangle.
    """

    vertices: FloatArray
    triangles: IntArray
    _: KW_ONLY
    motion: Motion | None = None
    name: str = ""

    def __post_init__(self) -> None:
        where = _label("obstacle", self.name)
        vertices, triangles = _array(where, "vertices", self.vertices), _indices(where, self.triangles)
        if vertices.ndim != 2 or vertices.shape[1] != 3:
            raise InputError(f"vertices of {where} have shape {vertices.shape}, must be (q, 3)")
        bad = ~np.isfinite(vertices).all(axis=1)
        if bad.any():
            i = int(np.argmax(bad))
            raise InputError(f"vertex {i} of {where} has position {vertices[i].tolist()}, must be finite")
        _check_triangles(where, vertices, triangles)
        _check_motion(where, self.motion, len(vertices))
        for name, array in (("vertices", vertices), ("triangles", triangles.astype(np.int32))):
            array.setflags(write=False)
            object.__setattr__(self, name, array)

    @classmethod
    def read(cls, path: str | Path, *, motion: Motion | None = None, name: str = "") -> Self:
        """Read the triangles of a surface file (OBJ, STL, PLY, glTF, USD, ...); see `qlb.mesh.read_surface`.

        Raises:
            InputError: the file is missing, unreadable, has no triangles, or fails the checks of `Obstacle`.
        """
        return cls(*read_surface(path), motion=motion, name=name)


@dataclass(frozen=True, eq=False)
class Plane:
    """A solid half-space: bodies are to stay where (x - point).normal > 0.

    Args:
        point: on its face [m], shape (3,).
        normal: out of the solid, of any length > 0; kept with length 1.
        motion: of the point, as for an `Obstacle`: the plane is shifted, never turned. None if it stands still.
        name: by which it can be told from others, or "".

    Raises:
        InputError: an argument is out of range; the message names it.
    """

    point: tuple[float, float, float]
    normal: tuple[float, float, float]
    _: KW_ONLY
    motion: Motion | None = None
    name: str = ""

    def __post_init__(self) -> None:
        where = _label("plane", self.name)
        point, normal = (vectors(f"{n} of {where}", getattr(self, n), (3,)) for n in ("point", "normal"))
        largest = np.abs(normal).max()
        if not largest > 0:
            raise InputError(f"normal of {where} = {self.normal} has no length: must be a direction")
        normal /= largest  # squares neither overflow nor vanish
        normal /= np.linalg.norm(normal)
        _check_motion(where, self.motion)
        object.__setattr__(self, "point", tuple(point.tolist()))
        object.__setattr__(self, "normal", tuple(normal.tolist()))

    def point_at(self, time: float) -> FloatArray:
        """The point at `time` [s]: [m], shape (3,). Raises `InputError` for a motion that gives no point."""
        point = np.array(self.point)
        if self.motion is None:
            return point
        where = f"{_label('plane', self.name)} at time {time:g} s"
        return vectors(f"the motion of {where}", np.reshape(self.motion(point[None], time), -1), (3,))


def _label(kind: str, name: str) -> str:
    if not isinstance(name, str):
        raise InputError(f"name of an obstacle = {name!r} must be text")
    return f"{kind} '{name}'" if name else f"an {kind}" if kind[0] in "aeiou" else f"a {kind}"


def _array(where: str, what: str, values: npt.ArrayLike) -> FloatArray:
    try:
        return np.array(values, dtype=np.float64, order="C")
    except (TypeError, ValueError):
        raise InputError(f"{what} of {where} are not an array of numbers") from None


def _indices(where: str, values: npt.ArrayLike) -> npt.NDArray[np.integer]:
    """`values` as integers (t, 3), t >= 1; a copy."""
    given = _array(where, "triangles", values)
    if given.ndim != 2 or given.shape[1] != 3 or len(given) == 0:
        raise InputError(f"triangles of {where} have shape {given.shape}, must be (t, 3) with t >= 1")
    kind = np.asarray(values).dtype
    if not np.issubdtype(kind, np.integer):
        raise InputError(f"triangles of {where} have type {kind}, must be integers")
    return np.array(values, dtype=np.int64, order="C")


def _check_triangles(where: str, vertices: FloatArray, triangles: npt.NDArray[np.integer]) -> None:
    outside = (triangles < 0) | (triangles >= len(vertices))
    if outside.any():
        t, a = np.argwhere(outside)[0]
        raise InputError(f"triangle {t} of {where} names vertex {triangles[t, a]}, must be in [0, {len(vertices) - 1}]")
    ordered = np.sort(triangles, axis=1)
    twice = (ordered[:, 1:] == ordered[:, :-1]).any(axis=1)
    if twice.any():
        t = int(np.argmax(twice))
        raise InputError(f"triangle {t} of {where} names a vertex twice: {triangles[t].tolist()}, all must differ")
    longest = longest_edges(vertices, triangles)
    area = triangle_areas(vertices, triangles)
    flat = area <= SLIVER * longest**2
    if flat.any():
        t = int(np.argmax(flat))
        raise InputError(
            f"triangle {t} of {where} is degenerate: area {area[t]:.3g} m^2, must be > {SLIVER:g} of its longest edge"
            f" squared ({SLIVER * longest[t] ** 2:.3g} m^2); vertices {triangles[t].tolist()}"
        )


def _check_motion(where: str, motion: Any, vertices: int = 1) -> None:
    from qlb.system.motions import VertexAnimation

    if not (motion is None or callable(motion)):
        raise InputError(f"motion of {where} = {motion!r} must be a function of (positions, time), or None")
    if isinstance(motion, VertexAnimation) and motion.vertices != vertices:
        raise InputError(f"the animation of {where} moves {motion.vertices} vertices, must be {vertices}")
