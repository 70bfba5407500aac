"""What adds to the energy of a stage: potentials, and the terms of a system that give one for each stage."""

from __future__ import annotations

from typing import Protocol

from qlb import _native
from qlb.arrays import FloatArray
from qlb.integrators.integrator import Stage


class Potential(Protocol):
    """A function Phi(x) [J] of the positions (n, 3) [m]; forces are minus its gradient."""

    def add_value_gradient(self, x: FloatArray, scale: float, gradient: FloatArray, /) -> float:
        """Add scale dPhi/dx to `gradient` (n, 3) and return scale Phi."""

    def add_hessian(self, x: FloatArray, scale: float, project: bool, matrix: _native.BlockMatrix, /) -> None:
        """Add scale d2Phi/dx2 to `matrix`, projected to positive semidefinite where asked."""


class Term(Protocol):
    """A load, a damping or any other part of a system whose potential differs from stage to stage."""

    lagged: bool
    """Whether its potential freezes something at `guess` that belongs at the solution."""

    def at(self, stage: Stage, guess: FloatArray) -> Potential | None:
        """Its potential in a stage; None where it plays no part in it.

        `guess` (n, 3) [m] is a prediction of the stage's positions, of second order. Where there is no inertia, the
        stage is solved again with the solution for a guess, until what is lagged no longer matters.
        """


class DeadLoad:
    """Phi = -f.(x - X): forces that do not depend on the positions."""

    def __init__(self, forces: FloatArray, rest: FloatArray, threads: int) -> None:
        self._forces, self._threads = forces, threads
        self._scaled = 1.0, forces
        self._at_rest = _native.dot(forces, rest, threads)

    def add_value_gradient(self, x: FloatArray, scale: float, gradient: FloatArray, /) -> float:
        """Forces f (n, 3) [N] act against the gradient."""
        if self._scaled[0] != scale:
            self._scaled = scale, scale * self._forces
        gradient -= self._scaled[1]
        return scale * (self._at_rest - _native.dot(self._forces, x, self._threads))

    def add_hessian(self, x: FloatArray, scale: float, project: bool, matrix: _native.BlockMatrix, /) -> None:
        """Nothing: the potential is linear."""
