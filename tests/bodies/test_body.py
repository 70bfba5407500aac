"""Bodies and their placement."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Body, Fibres, InputError, Placement, StableNeoHookean, TetMesh
from qlb.bodies.body import centre_of_volume
from tests.support import small_bar

SOFT = StableNeoHookean()


def test_without_a_placement_the_mesh_is_the_same_object():
    mesh = small_bar()
    assert Body(mesh, SOFT).placed is mesh
    assert Body(mesh, SOFT, placement=Placement(origin=(1, 2, 3))).placed is mesh


def test_a_translation_is_exact():
    mesh = small_bar()
    placed = Body(mesh, SOFT, placement=Placement(translation=(1, -2, 0.5))).placed
    np.testing.assert_array_equal(placed.positions, mesh.positions - (-1, 2, -0.5))
    np.testing.assert_array_equal(placed.tets, mesh.tets)


def test_a_quarter_turn_about_the_centre_of_volume():
    mesh = TetMesh.box((2, 1, 1), cells=(2, 1, 1))
    placed = Placement(rotation=(0, 0, np.pi / 2)).of(mesh)
    x, y, z = (mesh.positions - [1, 0.5, 0.5]).T
    np.testing.assert_allclose(placed.positions, np.stack([1 - y, 0.5 + x, 0.5 + z], axis=1), atol=1e-15)


def test_all_three_about_a_given_origin():
    mesh = small_bar()
    placement = Placement(scale=3, rotation=(np.pi, 0, 0), translation=(0, 0, 7), origin=(0.1, 0.2, 0.3))
    x, y, z = (mesh.positions - [0.1, 0.2, 0.3]).T
    expected = np.stack([0.1 + 3 * x, 0.2 - 3 * y, 7.3 - 3 * z], axis=1)
    np.testing.assert_allclose(placement.of(mesh).positions, expected, atol=1e-14)


def test_the_centre_stays_and_volumes_scale_where_tets_differ_in_size():
    mesh = TetMesh(small_bar().positions * [1, 2, 3] + small_bar().positions[:, :1] ** 2, small_bar().tets)
    placed = Placement(scale=0.5, rotation=(0.3, -1.2, 0.7)).of(mesh)
    np.testing.assert_allclose(placed.volumes(), mesh.volumes() / 8, rtol=1e-12)
    np.testing.assert_allclose(placed.edge_lengths(), mesh.edge_lengths() / 2, rtol=1e-12)
    np.testing.assert_allclose(centre_of_volume(placed), centre_of_volume(mesh), atol=1e-15)


def test_regions_are_kept():
    mesh = small_bar()
    with_regions = TetMesh(mesh.positions, mesh.tets, regions=np.arange(len(mesh.tets)))
    np.testing.assert_array_equal(Placement(scale=2).of(with_regions).regions, with_regions.regions)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"scale": 0}, "scale of a placement = 0 is out of range: must be > 0"),
        ({"scale": -1.5}, "scale of a placement = -1.5 is out of range: must be > 0"),
        ({"scale": np.nan}, "scale of a placement is nan, must be finite"),
        ({"scale": (1, 2, 3)}, r"scale of a placement has shape (3,), must be one number"),
        ({"rotation": (0, 1)}, "rotation of a placement has shape (2,), must be (3,)"),
        ({"translation": (0, np.inf, 0)}, "translation of a placement is [ 0. inf  0.], must be finite"),
        ({"origin": "here"}, "origin of a placement = 'here' is not an array of numbers"),
    ],
)
def test_a_wrong_placement_is_refused(arguments, message):
    with pytest.raises(InputError) as caught:
        Placement(**arguments)
    assert str(caught.value) == message


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"mesh": "bar"}, "mesh of a body = 'bar' is out of range: must be a TetMesh"),
        ({"material": 3}, "material of a body = 3 is out of range: must be a Material"),
        ({"placement": (0, 0, 1)}, r"placement of a body = (0, 0, 1) is out of range: must be a Placement"),
        ({"name": 7}, "name of a body = 7 is out of range: must be text"),
        ({"fibres": [1]}, "fibres of a body = 1 is out of range: must be Fibres"),
        ({"velocity": (1, 2)}, "velocity has shape (2,), must be (3,) or (16, 3)"),
    ],
)
def test_a_wrong_body_is_refused(arguments, message):
    with pytest.raises(InputError) as caught:
        Body(**({"mesh": small_bar(), "material": SOFT} | arguments))
    assert str(caught.value) == message


def test_one_family_of_fibres_may_stand_alone():
    family = Fibres()
    assert Body(small_bar(), SOFT, fibres=family).fibres == (family,)


def test_bodies_do_not_change():
    with pytest.raises(AttributeError):
        Body(small_bar(), SOFT).name = "other"  # type: ignore[misc]
