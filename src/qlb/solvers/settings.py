"""What a user can set about a solve."""

from __future__ import annotations

from typing import Literal

from pydantic import Field

from qlb.settings import Settings, quantity

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


class SolverSettings(Settings):
    """Settings of the nonlinear solvers; each says which solvers read it."""

    projection: Projection = Field(
        "always",
        description="Project element Hessians to positive semidefinite (all solvers): always; on-demand: only where"
        " Cholesky fails on the exact one; never: shift the diagonal instead",
    )
    initial_guess: InitialGuess = Field(
        "previous",
        description="Where a solve starts (all solvers): x_k, or the predictor from velocity and acceleration",
    )
    max_iterations: int = quantity(500, "Nonlinear iterations of one solve before it counts as failed", ge=1)
    window: int = quantity(5, "Pairs that L-BFGS keeps (QLF, QLB)", ge=1, le=100)
