"""What a user can set about a solve."""

from __future__ import annotations

from typing import Any, Literal

from pydantic import Field

from qlb.settings import Settings, quantity
from qlb.system.system import CholeskyKind, Precision

Projection = Literal["always", "on-demand", "never"]
InitialGuess = Literal["previous", "predictor"]


class Tolerance(Settings):
    """When a solve has converged: |g| at or below any of these."""

    relative: float = quantity(1e-6, "|g| relative to |g(x_k)|, whatever the initial guess", ge=0, lt=1)
    absolute: float = quantity(0.0, "|g| itself [kg m; N in quasistatics]; 0 turns it off", ge=0)
    scaled: float = quantity(
        1e-12,
        "|g| relative to |c^2 E_i V_i^(2/3)|, the residual of a strain of order one (after Zhu, Bridson, Kaufman"
        " 2018); the default only catches states at rest, where nothing but rounding is left",
        ge=0,
    )
    step: float = quantity(
        1e-2,
        "Where something touches: |p|_inf of the search direction relative to contact.dhat; 0 turns it off, then only"
        " |g| counts",
        ge=0,
    )


class SolverSettings(Settings):
    """Settings of the nonlinear solvers; each says which solvers read it, and what they take where it is not given."""

    projection: Projection | None = Field(
        None,
        description="Project element Hessians to positive semidefinite: always (default of ND, QLF, QLB); on-demand:"
        " only where Cholesky fails on the exact one (default of QLA); never: shift the diagonal instead",
    )
    initial_guess: InitialGuess | None = Field(
        None,
        description="Where a solve starts: previous, that is x_k (default of ND, QLF, QLB), or the predictor from"
        " velocity and acceleration (default of QLA), in contact the free part of the way that inertia takes",
    )
    max_iterations: int | None = quantity(
        None, "Nonlinear iterations of one solve before it counts as failed: 500, in QLA 5000", ge=1
    )
    window: int | None = quantity(None, "Pairs that L-BFGS keeps: 5 in QLF and QLB, 8 in QLA", ge=1, le=100)
    precision: Precision | None = Field(
        None,
        description="Of the Cholesky factor and its solves, all else being float64: float64 (default of ND, QLF, QLB);"
        " float32; compact: float32, of which solves read a copy in 16 bits; auto (default of QLA): compact, until a"
        " matrix is too ill-conditioned for that, then float64",
    )
    cholesky: CholeskyKind = Field(
        "supernodal",
        description="Which Cholesky: our own supernodal one, or CHOLMOD, the reference (float64 only; not for QLA in"
        " contact)",
    )
    keep_factor: bool = Field(True, description="Keep the factor over steps while that pays (QLA)")
    carry_factor: bool = Field(True, description="Carry the factor along with the motion of the material (QLA)")
    refactor_in_solve: bool = Field(True, description="Make a new factor within a solve that contracts slowly (QLA)")

    def completed(self, defaults: dict[str, Any]) -> CompleteSettings:
        """These settings with `defaults` for what is not given."""
        if self.cholesky == "cholmod":
            defaults = defaults | {"precision": "float64"}
        given = {name: getattr(self, name) for name in type(self).model_fields}
        return CompleteSettings(**given | {k: v for k, v in defaults.items() if given[k] is None})


class CompleteSettings(SolverSettings):
    """What a solver goes by: nothing is left open."""

    projection: Projection
    initial_guess: InitialGuess
    max_iterations: int
    window: int
    precision: Precision
