"""What the parts of a solve cost, from counted work, so that a run decides the same on every machine."""

from __future__ import annotations

from qlb import _native

# Nanoseconds on one core with AVX-512, fitted once to `python -m benchmarks factor step`, those of terms estimated from
# the iterations of `ducks` with 300 terms; only their ratios matter.
PER_FLOP = {"compact": 0.0073, "float32": 0.0073, "float64": 0.015}
PER_FACTOR_ENTRY = {"compact": 3.5, "float32": 3.0, "float64": 4.8}
PER_SOLVE_ENTRY = {"compact": 0.4, "float32": 0.7, "float64": 1.2}
PER_HESSIAN_TET = 110.0
PER_GRADIENT_TET = 25.0
PER_ITERATION = 1e5
PER_TERM = 4e3
PER_TERM_CUBED = 0.01


def cost_of_factor(cholesky: _native.Cholesky, precision: str, tets: int) -> float:
    """Cost of one assembly and factorisation, in iterations of L-BFGS over the factor.

    `precision` is that of the factor; "auto" counts as the "compact" that it starts with.
    """
    kind = _kind(precision)
    entries = cholesky.factor_nonzeros
    factor = PER_FLOP[kind] * cholesky.factor_flops + PER_FACTOR_ENTRY[kind] * entries + PER_HESSIAN_TET * tets
    return factor / _iteration(cholesky, kind, tets)


def cost_of_terms(terms: int, cholesky: _native.Cholesky, precision: str, tets: int) -> float:
    """What rank-one terms beside a factor add to an iteration over it, in such iterations."""
    return (PER_TERM * terms + PER_TERM_CUBED * terms**3) / _iteration(cholesky, _kind(precision), tets)


def _iteration(cholesky: _native.Cholesky, kind: str, tets: int) -> float:
    return PER_SOLVE_ENTRY[kind] * cholesky.factor_nonzeros + PER_GRADIENT_TET * tets + PER_ITERATION


def _kind(precision: str) -> str:
    return "compact" if precision == "auto" else precision
