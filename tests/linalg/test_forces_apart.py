"""Forces that are handed over apart from the gradient give the same solution."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import _native
from tests.linalg.test_woodbury_inverse import Body


@pytest.mark.parametrize("precision", ["compact", "float32", "float64"])
def test_forces_kept_apart_give_the_same_solution(rng: np.random.Generator, precision: str) -> None:
    body = Body(precision)
    body.carry()
    terms = body.terms(30, np.where(np.arange(30) < 3, 0.0, 10.0 ** rng.uniform(-3, 3, size=30))).native
    assert body.inverse.set_terms(terms)
    history = _native.Lbfgs(3 * body.count, 4, 1)
    g, beta = rng.normal(size=(body.count, 3)) * (body.fixed == 0), rng.normal(size=30)
    whole = g.copy()
    terms.add_combination(beta, whole)
    whole *= body.fixed == 0
    p, q = np.empty_like(g), np.empty_like(g)
    slope = history.direction_with(whole, body.inverse, terms, p)
    apart = history.direction_with(g, body.inverse, terms, q, beta)
    accuracy = 1e-10 if precision == "float64" else 2e-4
    np.testing.assert_allclose(q, p, rtol=0, atol=accuracy * np.abs(p).max())
    assert apart == pytest.approx(slope, rel=accuracy)
