"""What every quantity that varies in space has: its values on a mesh, and the way it was written."""

from __future__ import annotations

from abc import ABC, abstractmethod
from typing import Any, NoReturn

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.mesh.tet_mesh import TetMesh


class Varying(ABC):
    """A quantity that has its values only on a mesh: immutable, and equal where it was written the same.

    Arithmetic on it raises `InputError`: first its values on a mesh, then formulas of them.
    """

    __array_ufunc__ = None  # numpy leaves arithmetic with it to the operators below

    @abstractmethod
    def on(self, mesh: TetMesh) -> FloatArray:
        """Its value in each element, shape (m,), not checked. Raises `InputError` where it has none."""

    @abstractmethod
    def written(self) -> Any:
        """Plain data that gives it back, for a scene file. Raises `InputError` where there is none."""

    @abstractmethod
    def __str__(self) -> str:
        """What it is, in words."""

    def _refuse(self, other: object = None) -> NoReturn:
        raise InputError(f"{self} has its values only on a mesh: use those of `on(mesh)`")

    __add__ = __radd__ = __sub__ = __rsub__ = __mul__ = __rmul__ = __truediv__ = __rtruediv__ = _refuse
    __pow__ = __rpow__ = __neg__ = __float__ = _refuse
