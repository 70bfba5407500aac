"""What SymPy does for a density of one's own: what it may be made of, its derivatives, its small-strain limit.

This module imports SymPy, and `qlb.materials.symbolic` imports it only when a density is made.
"""

from __future__ import annotations

import difflib
from collections.abc import Callable, Iterable, Mapping, Sequence
from dataclasses import dataclass
from functools import cache, reduce
from typing import Any

import numpy as np
import sympy

from qlb.arrays import FloatArray
from qlb.errors import InputError

# J is any real number: elements turn inside out.
INVARIANTS = (
    sympy.Symbol("I1", nonnegative=True),
    sympy.Symbol("I2", nonnegative=True),
    sympy.Symbol("J", real=True),
)
"""I1 = |F|^2 = tr C, I2 = |cof F|^2 = (I1^2 - tr C^2)/2, J = det F."""

_I1, _I2, _J = INVARIANTS
_REST = {_I1: sympy.Integer(3), _I2: sympy.Integer(3), _J: sympy.Integer(1)}

FUNCTIONS = ("exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "atan")
_OTHERS = (sympy.Add, sympy.Mul, sympy.Pow, sympy.Symbol, sympy.Abs, sympy.sign, sympy.Max, sympy.Min)
_ALLOWED = (*(getattr(sympy, name) for name in FUNCTIONS), *_OTHERS)
ALLOWED_TEXT = f"+ - * / **, sqrt, {', '.join(FUNCTIONS)}, Abs, sign, Min, Max"


class Direction(sympy.Function):  # type: ignore[misc]
    """The sign of a real number, with derivative zero: SymPy's own has a delta function there."""

    @classmethod
    def eval(cls, x: Any) -> Any:
        """A number where `x` is one."""
        return sympy.sign(x) if x.is_number else None

    def fdiff(self, argindex: int = 1) -> Any:
        """Its derivative."""
        return sympy.Integer(0)


class Magnitude(sympy.Function):  # type: ignore[misc]
    """|x| of a real number: SymPy's own takes arguments such as log J for complex when it is differentiated."""

    @classmethod
    def eval(cls, x: Any) -> Any:
        """A number where `x` is one."""
        return sympy.Abs(x) if x.is_number else None

    def fdiff(self, argindex: int = 1) -> Any:
        """Its derivative."""
        return Direction(self.args[0])


@dataclass(frozen=True)
class Density:
    """psi, less its value at rest, and its derivatives, as expressions of `INVARIANTS` and `parameters`.

    Attributes:
        parameters: symbols, in the order of their values.
        psi: the density.
        first: d1, d2, dJ.
        second: d11, d22, dJJ, d1J, d2J, d12.
        rest: at F = 1: p of the stress P = p 1, mu and lambda [Pa], of the parameters alone.
    """

    parameters: tuple[Any, ...]
    psi: Any
    first: tuple[Any, ...]
    second: tuple[Any, ...]
    rest: tuple[Any, Any, Any]

    @property
    def uses_second_invariant(self) -> bool:
        """Whether psi depends on I2."""
        return _I2 in self.psi.free_symbols

    def at_rest(self, values: Iterable[float | FloatArray]) -> tuple[FloatArray, FloatArray, FloatArray]:
        """`rest` for values of the parameters, each a number or an array (m,); of shape () or (m,)."""
        with np.errstate(all="ignore"):
            found = _numpy_function(self.parameters, self.rest)(*(np.float64(value) for value in values))
        p, mu, lam = np.broadcast_arrays(*(np.asarray(value, dtype=np.float64) for value in found))
        return p, mu, lam


def parse_density(psi: object, names: Sequence[str]) -> Density:
    """The density `psi` of the invariants and of parameters with these names.

    Raises:
        InputError: `psi` is not a SymPy expression, or has something that it may not have; a parameter that is not
            used; a psi or a derivative that is not finite at rest.
    """
    if not isinstance(psi, sympy.Expr):
        raise InputError(f"psi = {shortened(psi)} is of type {type(psi).__name__}, must be a SymPy expression")
    _require_known(psi)
    symbols = _named_symbols(psi, names)
    psi = _canonical(psi, symbols)
    first = tuple(sympy.diff(psi, s) for s in INVARIANTS)
    second = tuple(sympy.diff(first[i], INVARIANTS[k]) for i, k in ((0, 0), (1, 1), (2, 2), (0, 2), (1, 2), (0, 1)))
    at_rest = [expression.xreplace(_REST) for expression in (psi, *first, *second)]
    for expression in at_rest:
        if expression.has(sympy.nan, sympy.zoo, sympy.oo, -sympy.oo, sympy.I):
            raise InputError(f"psi = {shortened(psi)} or a derivative is not finite at rest, I1 = I2 = 3, J = 1")
    parameters = tuple(symbols[name] for name in names)
    return Density(parameters, psi - at_rest[0], first, second, _small_strain(at_rest[1:]))


def bounds_of(symbol: Any) -> dict[str, float]:
    """The range that SymPy's assumptions on a parameter mean, as `qlb.settings.quantity` has it."""
    if symbol.is_positive:
        return {"gt": 0.0}
    if symbol.is_negative:
        return {"lt": 0.0}
    return {"ge": 0.0} if symbol.is_nonnegative else {}


def shortened(value: object) -> str:
    """`value` as text of at most 60 characters."""
    text = str(value) if isinstance(value, sympy.Basic) else repr(value)
    return text if len(text) <= 60 else text[:57] + "..."


def _require_known(expression: Any) -> None:
    """Raise `InputError` for a function that is not known or a constant that is not real and finite."""
    if not expression.free_symbols:
        if not np.isfinite(_real_value(expression)):
            raise InputError(f"psi has the constant {shortened(expression)}: constants must be real and finite")
        return
    if not isinstance(expression, _ALLOWED):
        raise InputError(f"psi has {expression.func.__name__}, must be made of {ALLOWED_TEXT}")
    for argument in expression.args:
        _require_known(argument)


def _real_value(constant: Any) -> float:
    """A constant as a float; NaN where it is complex or not a number."""
    try:
        value = complex(constant.evalf(20))
    except (TypeError, ValueError, OverflowError):
        return float("nan")
    return value.real if abs(value.imag) <= 1e-15 * abs(value.real) else float("nan")


def _named_symbols(psi: Any, names: Sequence[str]) -> dict[str, Any]:
    """The symbols of `psi` by name; those of parameters keep the sign that they were declared with."""
    known = {s.name: s for s in INVARIANTS}
    for name in names:
        if not isinstance(name, str) or name in known:
            raise InputError(f"parameter {name!r} must have a name other than I1, I2 and J")
    used = {s.name: s for s in psi.free_symbols}
    for name in sorted(used.keys() - known.keys() - set(names)):
        near = difflib.get_close_matches(name, [*known, *names], n=1, cutoff=0.6)
        hint = f"; did you mean {near[0]}?" if near else ""
        raise InputError(f"psi has the symbol {name}, must be of {', '.join([*known, *names])}{hint}")
    for name in names:
        if name not in used:
            raise InputError(f"parameter {name} is not in psi = {shortened(psi)}: every parameter must be used")
    return known | {name: _real_symbol(used[name]) for name in names}


def _real_symbol(given: Any) -> Any:
    signs = {"positive", "negative", "nonnegative"}
    assumed = {name: True for name in signs if getattr(given, f"is_{name}")}
    return sympy.Symbol(given.name, real=True, **assumed)


def _canonical(expression: Any, symbols: Mapping[str, Any]) -> Any:
    """`expression` of these symbols, with |x| for Abs, Min and Max, and with thirds and halves for such exponents."""
    if expression.is_Symbol:
        return symbols[expression.name]
    if not expression.args:
        return expression
    arguments = [_canonical(argument, symbols) for argument in expression.args]
    if isinstance(expression, sympy.Abs):
        return Magnitude(*arguments)
    if isinstance(expression, sympy.sign):
        return Direction(*arguments)
    if isinstance(expression, sympy.Max | sympy.Min):
        side = 1 if isinstance(expression, sympy.Max) else -1
        return reduce(lambda a, b: (a + b + side * Magnitude(a - b)) / 2, arguments)
    if isinstance(expression, sympy.Pow):
        arguments[1] = _as_fraction(arguments[1])
    return expression.func(*arguments)


def _as_fraction(exponent: Any) -> Any:
    """k/6 for a float that is one to rounding, such as -2/3 written in Python; else `exponent`."""
    if isinstance(exponent, sympy.Float):
        sixths = round(6 * float(exponent))
        if abs(6 * float(exponent) - sixths) <= 1e-14 * abs(sixths):
            return sympy.Rational(sixths, 6)
    return exponent


def _small_strain(derivatives: list[Any]) -> tuple[Any, Any, Any]:
    """p, mu and lambda at F = 1 from the derivatives there: those of `InvariantMaterial::spectrum` at s = (1, 1, 1)."""
    d1, d2, dJ, d11, d22, dJJ, d1J, d2J, d12 = derivatives
    lam = 4 * d11 + 16 * d22 + dJJ + 16 * d12 + 4 * d1J + 8 * d2J + 4 * d2 + dJ
    return 2 * d1 + 4 * d2 + dJ, 2 * (d1 + d2), lam


@cache
def _numpy_function(parameters: tuple[Any, ...], expressions: tuple[Any, ...]) -> Callable[..., list[Any]]:
    names = [{"Magnitude": np.abs, "Direction": np.sign}, "numpy"]
    function: Callable[..., list[Any]] = sympy.lambdify(parameters, list(expressions), names)
    return function
