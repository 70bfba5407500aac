"""A Cholesky factor of a stage's Hessian, made positive definite where it is not."""

from __future__ import annotations

from collections.abc import Iterator

import numpy as np

from qlb import _native
from qlb.arrays import BoolArray, FloatArray, IntArray
from qlb.contact.stage import ContactPoint
from qlb.errors import InputError
from qlb.solvers.contact_matrix import ContactMatrix
from qlb.solvers.settings import Projection
from qlb.system import StageProblem, System
from qlb.system.system import CholeskyKind, Precision


class HessianNotFinite(FloatingPointError):
    """A Hessian is not finite. A class of its own, so that what a user's code raises is not mistaken for it."""


class Factor:
    """Owns the analysed factorisation of a system and counts how often it is made."""

    def __init__(self, system: System, cholesky: CholeskyKind = "supernodal", precision: Precision = "float64") -> None:
        self.cholesky = system.analyse(cholesky, precision)
        self._system, self._kind = system, cholesky
        self._with_contact: ContactMatrix | None = None
        self.shifted = False
        """Whether it is of a Hessian with multiples of the identity added."""
        self._precision = precision
        self.raised = False
        """Whether precision "auto" has gone over to float64."""
        self._matrix = _native.BlockMatrix(system.pattern)
        self.count = 0
        """Factorisations tried so far."""
        self.projected = False
        """Whether the factor in place is of the projected Hessian."""

    def update(
        self,
        problem: StageProblem,
        x: FloatArray,
        projection: Projection,
        contact: ContactPoint | _native.RankOneTerms | None = None,
    ) -> None:
        """Factorise the Hessian at `x`, with that of `contact` there where it is given.

        With projection "on-demand" the exact Hessian is tried first. Should the last matrix that `projection` allows
        still not be positive definite (to rounding, or an exact one under "never"), precision "auto" goes over to
        float64 for good; after that multiples of the identity are added, each time ten times more (Nocedal, Wright
        2006, algorithm 3.3).

        Raises:
            HessianNotFinite: nothing helps.
        """
        self.shifted = False
        if self._try(problem, x, projection, contact):
            return
        scale = float(np.abs(self._matrix.values).max())
        if np.isfinite(scale) and self.raise_precision() and self._try(problem, x, projection, contact):
            return
        self.shifted = True
        for shift in _shifts(scale):
            self._matrix.shift_diagonal(shift)
            if self._factorise(problem, x, contact):
                return
        raise HessianNotFinite("the Hessian has entries that are not finite")

    def _try(
        self,
        problem: StageProblem,
        x: FloatArray,
        projection: Projection,
        contact: ContactPoint | _native.RankOneTerms | None,
    ) -> bool:
        """The Hessians at `x` that `projection` allows, one after the other."""
        for project in {"always": [True], "on-demand": [False, True], "never": [False]}[projection]:
            problem.hessian(x, project=project, matrix=self._matrix)
            self.projected = project
            if self._factorise(problem, x, contact):
                return True
        return False

    def raise_precision(self) -> bool:
        """Go over to float64 from the next factor on, where precision "auto" has not yet; whether it did."""
        if self._precision != "auto" or self.raised:
            return False
        assert isinstance(self.cholesky, _native.SupernodalCholesky)
        self.cholesky.set_precision("float64")
        self.raised = True
        return True

    def _factorise(
        self, problem: StageProblem, x: FloatArray, contact: ContactPoint | _native.RankOneTerms | None
    ) -> bool:
        matrix = self._matrix
        if contact is not None:
            matrix = self._add_contact(problem, x, contact)
        with problem.timer.section("factor"):
            self.count += 1
            return self.cholesky.factorise(matrix) < 0

    def _add_contact(
        self, problem: StageProblem, x: FloatArray, contact: ContactPoint | _native.RankOneTerms
    ) -> _native.BlockMatrix:
        with problem.timer.section("contact"):
            matrix = self._contact_matrix().assemble(self._matrix, contact, x)
            self.cholesky = self._contact_matrix().cholesky
            return matrix

    def _contact_matrix(self) -> ContactMatrix:
        if self._with_contact is None:
            self._with_contact = ContactMatrix(self._system, self._kind, self.cholesky)
        return self._with_contact

    def save(self) -> dict[str, FloatArray]:
        """What the pattern was extended for: it decides how the next matrices are factorised, to the bit."""
        if self._with_contact is None or not len(self._with_contact.stencils):
            return {}
        return {"stencils": self._with_contact.stencils.astype(np.float64)}

    def load(self, arrays: dict[str, FloatArray]) -> None:
        """Take back what `save` gave."""
        if "stencils" in arrays:
            self._contact_matrix().analyse(arrays["stencils"].astype(np.int32))
            self.cholesky = self._contact_matrix().cholesky

    def fits(self, nodes: IntArray) -> BoolArray:
        """Which contacts with these nodes (k, 4) fit into the pattern as it is."""
        return self._contact_matrix().fits(nodes)

    def matrix_values(self) -> FloatArray:
        """A copy of the blocks (b, 3, 3) that the factor in place is of."""
        return self._matrix.values.copy()

    def restore(
        self, values: FloatArray, *, projected: bool, raised: bool, contact: _native.RankOneTerms | None = None
    ) -> None:
        """Factorise what `matrix_values` gave and `contact`, in the precision of then, without counting it."""
        if raised:
            self.raise_precision()
        if values.shape != self._matrix.values.shape:
            raise InputError(f"blocks have shape {values.shape}, must be {self._matrix.values.shape}")
        self._matrix.values[...] = values
        self.projected = projected
        matrix = self._matrix
        if contact is not None:
            matrix = self._contact_matrix().assemble(matrix, contact, np.empty(0))
            self.cholesky = self._contact_matrix().cholesky
        self.cholesky.factorise(matrix)

    def solve(self, problem: StageProblem, b: FloatArray) -> FloatArray:
        """B^-1 b, shape (n, 3), zero at held degrees of freedom."""
        with problem.timer.section("solve"):
            x = np.empty_like(b)
            self.cholesky.apply(b, x)
            return x


def _shifts(scale: float) -> Iterator[float]:
    """What to add to the diagonal of a matrix whose largest entry is `scale`, time after time."""
    total = 0.0
    for exponent in range(-10, 3):
        wanted = scale * 10.0**exponent
        if np.isfinite(wanted):
            yield wanted - total
        total = wanted
