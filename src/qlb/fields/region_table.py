"""A table by region."""

from __future__ import annotations

import re
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.fields.varying import Varying
from qlb.mesh.tet_mesh import TetMesh

DEFAULT = "default"


@dataclass(frozen=True)
class RegionTable(Varying):
    """One value for each region of a mesh, and perhaps one for all other regions.

    Attributes:
        regions: region id and value, by increasing id.
        default: the value of all other regions, or None if the table must name every region of a mesh.
    """

    regions: tuple[tuple[int, float], ...]
    default: float | None = None

    @staticmethod
    def parse(table: Mapping[object, object]) -> RegionTable:
        """From a mapping such as `{1: 2e4, 2: 5e4, "default": 1e4}`. Raises `InputError` for a wrong key or value."""
        values: dict[int | None, float] = {}
        for key, value in table.items():
            region = _region(key)
            if region in values:
                raise InputError(f"region {key!r} is in the table twice")
            values[region] = _number(key, value)
        if not values:
            raise InputError("a table by region is empty, must have one region or more, or 'default'")
        default = values.pop(None, None)
        return RegionTable(tuple(sorted((k, v) for k, v in values.items() if k is not None)), default)

    def on(self, mesh: TetMesh) -> FloatArray:
        """The value of each element's region (m,). Raises `InputError` for a region that the table lacks."""
        if mesh.regions is None:
            raise InputError(f"{self} needs a mesh with regions, and this mesh has none")
        found, index = np.unique(mesh.regions, return_inverse=True)
        values = dict(self.regions)
        missing = [int(r) for r in found if int(r) not in values]
        if missing and self.default is None:
            more = f" (and {len(missing) - 1} more)" if missing[1:] else ""
            raise InputError(f"region {missing[0]} of the mesh{more} is missing from {self}")
        column = np.array([values.get(int(r), self.default) for r in found], dtype=np.float64)
        return np.asarray(column[index.reshape(-1)])

    def written(self) -> dict[int | str, float]:
        """The mapping that gives it back."""
        rest: dict[int | str, float] = {} if self.default is None else {DEFAULT: self.default}
        return {**dict(self.regions), **rest}

    def __str__(self) -> str:
        """Names its regions."""
        return f"the table of {', '.join(f'region {k}' if isinstance(k, int) else k for k in self.written())}"


def _region(key: object) -> int | None:
    """A region id, as an integer or (from JSON) as text; None for "default"."""
    if key == DEFAULT:
        return None
    if isinstance(key, int | np.integer) and not isinstance(key, bool):
        return int(key)
    if isinstance(key, str) and re.fullmatch(r"-?[0-9]{1,18}", key):
        return int(key)
    raise InputError(f"{key!r} is not a region: must be a whole number or '{DEFAULT}'")


def _number(key: object, value: object) -> float:
    try:
        if isinstance(value, bool):
            raise TypeError
        return float(value)  # type: ignore[arg-type]
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"region {key!r} has value {value!r}, which is not a number") from None
