"""Expressions: their values against numpy written by hand, and everything that they refuse."""

from __future__ import annotations

import copy
import pickle
import random
import string
import time

import numpy as np
import pytest

from qlb import InputError, TetMesh
from qlb.fields import Expression
from qlb.fields.formula import FUNCTIONS, MAX_DEPTH, MAX_LENGTH, allowed

POINTS = np.random.default_rng(7).uniform(0.05, 0.95, (50, 3))
X, Y, Z = POINTS.T

VALUES = {
    "3": np.full(50, 3.0),
    "x": X,
    "pi * y": np.pi * Y,
    "2e4 * (1 + 9 * (floor(8 * x) % 2))": 2e4 * (1 + 9 * (np.floor(8 * X) % 2)),
    "-x ** 2 + +y - z / x": -(X**2) + Y - Z / X,
    "7 // (x + 1) % 2": 7 // (X + 1) % 2,
    "2 ** -x": 2.0**-X,
    "x < 0.5": (X < 0.5) * 1.0,
    "(x <= y) + (x >= y) + (x > y) + (x == y) + (x != y)": 1.0 * (X <= Y) + (X >= Y) + (X > Y) + (X == Y) + (X != Y),
    "0.2 < x <= y < 0.8": 1.0 * ((X > 0.2) & (X <= Y) & (Y < 0.8)),
    "where(x < 0.5, 1e4 * y, 2e4)": np.where(X < 0.5, 1e4 * Y, 2e4),
    "where(x > 2, log(-x), 4)": np.full(50, 4.0),
    "sin(x) + cos(y) + tan(z)": np.sin(X) + np.cos(Y) + np.tan(Z),
    "exp(x) * log(y) * sqrt(z)": np.exp(X) * np.log(Y) * np.sqrt(Z),
    "abs(x - 0.5) + ceil(3 * y)": np.abs(X - 0.5) + np.ceil(3 * Y),
    "minimum(x, y) - maximum(y, z)": np.minimum(X, Y) - np.maximum(Y, Z),
    "clip(x, 0.3, 0.6)": np.clip(X, 0.3, 0.6),
    "  x\n  + 1 ": X + 1,
}


@pytest.mark.parametrize("text", VALUES)
def test_values_are_those_of_numpy_written_by_hand(text):
    np.testing.assert_array_equal(Expression(text).at(POINTS), VALUES[text])


def test_every_function_is_tried_above():
    assert all(any(name + "(" in text for text in VALUES) for name in FUNCTIONS)


def test_on_a_mesh_it_is_taken_at_the_centroids():
    mesh = TetMesh.box((1, 0.5, 0.25), cells=(3, 2, 1))
    centroids = (sum(mesh.positions[mesh.tets[:, a]] for a in range(4))) / 4
    np.testing.assert_allclose(Expression("x + 10 * y + 100 * z").on(mesh), centroids @ [1, 10, 100], rtol=1e-14)


def test_it_is_a_value_of_its_own():
    expression = Expression("2 *  x")
    assert expression == Expression("2 * x") != Expression("x * 2")
    assert hash(expression) == hash(Expression("2 * x"))
    for twin in (copy.deepcopy(expression), pickle.loads(pickle.dumps(expression))):
        assert twin == expression
        np.testing.assert_array_equal(twin.at(POINTS), 2 * X)
    with pytest.raises(AttributeError):
        expression.text = "x"
    given = expression.at(POINTS)
    given[:] = 0  # no view of the points


def test_arithmetic_with_it_is_refused():
    field = Expression("x")
    for attempt in (lambda: 2 * field, lambda: field / 2, lambda: np.ones(3) * field, lambda: np.asarray(field, float)):
        with pytest.raises(InputError, match=r"the expression 'x' has its values only on a mesh"):
            attempt()


