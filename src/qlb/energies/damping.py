"""Damping: Rayleigh's two kinds, and Kelvin-Voigt viscosity."""

from __future__ import annotations

import numpy as np

from qlb import _native
from qlb.arrays import FloatArray
from qlb.energies.potential import Potential
from qlb.integrators.integrator import Stage
from qlb.settings import PerElement, Settings, quantity


class Damping(Settings):
    """What takes energy out of the motion; all three may act at once. Quasistatics knows none of them."""

    mass: float = quantity(0.0, "Rayleigh's mass-proportional damping alpha, a force -alpha M v", unit="1/s", ge=0)
    stiffness: float = quantity(
        0.0,
        "Rayleigh's stiffness-proportional damping beta, a force -beta K v with the projected elastic stiffness K at"
        " the predicted positions",
        unit="s",
        ge=0,
    )
    viscosity: PerElement = quantity(
        0.0, "Kelvin-Voigt viscosity eta, a second Piola-Kirchhoff stress 2 eta dE/dt", unit="Pa s", ge=0
    )


class KelvinVoigt:
    """Viscous stress S = 2 eta dE/dt of the Green strain E, as a potential of the stage; objective.

    Phi = sum_e vol_e eta/c |E(x) - E_b|^2, where E_b combines the strains of earlier positions as x_b combines the
    positions: so (E - E_b)/c is the integrator's own derivative of E and keeps its order. With BDF1 it is the
    dissipation potential of Brown, Overby, Forootaninia, Narain 2018. There is one E_b: a potential is good until the
    next is asked for.
    """

    lagged = False

    def __init__(self, blocks: _native.TetBlocks, viscosity: FloatArray, threads: int) -> None:
        """`viscosity` (m,) [Pa s]."""
        self._viscosity = _native.Viscosity(blocks, viscosity, threads)

    def at(self, stage: Stage, guess: FloatArray) -> Potential | None:
        """The potential with E_b from the stage's base."""
        if not stage.inertial:
            return None
        self._viscosity.clear_base(stage.c)
        for weight, positions in stage.base:
            self._viscosity.add_base(weight, positions)
        return self._viscosity


class StiffnessDamping:
    """Phi = beta/(2c) |x - x_b|^2_K, with the projected stiffness K [N/m] of the elastic potentials at the guess.

    Where that is not defined (a material with log J, an element turned inside out), K is that of the last positions.
    There is one matrix: a potential is good until the next is asked for.
    """

    lagged = True

    def __init__(self, beta: float, elastic: list[Potential], pattern: _native.BlockPattern, threads: int) -> None:
        self._beta, self._elastic, self._threads = beta, elastic, threads
        self._matrix = _native.BlockMatrix(pattern)

    def at(self, stage: Stage, guess: FloatArray) -> Potential | None:
        """The potential with K assembled anew."""
        if not stage.inertial:
            return None
        for positions in (guess, stage.base[0][1]):
            self._matrix.set_zero(self._threads)
            for potential in self._elastic:
                potential.add_hessian(positions, self._beta / stage.c, True, self._matrix)
            if np.isfinite(self._matrix.values).all():
                break
        return _Quadratic(self._matrix, stage.x_b, self._threads)


class _Quadratic:
    """Phi = 1/2 (x - x_b).A (x - x_b)."""

    def __init__(self, matrix: _native.BlockMatrix, x_b: FloatArray, threads: int) -> None:
        self._matrix, self._x_b, self._threads = matrix, x_b, threads

    def add_value_gradient(self, x: FloatArray, scale: float, gradient: FloatArray, /) -> float:
        moved = x - self._x_b
        force = np.empty_like(moved)
        self._matrix.multiply(moved, force)
        gradient += scale * force
        return 0.5 * scale * _native.dot(moved, force, self._threads)

    def add_hessian(self, x: FloatArray, scale: float, project: bool, matrix: _native.BlockMatrix, /) -> None:
        matrix.values[...] += scale * self._matrix.values
