"""The line search on functions of one variable, and where rounding hides a change."""

from __future__ import annotations

from collections.abc import Callable
from math import inf, log, nan

import numpy as np
import pytest

from qlb.solvers.line_search import Point, backtrack
from qlb.system.stage_problem import Evaluation
from tests.support import Array


class Curve:
    """A function of one variable with its derivative, in the guise of a stage problem."""

    def __init__(self, value: Callable[[float], float], derivative: Callable[[float], float]) -> None:
        self.value, self.derivative, self.energy_rounding = value, derivative, 0.0

    def evaluate(self, x: Array, *, on_way: bool = False) -> Evaluation:
        gradient = np.array([self.derivative(float(x[0]))])
        return Evaluation(self.value(float(x[0])), gradient, gradient, None)

    def residual(self, gradient: Array) -> float:
        return abs(float(gradient[0]))


PARABOLA = Curve(lambda x: 0.5 * x * x, lambda x: x)
# -log x + x has its minimum at 1 and is no number for x <= 0.
BARRIER = Curve(lambda x: x - log(x) if x > 0 else inf, lambda x: 1 - 1 / x if x > 0 else nan)


def search(curve: Curve, x: float, p: float, slope: float | None = None) -> tuple[float, Point] | None:
    start = Point.at(curve, np.array([x]))  # type: ignore[arg-type]
    given = curve.derivative(x) * p if slope is None else slope
    return backtrack(curve, start, np.array([p]), given)  # type: ignore[arg-type]


def accepted(curve: Curve, x: float, p: float, slope: float | None = None) -> tuple[float, float]:
    found = search(curve, x, p, slope)
    assert found is not None
    return found[0], float(found[1].x[0])


def test_the_unit_step_is_tried_first() -> None:
    assert accepted(PARABOLA, 1.0, -1.0) == (1.0, 0.0)


def test_a_step_too_long_is_halved_until_the_energy_falls() -> None:
    # From 1 along -7: E(-6) = 18, E(-2.5) = 3.1, E(-0.75) = 0.28 < E(1) = 0.5
    assert accepted(PARABOLA, 1.0, -7.0) == (0.25, -0.75)


def test_the_first_step_that_is_good_enough_is_taken_not_the_best() -> None:
    assert accepted(PARABOLA, 1.0, -1.9)[0] == 1.0


def test_a_trial_that_is_not_finite_counts_as_too_far() -> None:
    assert accepted(BARRIER, 2.0, -4.0) == (0.25, 1.0)


def test_an_energy_that_is_not_a_number_counts_as_too_far() -> None:
    curve = Curve(lambda x: nan if x < 0 else x, lambda x: 1.0)
    assert accepted(curve, 1.0, -4.0, slope=-4.0) == (0.25, 0.0)


def test_a_gradient_that_is_not_a_number_counts_as_too_far() -> None:
    curve = Curve(lambda x: x, lambda x: nan if x < 0 else 1.0)
    assert accepted(curve, 1.0, -4.0, slope=-4.0) == (0.25, 0.0)


def test_a_decrease_must_be_in_proportion_to_the_slope() -> None:
    # Armijo with 1e-4: a fall by 1 is enough for a slope of -9000, not for one of -11 000.
    line = Curve(lambda x: x, lambda x: 1.0)
    assert accepted(line, 0.0, -1.0, slope=-9000.0)[0] == 1.0
    assert search(line, 0.0, -1.0, slope=-11000.0) is None


def test_an_uphill_direction_finds_nothing() -> None:
    assert search(PARABOLA, 1.0, 1.0, slope=-1.0) is None


def test_where_rounding_hides_the_change_a_smaller_gradient_is_taken() -> None:
    # 1e-13 of decrease vanishes beside an energy of 1e6.
    curve = Curve(lambda x: 1e6 + 0.5e-6 * x * x, lambda x: 1e-6 * x)
    assert curve.value(1e-3) == curve.value(0.0)
    assert accepted(curve, 1e-3, -1e-3) == (1.0, 0.0)


def test_where_elements_cancel_a_change_within_their_rounding_is_hidden_too() -> None:
    # The energy is small, but the terms that it is the sum of are not.
    curve = Curve(lambda x: 1e-9 if x == 1 else 1e-9 + 3e-16, lambda x: x)
    assert search(curve, 1.0, -1.0) is None
    curve.energy_rounding = 1e-15
    assert accepted(curve, 1.0, -1.0) == (1.0, 0.0)


def test_where_rounding_hides_the_change_a_larger_gradient_is_not_taken() -> None:
    curve = Curve(lambda x: 1e6, lambda x: 1e-9 * (1 + x * x))
    assert search(curve, 1.0, 1.0, slope=-1e-9) is None


@pytest.mark.parametrize(("energy", "gradient"), [(nan, 1.0), (inf, 1.0), (1.0, nan), (1.0, inf), (-inf, 1.0)])
def test_a_point_with_no_number_is_not_finite(energy: float, gradient: float) -> None:
    assert not Point.at(Curve(lambda x: energy, lambda x: gradient), np.zeros(1)).is_finite  # type: ignore[arg-type]
