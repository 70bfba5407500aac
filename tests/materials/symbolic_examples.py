"""Densities written in SymPy: the built-in ones again, and others."""

from __future__ import annotations

from typing import Any

import sympy

from qlb import SymbolicMaterial
from qlb.materials import MATERIALS, Material

I1, I2, J = SymbolicMaterial.invariants
mu, kappa, c1, c2, Jm, beta = sympy.symbols("mu kappa c1 c2 Jm beta", positive=True)
lam = sympy.Symbol("lam", real=True)
THIRD = sympy.Rational(1, 3)

alpha = 1 + sympy.Rational(3, 4) * mu / lam
# psi, and the names of its parameters in the order of the built-in kernels'
BUILT_IN: dict[str, tuple[Any, list[str]]] = {
    "SNH": (mu / 2 * (I1 - 3) + lam / 2 * (J - alpha) ** 2 - mu / 2 * sympy.log(I1 + 1), ["mu", "lam"]),
    # E : E = (tr C^2 - 2 tr C + 3)/4 with tr C^2 = I1^2 - 2 I2, tr E = (I1 - 3)/2
    "StVK": (mu * (I1**2 - 2 * I2 - 2 * I1 + 3) / 4 + lam / 8 * (I1 - 3) ** 2, ["mu", "lam"]),
    "CNH": (mu / 2 * (I1 - 3) - mu * sympy.log(J) + lam / 2 * sympy.log(J) ** 2, ["mu", "lam"]),
    "MR": (
        c1 * (J ** (-2 * THIRD) * I1 - 3) + c2 * (J ** (-4 * THIRD) * I2 - 3) + kappa / 2 * (J - 1) ** 2,
        ["c1", "c2", "kappa"],
    ),
}

GENT = -mu / 2 * Jm * sympy.log(1 - (I1 * J ** (-2 * THIRD) - 3) / Jm) + kappa / 2 * (J - 1) ** 2
FUNG = mu / (2 * beta) * (sympy.exp(beta * (I1 * J ** (-2 * THIRD) - 3)) - 1) + kappa / 2 * (J - 1) ** 2
BLATZ_KO = mu / 2 * (I2 / J**2 + 2 * J - 5)
POWER_LAW = mu / 2 * (I1 - 3) + mu / (2 * beta) * (J ** (-2 * beta) - 1)  # Blatz, Ko 1962: beta = nu/(1 - 2 nu)

OTHERS: dict[str, tuple[Any, dict[str, float]]] = {
    "Gent": (GENT, {"mu": 1e4, "kappa": 1e5, "Jm": 30.0}),
    "Fung": (FUNG, {"mu": 1e4, "kappa": 1e5, "beta": 0.3}),
    "Blatz-Ko": (BLATZ_KO, {"mu": 1e4}),
    "power law": (POWER_LAW, {"mu": 1e4, "beta": 1.7}),
    "softer when stretched": (
        BUILT_IN["SNH"][0] - mu / 8 * sympy.Max(0, I1 - 3 - sympy.Rational(1, 10)) ** 3 / (1 + I1**3),
        {"mu": 1e4, "lam": 3e4},
    ),
}


def rewritten(built_in: Material) -> SymbolicMaterial:
    """The same material as `built_in`, from its SymPy expression."""
    psi, names = BUILT_IN[built_in.model]
    values = dict(zip(names, built_in.kernel_parameters(), strict=True))
    return SymbolicMaterial(psi=psi, parameters=values, density=built_in.density)


def symbolic_example(young: float, poisson: float) -> SymbolicMaterial:
    """One that is defined at every F and has a second invariant."""
    return rewritten(MATERIALS["StVK"](young=young, poisson=poisson))
