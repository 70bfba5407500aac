"""Characters: each stands on the plane y = 0 with y up, looks along +x, and is symmetric about z = 0."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from qlb.mesh import TetMesh
from qlb.shapes.bunny import bunny_solid
from qlb.shapes.duck import duck_solid
from qlb.shapes.mesher import mesh_solid
from qlb.shapes.primitives import positive
from qlb.shapes.solid import Solid

_CHARACTERS: dict[str, tuple[Callable[[], Solid], float]] = {
    "bunny": (bunny_solid, 0.3077),
    "duck": (duck_solid, 0.25),
}
"""The solid, and how tall it is [m]."""
DEFAULT_TETS = 8000


def bunny(*, tets: int | None = None, edge: float | None = None, height: float = 0.3) -> TetMesh:
    """A sitting bunny, `height` [m] up to the tips of its ears, of about `tets` tets (8000 if not given)."""
    return _character("bunny", tets, edge, height)


def duck(*, tets: int | None = None, edge: float | None = None, height: float = 0.25) -> TetMesh:
    """A rubber duck, `height` [m] tall, of about `tets` tets (8000 if not given) or with longest edges `edge` [m]."""
    return _character("duck", tets, edge, height)


@lru_cache(maxsize=16)
def _character(name: str, tets: int | None, edge: float | None, height: float) -> TetMesh:
    """Meshes cannot be written to, so that one can be handed out many times."""
    make, tall = _CHARACTERS[name]
    solid = make().scaled(positive(f"{name}: height", height) / tall)
    return mesh_solid(solid, tets=DEFAULT_TETS if tets is None and edge is None else tets, edge=edge, name=name)
