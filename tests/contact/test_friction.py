"""Friction's energy, force and stiffness are those of IPC Toolkit, its derivatives those of finite differences."""

from __future__ import annotations

import ipctk
import numpy as np
import pytest

from qlb import _native
from tests.contact.pairs import Array
from tests.support import difference

EPSILON, SCALE, NODES, SIZE = 0.4, 0.7, 20, 12


def random_contacts(rng: np.random.Generator) -> tuple[dict[str, Array], Array]:
    """Contacts of vertices and faces at random, and a slip of each."""
    nodes = np.stack([rng.permutation(NODES)[:4] for _ in range(SIZE)]).astype(np.int32)
    weights = rng.dirichlet([1.0, 1.0, 1.0], size=SIZE)
    normal = rng.normal(size=(SIZE, 3))
    contacts = {
        "nodes": nodes,
        "gamma": np.concatenate([np.ones((SIZE, 1)), -weights], axis=1),
        "normal": normal / np.linalg.norm(normal, axis=1, keepdims=True),
        "normal_force": rng.uniform(1.0, 5.0, size=SIZE),
        "mu": rng.uniform(0.1, 0.8, size=SIZE),
    }
    return contacts, rng.normal(size=(SIZE, 3)) * 0.1  # type: ignore[return-value]


def slips(contacts: dict[str, Array], slip: Array, moved: Array) -> Array:
    """Sizes of the tangential slips, by the projector 1 - n n^T."""
    relative = np.einsum("ki,kic->kc", contacts["gamma"], moved[contacts["nodes"]]) - slip
    n = contacts["normal"]
    return np.linalg.norm(relative - np.sum(relative * n, axis=1, keepdims=True) * n, axis=1)


def dense_terms(terms: _native.FrictionTerms) -> Array:
    full = np.zeros((3 * NODES, 3 * NODES))
    for nodes, gamma, axis, stiffness in zip(terms.nodes, terms.gamma, terms.axis, terms.stiffness, strict=True):
        a = np.zeros((NODES, 3))
        a[nodes] = gamma[:, None] * axis
        full += stiffness * np.outer(a, a)
    return full


@pytest.mark.parametrize("motion", [0.02, 0.2, 2.0])
def test_energy_is_that_of_ipc_toolkit_and_has_these_derivatives(motion: float, rng: np.random.Generator) -> None:
    contacts, slip = random_contacts(rng)
    friction = _native.Friction(**contacts, slip=slip)  # type: ignore[arg-type]
    base = rng.normal(size=(NODES, 3))
    x = base + motion * rng.normal(size=(NODES, 3))
    sizes = slips(contacts, slip, x - base)
    assert ((sizes < EPSILON).any() and motion < 2.0) or ((sizes > EPSILON).any() and motion > 0.1)

    gradient = np.zeros_like(x)
    terms = friction.evaluate(x, base, EPSILON, SCALE, gradient)
    f0 = np.array([ipctk.smooth_friction_f0(y, EPSILON) for y in sizes])
    assert terms.energy == pytest.approx(SCALE * np.sum(contacts["mu"] * contacts["normal_force"] * f0), rel=1e-12)

    def gradient_at(y: Array) -> Array:
        out = np.zeros_like(y)
        friction.evaluate(y, base, EPSILON, SCALE, out)
        return out

    direction = rng.normal(size=x.shape)
    slope = difference(
        lambda y: np.array(friction.evaluate(y, base, EPSILON, SCALE, np.zeros_like(y)).energy), x, direction, 1e-5
    )
    assert np.sum(gradient * direction) == pytest.approx(float(slope), rel=1e-7)
    change = difference(gradient_at, x, direction, 1e-6).ravel()
    product = dense_terms(terms) @ direction.ravel()
    np.testing.assert_allclose(product, change, rtol=0, atol=1e-6 * np.abs(change).max())
    assert (np.asarray(terms.stiffness) >= 0.0).all()


@pytest.mark.parametrize("y", [0.0, 0.1, 0.399, 0.4, 0.9])
def test_force_and_stiffness_of_one_contact_are_those_of_ipc_toolkit(y: float) -> None:
    """A node on a plane: mu lambda f1(y) against the slip, mu lambda f1'(y) along it and f1(y)/y across."""
    one = np.ones(1)
    friction = _native.Friction(
        np.zeros((1, 4), dtype=np.int32), np.array([[1.0, 0, 0, 0]]), np.array([[0.0, 0, 1]]), 5.0 * one, 0.3 * one
    )
    gradient, toward = np.zeros((1, 3)), np.array([0.6, 0.8, 0.0])
    terms = friction.evaluate(y * toward[None] + [0.0, 0.0, 7.0], np.zeros((1, 3)), EPSILON, SCALE, gradient)
    limit = SCALE * 1.5
    np.testing.assert_allclose(gradient[0], limit * ipctk.smooth_friction_f1(y, EPSILON) * toward, atol=1e-14)
    assert terms.stiffness[0] == pytest.approx(limit * ipctk.smooth_friction_f2(y, EPSILON), abs=1e-14)
    assert terms.stiffness[1] == pytest.approx(limit * ipctk.smooth_friction_f1_over_x(y, EPSILON), rel=1e-14)
    frame = np.array([*terms.axis, [0.0, 0.0, 1.0]])
    np.testing.assert_allclose(frame @ frame.T, np.eye(3), atol=1e-15)
    if y > 0.0:
        np.testing.assert_allclose(terms.axis[0], toward, atol=1e-15)


def test_no_contacts_no_friction() -> None:
    none = np.zeros(0)
    friction = _native.Friction(np.zeros((0, 4), dtype=np.int32), np.zeros((0, 4)), np.zeros((0, 3)), none, none)
    terms = friction.evaluate(np.ones((2, 3)), np.zeros((2, 3)), EPSILON, 1.0, np.zeros((2, 3)))
    assert (terms.energy, terms.nodes.shape, terms.axis.shape) == (0.0, (0, 4), (0, 3))


def test_bad_input_is_refused_by_name() -> None:
    nodes, gamma, normal, one = np.full((1, 4), 3, dtype=np.int32), np.ones((1, 4)), np.eye(3)[:1], np.ones(1)
    with pytest.raises(ValueError, match=r"mu holds -1\.0+, must be finite and not negative"):
        _native.Friction(nodes, gamma, normal, one, -one)
    with pytest.raises(ValueError, match="normal has 2 entries, expected 3"):
        _native.Friction(nodes, gamma, np.ones((1, 2)), one, one)
    friction, x = _native.Friction(nodes, gamma, normal, one, one), np.zeros((3, 3))
    with pytest.raises(ValueError, match="nodes name node 3, x has 3"):
        friction.evaluate(x, x, EPSILON, 1.0, x)
    with pytest.raises(ValueError, match=r"epsilon is 0\.0+, must be positive"):
        friction.evaluate(np.zeros((4, 3)), np.zeros((4, 3)), 0.0, 1.0, np.zeros((4, 3)))
