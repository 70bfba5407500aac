"""Quantities in time: tables against interpolation by hand, expressions, and what they refuse."""

from __future__ import annotations

import copy
import pickle

import numpy as np
import pytest

from qlb import InputError, TimeExpression, TimeTable
from qlb.fields.in_time import TimeFunction, in_time


def test_a_table_is_linear_between_its_times_and_constant_beyond() -> None:
    table = TimeTable([1, 2, 4], [10, 30, 0])
    for time, expected in ((0, 10), (1, 10), (1.25, 15), (2, 30), (3, 15), (4, 0), (9, 0)):
        assert table(time) == pytest.approx(expected, rel=1e-15)
        assert table(time).shape == table.shape == ()


def test_a_table_of_vectors_is_that_of_its_components() -> None:
    values = np.array([[1.0, 2.0, 3.0], [0.0, -2.0, 9.0], [5.0, 5.0, 5.0]])
    table = TimeTable([0.0, 0.5, 2.0], values)
    assert table.shape == (3,)
    for time in (-1.0, 0.0, 0.2, 0.5, 1.7, 3.0):
        expected = [TimeTable([0.0, 0.5, 2.0], column)(time) for column in values.T]
        np.testing.assert_array_equal(table(time), expected)
    values[:] = 0
    np.testing.assert_array_equal(table(0.0), [1, 2, 3])


def test_one_key_is_a_constant() -> None:
    assert TimeTable([3], [7])(0.0) == TimeTable([3], [7])(9.0) == 7.0


def test_expressions_have_the_values_of_their_formulas() -> None:
    for t in (0.0, 0.3, 2.0):
        assert TimeExpression("100 * sin(2 * pi * t) + t ** 2")(t) == 100 * np.sin(2 * np.pi * t) + t**2
        np.testing.assert_array_equal(TimeExpression(["0", "-9.81 * minimum(t, 1)", 3])(t), [0, -9.81 * min(t, 1), 3])
    assert TimeExpression("3")(1.0).shape == ()
    assert np.isinf(TimeExpression("1 / t")(0.0))


TWINS = [
    (TimeExpression("2 *  t"), TimeExpression("2 * t"), TimeExpression("t * 2")),
    (TimeExpression(["t", 0, "1"]), TimeExpression(("t", 0.0, "1")), TimeExpression(["t", 1, "1"])),
    (TimeTable([0, 1], [1, 2]), TimeTable((0.0, 1.0), np.array([1, 2])), TimeTable([0, 1], [1, 3])),
    (TimeTable([0, 1], [[1, 2], [3, 4]]), TimeTable([0, 1], [(1, 2), (3, 4)]), TimeTable([0, 1], [1, 2])),
]


@pytest.mark.parametrize(("one", "same", "other"), TWINS)
def test_they_are_values_of_their_own(one: TimeFunction, same: TimeFunction, other: TimeFunction) -> None:
    assert one == same != other
    assert hash(one) == hash(same)
    for twin in (copy.deepcopy(one), pickle.loads(pickle.dumps(one)), in_time(one.written(), one.shape)):
        assert twin == one
        np.testing.assert_array_equal(twin(0.7), one(0.7))
    with pytest.raises(AttributeError):
        one.times = 3  # type: ignore[attr-defined]


def test_what_is_written_becomes_a_number_a_vector_or_a_function_of_time() -> None:
    assert in_time(3, ()) == in_time("3", ()) == 3.0
    assert in_time([1, "2e4", 3.5], (3,)) == (1.0, 2e4, 3.5)
    assert in_time("3 * t", ()) == TimeExpression("3 * t")
    assert in_time([0, "t", 0], (3,)) == TimeExpression([0.0, "t", 0.0])
    assert in_time({"times": [0, "1e1"], "values": [1, 2]}, ()) == TimeTable([0, 10], [1, 2])


VECTOR, NUMBER = (3,), ()
REFUSED = [
    ([0, 1], VECTOR, r"\[0, 1\] must be a vector of 3: constant, an expression in t, or a table"),
    (3, VECTOR, "3 must be a vector of 3"),
    ([1, 2, 3], NUMBER, "must be a number: constant"),
    ([0, "t"], VECTOR, "a vector of 2 in time is given, must be a vector of 3"),
    ("t", VECTOR, "a number in time is given, must be a vector of 3"),
    (["t", 0, 0], NUMBER, "a vector of 3 in time is given, must be a number"),
    (True, NUMBER, "True must be a number"),
    ([True, 0, 0], VECTOR, "must be a vector of 3"),
    ([True, "t", 0], VECTOR, "must be an expression in t, or a list of them"),
    (None, NUMBER, "None must be a number"),
    (float("nan"), NUMBER, "nan must be a number"),
    ("nan", NUMBER, "'nan', which is not known"),
    (lambda t: t, NUMBER, "must be a number"),
    ("x + t", NUMBER, r"uses 'x', which is not known \(column 1\); allowed are numbers, t, pi"),
    ("t +", NUMBER, "is not a formula"),
    ("t.real", NUMBER, "attribute access"),
    ("__import__('os')", NUMBER, "calls '__import__'"),
    ([0, "t[0]", 0], VECTOR, "a subscript"),
    ({}, NUMBER, "a table in time lacks times, must have times and values"),
    ({"times": [0, 1]}, NUMBER, "a table in time lacks values"),
    ({"time": [0], "values": [1]}, NUMBER, "unknown key 'time' in a table in time; valid keys: times, values"),
    ({"times": [0, 2, 1], "values": [1, 2, 3]}, NUMBER, "must increase: number 3 is 1 s, after 2 s"),
    ({"times": [0, 0], "values": [1, 2]}, NUMBER, "must increase: number 2 is 0 s, after 0 s"),
    ({"times": [0, 1], "values": [1]}, NUMBER, r"values of a table have shape \(1,\), must be \(2,\) or \(2, d\)"),
    ({"times": [0, 1], "values": [[1, 2, 3], [1, 2]]}, VECTOR, "values = .* are not numbers in lists of one length"),
    ({"times": [0, 1], "values": [1, "soft"]}, NUMBER, "values = .*'soft'.* are not numbers"),
    ({"times": [0, 1], "values": [1, True]}, NUMBER, "are not numbers"),
    ({"times": [0, float("inf")], "values": [1, 2]}, NUMBER, "times = .* must be finite"),
    ({"times": [], "values": []}, NUMBER, r"times of a table have shape \(0,\), must be \(k,\) with k >= 1"),
    ({"times": 3, "values": 4}, NUMBER, r"times of a table have shape \(\)"),
    ({"times": [0, 1], "values": [1, 2]}, VECTOR, "a number in time is given, must be a vector of 3"),
]


@pytest.mark.parametrize(("value", "shape", "message"), REFUSED, ids=range(len(REFUSED)))
def test_what_is_wrong_is_refused_in_one_line(value: object, shape: tuple[int, ...], message: str) -> None:
    with pytest.raises(InputError, match=message) as refusal:
        in_time(value, shape)
    assert "\n" not in str(refusal.value)
    assert len(str(refusal.value)) < 500
