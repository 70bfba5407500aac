"""Settings of the solvers are checked; their defaults are those of the paper's supplement."""

from __future__ import annotations

import pytest
from pydantic import ValidationError

from qlb import InputError, SolverSettings, Tolerance
from qlb.settings import Settings
from qlb.solvers import SOLVERS


@pytest.mark.parametrize(
    ("model", "arguments", "message"),
    [
        (Tolerance, {"relative": -1e-6}, "relative: -1e-06 is out of range: must be >= 0 and < 1"),
        (Tolerance, {"relative": 1.0}, "relative: 1 is out of range: must be >= 0 and < 1"),
        (Tolerance, {"relative": float("nan")}, "relative: nan is out of range: must be >= 0 and < 1"),
        (Tolerance, {"absolute": -1.0}, "absolute: -1 is out of range: must be >= 0"),
        (Tolerance, {"absolute": float("inf")}, "absolute: inf is out of range: must be >= 0"),
        (Tolerance, {"scaled": "small"}, "scaled: 'small' is not a number"),
        (Tolerance, {"relativ": 1e-6}, "unknown key 'relativ'; did you mean 'relative'?"),
        (Tolerance, {"qqq": 1}, "unknown key 'qqq'; valid keys: relative, absolute, scaled, step"),
        (SolverSettings, {"window": 0}, "window: 0 is out of range: must be a whole number >= 1 and <= 100"),
        (SolverSettings, {"window": 2.5}, "window: 2.5 is out of range: must be a whole number >= 1 and <= 100"),
        (SolverSettings, {"window": True}, "window: True is not a number"),
        (SolverSettings, {"max_iterations": 0}, "max_iterations: 0 is out of range: must be a whole number >= 1"),
        (SolverSettings, {"maxiterations": 5}, "unknown key 'maxiterations'; did you mean 'max_iterations'?"),
    ],
)
def test_a_wrong_setting_is_named_with_its_range(
    model: type[Settings], arguments: dict[str, object], message: str
) -> None:
    with pytest.raises(InputError) as caught:
        model(**arguments)
    assert str(caught.value) == message


@pytest.mark.parametrize(("key", "allowed"), [("projection", "on-demand"), ("initial_guess", "predictor")])
def test_a_wrong_choice_is_named_with_those_that_there_are(key: str, allowed: str) -> None:
    with pytest.raises(InputError) as caught:
        SolverSettings(**{key: "sometimes"})
    message = str(caught.value)
    assert key in message
    assert "'sometimes'" in message
    assert allowed in message
    assert "\n" not in message


def test_several_mistakes_are_counted() -> None:
    with pytest.raises(InputError, match=r"\(and 1 more problem\)$"):
        Tolerance(relative=-1.0, absolute=-1.0)


def test_plain_data_is_checked_like_arguments() -> None:
    assert Tolerance.parse({"relative": 1e-3}).relative == 1e-3
    with pytest.raises(InputError, match="relative: 2 is out of range"):
        Tolerance.parse({"relative": 2})


def test_settings_do_not_change() -> None:
    tolerance = Tolerance()
    with pytest.raises(ValidationError, match="frozen"):
        tolerance.relative = 1.0


def test_defaults_are_those_of_the_supplement() -> None:
    assert Tolerance().relative == 1e-6
    assert Tolerance().absolute == 0.0
    for solver in ("ND", "QLF", "QLB"):
        complete = SolverSettings().completed(SOLVERS[solver].defaults)
        assert (complete.projection, complete.initial_guess, complete.window) == ("always", "previous", 5)
