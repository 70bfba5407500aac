"""Characters: each stands on the plane y = 0 with y up, looks along +x, and is symmetric about z = 0."""

from __future__ import annotations

from collections.abc import Callable
from functools import lru_cache

from qlb.mesh import TetMesh
from qlb.shapes.armadillo import armadillo_solid
from qlb.shapes.bunny import bunny_solid
from qlb.shapes.duck import duck_solid
from qlb.shapes.mesher import mesh_solid
from qlb.shapes.primitives import positive
from qlb.shapes.solid import Solid

_CHARACTERS: dict[str, tuple[Callable[[], Solid], float]] = {
    "armadillo": (armadillo_solid, 0.3124),
    "bunny": (bunny_solid, 0.3055),
    "duck": (duck_solid, 0.2492),
}
"""The solid, and how tall it is [m]."""
DEFAULT_TETS = 8000


def armadillo(*, tets: int | None = None, edge: float | None = None, height: float = 0.3) -> TetMesh:
    """An armadillo on its hind feet, arms up and forward, `height` [m] up to the tips of its ears; else as `bunny`."""
    return _character("armadillo", tets, edge, height)


def bunny(*, tets: int | None = None, edge: float | None = None, height: float = 0.3) -> TetMesh:
    """A sitting bunny, `height` [m] up to the tips of its ears.

    Args:
        tets: about how many tets, 8000 if not given; features need some 3000.
        edge: or, instead, the longest edges [m].
        height: [m].

    Raises:
        InputError: a value out of range, or so few tets that the body falls into pieces or touches itself.
    """
    return _character("bunny", tets, edge, height)


def duck(*, tets: int | None = None, edge: float | None = None, height: float = 0.25) -> TetMesh:
    """A rubber duck, `height` [m] tall; else as `bunny`."""
    return _character("duck", tets, edge, height)


@lru_cache(maxsize=16)
def _character(name: str, tets: int | None, edge: float | None, height: float) -> TetMesh:
    """Meshes cannot be written to, so that one can be handed out many times."""
    make, tall = _CHARACTERS[name]
    solid = make().scaled(positive(f"{name}: height", height) / tall)
    count = DEFAULT_TETS if tets is None and edge is None else tets
    return mesh_solid(solid, tets=count, edge=edge, euler=2, name=name)
