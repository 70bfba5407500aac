"""The problem that every package solves, as plain arrays: the falling bar."""

from __future__ import annotations

from dataclasses import asdict, dataclass
from pathlib import Path
from typing import Any, Protocol

import numpy as np
import numpy.typing as npt

FloatArray = npt.NDArray[np.float64]


@dataclass(frozen=True)
class Problem:
    """One elastic body of linear tets, at rest, that falls with some nodes held.

    The density, in the constants that it takes (Smith, de Goes, Kim 2018, after their reparametrisation):

        log:      mu/2 (I_C - 3) + lam/2 (J - 1 - 3/4 mu/lam)^2 - mu/2 log(I_C + 1)     eq. 14
        no log:   mu/2 (I_C - 3) + lam/2 (J - 1 - mu/lam)^2                              eq. 13
    """

    positions: FloatArray
    """at rest [m], shape (n, 3)"""
    tets: npt.NDArray[np.int64]
    """shape (m, 4), positively oriented"""
    fixed: npt.NDArray[np.bool_]
    """held nodes, shape (n,)"""
    log: bool
    mu: float
    """[Pa]"""
    lam: float
    """[Pa]"""
    density: float
    """[kg/m^3]"""
    gravity: FloatArray
    """[m/s^2], shape (3,)"""
    step: float
    """h [s]"""
    integrator: str
    """BDF1, or BDF2 whose first step is SDIRK2"""
    relative: float
    """a stage ends at |g| <= relative |g(x_k)|, over the free nodes"""

    def save(self, path: Path) -> None:
        """Write it as .npz."""
        np.savez(path, **asdict(self))

    @staticmethod
    def load(path: Path) -> Problem:
        """Read what `save` wrote."""
        with np.load(path) as arrays:
            values: dict[str, Any] = {key: arrays[key] for key in arrays.files}
        return Problem(**{key: value if value.ndim else value.item() for key, value in values.items()})

    def volumes(self) -> FloatArray:
        """Of the tets [m^3]."""
        x = self.positions[self.tets]
        return np.asarray(np.linalg.det(x[:, 1:] - x[:, :1]) / 6)

    def masses(self) -> FloatArray:
        """Lumped, of the nodes [kg]."""
        quarters = np.repeat(self.density * self.volumes() / 4, 4)
        return np.asarray(np.bincount(self.tets.ravel(), quarters, len(self.positions)), dtype=np.float64)

    def extent(self) -> float:
        """The longest side [m]."""
        return float(np.ptp(self.positions, axis=0).max())


class Simulation(Protocol):
    """What every adapter makes of a problem; making it is the set-up that is not timed."""

    settings: str
    """how it was set, in words, for the table"""

    def step(self) -> int:
        """Advance by h; the iterations that it took."""

    def positions(self) -> FloatArray:
        """Now [m], shape (n, 3)."""
