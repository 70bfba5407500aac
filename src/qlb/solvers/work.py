"""What the parts of a solve cost, from counted work, so that a run decides the same on every machine."""

from __future__ import annotations

from qlb import _native

# Nanoseconds on one core, calibrated once (`python -m benchmarks kernels`); only their ratios matter.
PER_FLOP = 0.030
PER_FACTOR_ENTRY = 0.6
PER_SOLVE_ENTRY = 1.0
PER_HESSIAN_TET = 110.0
PER_GRADIENT_TET = 25.0


def cost_of_factor(cholesky: _native.Cholesky, tets: int) -> float:
    """Cost of one assembly and factorisation, in iterations of L-BFGS over the factor."""
    entries = cholesky.factor_nonzeros
    factor = PER_FLOP * cholesky.factor_flops + PER_FACTOR_ENTRY * entries + PER_HESSIAN_TET * tets
    return factor / (PER_SOLVE_ENTRY * entries + PER_GRADIENT_TET * tets)
