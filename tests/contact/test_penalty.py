"""The penalty takes signed distances: what has gone through is pushed back, by closed forms of flat pairs."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Contact, _native
from qlb.contact.stage import StageContact
from qlb.integrators.integrator import Origin, Stage
from qlb.timing import Timer
from tests.contact.pairs import (
    EDGE_EDGE,
    NO_PAIRS,
    VERTEX_FACE,
    Array,
    Scene,
    closest_type,
    dense_hessian,
    draw,
    six_nodes,
)
from tests.contact.scenes import block, simulate
from tests.support import difference

DHAT, STIFFNESS, SCALE = 0.8, 3e4, 0.37
FACE = np.array([[0.0, 0, 0], [1, 0, 0], [0, 1, 0]])  # its outward normal is z


def make_barrier(scene: Scene) -> _native.Barrier:
    return _native.Barrier(scene.surface, DHAT, STIFFNESS, 1, "penalty")


def over_face(x: float, y: float, z: float) -> Array:
    return six_nodes(np.array([[x, y, z], *FACE]))


def sign_of(sign: int) -> np.ndarray[tuple[int], np.dtype[np.int8]]:
    return np.array([sign], dtype=np.int8)


def assert_derivatives(scene: Scene, x: Array, rng: np.random.Generator, sign: int | None = None) -> None:
    barrier, signs = make_barrier(scene), None if sign is None else sign_of(sign)
    found, gradient = scene.evaluate(barrier, x, SCALE, signs)
    direction = rng.normal(size=x.shape)
    slope = difference(lambda y: np.array(scene.evaluate(barrier, y, SCALE, signs)[0].energy), x, direction, 1e-6)
    assert np.sum(gradient * direction) == pytest.approx(float(slope), rel=1e-6, abs=1e-6 * np.abs(gradient).max())
    change = difference(lambda y: scene.evaluate(barrier, y, SCALE, signs)[1], x, direction, 1e-6).ravel()
    product = dense_hessian(barrier, x, found, project=False) @ direction.ravel()
    np.testing.assert_allclose(product, change, rtol=0, atol=1e-6 * np.abs(change).max())
    (projected,) = barrier.hessian_blocks(x, found, True)
    values, vectors = np.linalg.eigh(barrier.hessian_blocks(x, found, False)[0])
    expected = (vectors * np.maximum(values, 0.0)) @ vectors.T
    np.testing.assert_allclose(projected, expected, rtol=0, atol=1e-12 * np.abs(values).max())


@pytest.mark.parametrize("height", [0.7, 0.2, 0.0, -0.3, -1.5])
def test_a_vertex_over_a_face_is_pushed_out_however_deep(height: float, rng: np.random.Generator) -> None:
    scene = Scene.of(VERTEX_FACE)
    x = over_face(0.3, 0.2, height)
    found, gradient = scene.evaluate(make_barrier(scene), x, SCALE)
    unit = SCALE * scene.surface.node_area(0) / 2 * STIFFNESS / DHAT
    assert found.distance[0] == pytest.approx(height, abs=1e-15)
    assert found.energy == pytest.approx(0.5 * unit * (height - DHAT) ** 2, rel=1e-13)
    assert found.force[0] == pytest.approx(unit * (DHAT - height), rel=1e-13)
    assert found.stiffness[0] == pytest.approx(unit, rel=1e-13)
    np.testing.assert_allclose(gradient[0], [0, 0, unit * (height - DHAT)], rtol=1e-13)
    assert_derivatives(scene, x, rng)


@pytest.mark.parametrize(
    ("place", "count"),
    [
        ((0.3, 0.2, 0.81), 0),  # out of reach
        ((0.3, 0.2, -1.59), 1),
        ((0.3, 0.2, -1.61), 0),  # deeper than 2 dhat: on its way out at the other side
        ((-0.2, 0.5, 0.1), 1),  # beside an edge, in front
        ((-0.2, 0.5, -0.1), 0),  # beside an edge, behind
        ((-0.2, -0.2, 0.1), 1),  # beside a corner
        ((-0.2, -0.2, -0.1), 0),
    ],
)
def test_which_vertices_are_in_contact(place: tuple[float, float, float], count: int) -> None:
    scene = Scene.of(VERTEX_FACE)
    assert scene.evaluate(make_barrier(scene), over_face(*place))[0].size == count


@pytest.mark.parametrize("place", [(-0.2, 0.5, 0.1), (-0.2, -0.2, 0.1), (0.6, 0.6, 0.3)])
def test_beside_a_face_the_distance_is_plain(place: tuple[float, float, float], rng: np.random.Generator) -> None:
    scene = Scene.of(VERTEX_FACE)
    x = over_face(*place)
    found, _ = scene.evaluate(make_barrier(scene), x)
    plain, _ = scene.evaluate(_native.Barrier(scene.surface, DHAT, STIFFNESS, 1), x)
    assert found.distance[0] == plain.distance[0]
    assert_derivatives(scene, x, rng)


@pytest.mark.parametrize("sign", [1, -1])
@pytest.mark.parametrize("spread", [1.0, 0.01])
@pytest.mark.parametrize("name", ["EA_EB", "EA0_EB", "EA1_EB1"])
def test_edges_take_the_sign_they_are_given(name: str, spread: float, sign: int, rng: np.random.Generator) -> None:
    scene = Scene.of(EDGE_EDGE)
    barrier = make_barrier(scene)

    def accept(x: Array) -> bool:
        found, _ = scene.evaluate(barrier, x)
        return closest_type(EDGE_EDGE, x) == name and found.size == 1 and 0.1 < found.distance[0] / DHAT < 0.9

    x = draw(EDGE_EDGE, accept, rng, spread)
    plain, _ = scene.evaluate(barrier, x)
    found, _ = scene.evaluate(barrier, x, 1.0, sign_of(sign))
    assert found.distance[0] == sign * plain.distance[0]
    np.testing.assert_array_equal(found.normal, sign * np.asarray(plain.normal))
    assert_derivatives(scene, x, rng, sign)


def test_touching_edges_are_pushed_apart() -> None:
    scene = Scene.of(EDGE_EDGE)
    x = six_nodes(np.array([[-1.0, 0, 0], [1, 0, 0], [0, -1, 0], [0, 1, 0]]))
    found, gradient = scene.evaluate(make_barrier(scene), x)
    assert np.isfinite(found.energy)
    np.testing.assert_array_equal(found.normal, [[0.0, 0.0, 1.0]])
    assert np.abs(gradient).max() > 0.0
    assert np.isfinite(make_barrier(scene).hessian_blocks(x, found, True)).all()


def test_a_plane_pushes_out_what_is_deep_inside() -> None:
    scene = Scene.of(VERTEX_FACE)
    barrier = make_barrier(scene)
    x = np.full((6, 3), 9.0)
    x[0, 2] = -4.0
    gradient = np.zeros_like(x)
    allowed = np.ones((1, 2), dtype=np.uint8)
    found = barrier.evaluate(x, NO_PAIRS, NO_PAIRS, np.array([[0.0, 0, 1, 0]]), allowed, SCALE, gradient)
    unit = SCALE * scene.surface.node_area(0) * STIFFNESS / DHAT
    assert found.energy == pytest.approx(0.5 * unit * 4.8**2, rel=1e-14)
    np.testing.assert_allclose(gradient[0], [0, 0, -4.8 * unit], rtol=1e-14)


def test_edge_signs_must_be_one_per_pair() -> None:
    scene = Scene.of(EDGE_EDGE)
    with pytest.raises(ValueError, match="edge_sign has 2 entries, expected one per pair of edges"):
        scene.evaluate(make_barrier(scene), np.zeros((6, 3)), 1.0, np.ones(2, dtype=np.int8))
    with pytest.raises(ValueError, match="edge_sign holds 0, must be 1 or -1"):
        scene.evaluate(make_barrier(scene), np.zeros((6, 3)), 1.0, sign_of(0))


@pytest.mark.parametrize(("depth", "acts"), [(0.5, True), (1.5, True), (2.5, False)])
def test_candidates_reach_as_deep_as_the_penalty(depth: float, acts: bool, monkeypatch: pytest.MonkeyPatch) -> None:
    """A block whose one face is `depth` dhat within a larger one."""
    monkeypatch.setattr("qlb.contact.stage.MARGIN", 0.0)
    dhat = 4e-3
    bodies = [block(name="a"), block((0.1, 0.04, 0.08), (0.3, 0.011, 0.007), name="b")]
    simulation = simulate(bodies, contact=Contact(mode="penalty", dhat=dhat))
    x, model = simulation.state.positions.copy(), simulation.system.contact
    assert model is not None
    first, second = simulation.nodes_of(0), simulation.nodes_of(1)
    x[second, 0] += x[first, 0].max() - x[second, 0].min() - depth * dhat
    stage = Stage(1e-2, 1e-2, ((1.0, x),), np.zeros_like(x))
    deepest = StageContact(model, stage, 1.0, Origin(x, 0.0), Timer()).at(x).contacts.distance.min(initial=dhat)
    assert (deepest == pytest.approx(-depth * dhat, rel=1e-9)) == acts