REFUSED = {
    "__import__('os').system('true')": "call of something without a name|attribute access",
    "__import__('os')": "calls '__import__'",
    "eval('1')": "calls 'eval'",
    "open('/etc/passwd')": "calls 'open'",
    "exec(x)": "calls 'exec'",
    "getattr(x, 'T')": "calls 'getattr'",
    "x.__class__": r"attribute access \(column 1\)",
    "1 + x.T": r"attribute access \(column 5\)",
    "().__class__.__bases__[0].__subclasses__()": "attribute access",
    "sin.__globals__": "attribute access",
    "(lambda: 1)()": "a lambda",
    "lambda: x": "a lambda",
    "x(1)": "calls 'x'",
    "sin(x)(y)": "a call of something without a name",
    "[q for q in (1, 2)]": "a comprehension",
    "{q for q in (1, 2)}": "a comprehension",
    "{q: 1 for q in (1, 2)}": "a comprehension",
    "minimum(*(q for q in x), 1)": "a starred argument",
    "(q for q in x)": "a comprehension",
    "'a' * 999999999": "a string",
    "b'a'": "a string",
    "f'{x}'": "an f-string",
    "(q := 1)": "an assignment",
    "x = 1": "is not a formula",
    "import os": "is not a formula",
    "x; y": "is not a formula",
    "x[0]": "a subscript",
    "x[::2]": "a subscript",
    "[1, 2]": "a list",
    "(1, 2)": "a tuple",
    "{1, 2}": "a set",
    "{1: 2}": "a dictionary",
    "...": "Ellipsis",
    "None": "None",
    "True": "True",
    "2j": "a complex number",
    "1 if x else 2": "where",
    "x and y": "and/or",
    "not x": "operator not",
    "~x": "operator ~",
    "x @ y": "operator @",
    "x & y": "operator &",
    "x ^ 2": r"a power is \*\*",
    "1 << 99999999": "operator <<",
    "x is y": "operator is",
    "x in y": "operator in",
    "(yield)": "yield",
    "(await x)": "await",
    "sin": "without calling it",
    "sin()": "with 0 arguments",
    "sin(x, y)": "with 2 arguments",
    "sin(x=x)": "by name",
    "where(x, *y)": "with 2 arguments",
    "w + 1": r"uses 'w', which is not known \(column 1\)",
    "é + w": r"uses 'é', which is not known \(column 1\)",
    "x + é * w": r"uses 'é', which is not known \(column 5\)",
    "": "is empty",
    "2e4 *": "is not a formula",
    "((x)": "is not a formula",
    "x\0": "null bytes",
    "\ud800": "surrogates",
    "9" * 400: "too large",
    "x + " * 300 + "x": "characters",
    "1" * 2000: "characters",
    "(" * 400 + "x" + ")" * 400: "is not a formula|too deep",
    "-" * 900 + "x": "too deep",
    "x" + "+1" * 400: "too deep",
    "sin(" * 180 + "x" + ")" * 180: "too deep",
    "0<(" * 90 + "x" + ")<1" * 90: "operations",
}


@pytest.mark.parametrize("text", REFUSED, ids=lambda text: ascii(text[:40]))
def test_what_is_not_a_formula_of_position_is_refused(text):
    with pytest.raises(InputError, match=REFUSED[text]) as refusal:
        Expression(text)
    message = str(refusal.value)
    assert "\n" not in message
    assert len(message) < 500
    assert "is not a number, and as an expression it" in message
    assert "allowed" in message or "takes" in message or "arguments have no names" in message


def test_the_message_says_what_is_allowed():
    with pytest.raises(InputError) as refusal:
        Expression("stiff")
    assert str(refusal.value) == (
        "'stiff' is not a number, and as an expression it uses 'stiff', which is not known (column 1);"
        f" allowed are {allowed(('x', 'y', 'z'))}"
    )


def test_limits_leave_room_for_long_formulas():
    assert Expression("x" + "+1" * (MAX_DEPTH - 2)).at(POINTS)[0] == pytest.approx(X[0] + MAX_DEPTH - 2)
    assert len(Expression(" + ".join(["sin(x)*y"] * 80)).text) < MAX_LENGTH


def test_huge_powers_are_infinite_at_once():
    began = time.perf_counter()
    assert np.isinf(Expression("9**9**9**9").at(POINTS)).all()
    assert time.perf_counter() - began < 1


def _random_text(rng: random.Random) -> str:
    words = [*FUNCTIONS, "x", "y", "z", "pi", "w", "lambda", "if", "else", "for", "in", "not", "and", "f'", ":=", "**"]
    words += ["//", "==", "<=", "9e9", "1_0", "0x1", "1j", "__class__", "\\", "\0", "é", "\n", "#", "'", '"', "2e400"]
    pieces = [*words, *string.printable, *"()()()()+-*/%,,<>.[]{}0123456789"]
    return "".join(rng.choice(pieces) for _ in range(rng.choice([3, 8, 20, 200])))


def test_random_text_is_an_expression_or_refused():
    rng, began, accepted = random.Random(3), time.perf_counter(), 0
    for _ in range(500):
        text = _random_text(rng)
        try:
            values = Expression(text).at(POINTS)
        except InputError as refusal:
            assert "\n" not in str(refusal)  # noqa: PT017
        else:
            accepted += 1
            assert values.shape == (50,)
    assert accepted > 0
    assert time.perf_counter() - began < 20


def _random_formula(rng: random.Random, depth: int) -> str:
    if depth == 0:
        return rng.choice(["x", "y", "z", "pi", "0", "2.5", "1e300"])
    name, (_, count) = rng.choice(list(FUNCTIONS.items()))
    arguments = [_random_formula(rng, depth - 1) for _ in range(count)]
    operator = rng.choice(["+", "-", "*", "/", "//", "%", "**", "<", "<=", ">", ">=", "==", "!="])
    return rng.choice([f"{name}({', '.join(arguments)})", f"({arguments[0]}){operator}({arguments[-1]})"])


def test_random_formulas_have_values_without_a_warning():
    rng = random.Random(4)
    for _ in range(500):
        assert Expression(_random_formula(rng, 3)).at(POINTS).shape == (50,)
