"""Every shape is a sound mesh: closed, without intersections, of good tets, of the size asked for, the same again."""

from __future__ import annotations

import numpy as np
import pytest

import qlb
from qlb import shapes
from qlb.shapes.characters import _character
from tests.shapes.surfaces import dihedral_angles, enclosed_volume, intersects_itself, surface_characters

CHARACTERS = ["armadillo", "bunny", "duck"]
EULER = {"torus": [0], "shell": [2, 2]}


@pytest.fixture(scope="module", params=sorted(shapes.SHAPES))
def shape(request: pytest.FixtureRequest) -> tuple[str, qlb.TetMesh]:
    return request.param, shapes.SHAPES[request.param](tets=6000)


def test_surface_is_closed_and_has_the_right_topology(shape):
    name, mesh = shape
    assert surface_characters(mesh) == EULER.get(name, [2])


def test_surface_does_not_intersect_itself(shape):
    assert not intersects_itself(shape[1])


def test_tets_are_well_shaped(shape):
    angles = dihedral_angles(shape[1])
    assert angles.min() >= 15
    assert angles.max() <= 150


def test_tets_are_positive_and_fill_the_surface(shape):
    _, mesh = shape
    assert mesh.volumes().min() > 0
    assert mesh.volumes().sum() == pytest.approx(enclosed_volume(mesh), rel=1e-12)


def test_number_of_tets(shape):
    name, mesh = shape
    assert len(mesh.tets) == pytest.approx(6000, rel=0.2 if name == "box" else 0.05)


@pytest.mark.slow
def test_same_bits_twice(shape):
    name, mesh = shape
    _character.cache_clear()
    again = shapes.SHAPES[name](tets=6000)
    assert again is not mesh
    assert np.array_equal(again.positions, mesh.positions)
    assert np.array_equal(again.tets, mesh.tets)


@pytest.mark.slow
@pytest.mark.parametrize("name", CHARACTERS)
@pytest.mark.parametrize("tets", [2000, 5000, 8000, 12_000, 20_000, 35_000, 60_000])
def test_characters_of_many_sizes(name, tets):
    mesh = shapes.SHAPES[name](tets=tets)
    assert len(mesh.tets) == pytest.approx(tets, rel=0.05)
    assert surface_characters(mesh) == [2]
    assert not intersects_itself(mesh)
    assert dihedral_angles(mesh).min() >= 12
    assert mesh.edge_lengths().min() > 0.25 * mesh.edge_lengths().mean()


@pytest.mark.slow
@pytest.mark.parametrize("name", CHARACTERS)
def test_characters_stand_on_the_ground_and_are_as_tall_as_asked(name):
    mesh = shapes.SHAPES[name](tets=20_000, height=0.5)
    low, high = mesh.positions.min(axis=0), mesh.positions.max(axis=0)
    assert low[1] == pytest.approx(0, abs=1e-9)
    assert high[1] == pytest.approx(0.5, abs=0.01)
    assert -low[2] == pytest.approx(high[2], rel=0.02)
    # They do not fall over: the centre of mass is above what touches the ground.
    standing = mesh.positions[mesh.positions[:, 1] < 0.01 * high[1]]
    centre = np.average(mesh.centroids(), axis=0, weights=mesh.volumes())
    assert standing[:, 0].min() + 0.02 < centre[0] < standing[:, 0].max() - 0.02
    assert standing[:, 2].min() + 0.02 < centre[2] < standing[:, 2].max() - 0.02


def test_by_length_of_edges():
    mesh = shapes.ball(0.1, edge=0.02)
    assert 0.015 < mesh.edge_lengths().mean() < 0.02


@pytest.mark.parametrize(
    ("call", "message"),
    [
        (lambda: shapes.ball(-1), "radius -1 is out of range"),
        (lambda: shapes.ball(float("nan")), "radius nan is out of range"),
        (lambda: shapes.ball(0.1, tets=3), "ball: tets 3 is out of range: a whole number, 100 to 2000000"),
        (lambda: shapes.ball(0.1, tets=1000.5), "ball: tets 1000.5 is out of range"),
        (lambda: shapes.ball(0.1, tets="many"), "ball: tets 'many' is out of range"),
        (lambda: shapes.ball(0.1, tets=1000, edge=0.1), "ball: give either tets or edge, not both"),
        (lambda: shapes.ball(0.1, edge=1e-9), "ball: edge 1e-09 is out of range"),
        (lambda: shapes.ball(0.1, edge=0), "ball: edge 0 is out of range"),
        (lambda: shapes.shell(0.1, 0.2), "shell: thickness 0.2 is out of range"),
        (lambda: shapes.shell(0.1, 0.001, tets=500), "shell of 500 tets"),
        (lambda: shapes.torus(0.1, 0.2), "tube 0.2 m is out of range"),
        (lambda: shapes.cylinder(0.1, 0.2, rounding=0.3), "rounding 0.3 m is out of range"),
        (lambda: shapes.box((1, 1)), "box: size has shape"),
        (lambda: shapes.box((1, 1, 0)), "box: size 0.0 is out of range"),
        (lambda: shapes.bunny(tets=0), "bunny: tets 0 is out of range"),
        (lambda: shapes.bunny(height=0), "bunny: height 0 is out of range"),
        (lambda: shapes.duck(edge=0.3), "duck with edge 0.3 m"),
    ],
)
def test_refusals(call, message):
    with pytest.raises(qlb.InputError, match=message.replace("(", r"\(")):
        call()


@pytest.mark.slow
@pytest.mark.parametrize("name", CHARACTERS)
def test_thin_parts_have_nodes_inside(name):
    # Ears and hands are not sheets of tets with every node on the surface: some node inside is high up and far out.
    mesh = shapes.SHAPES[name]()
    inside = np.ones(len(mesh.positions), dtype=bool)
    inside[mesh.boundary_triangles()] = False
    reach = np.abs(mesh.positions).max(axis=0)
    within = np.abs(mesh.positions[inside]).max(axis=0)
    assert (within[1:] > 0.88 * reach[1:]).all()
    assert mesh.positions[inside, 0].max() > 0.85 * mesh.positions[:, 0].max()
    assert mesh.positions[inside, 0].min() < 0.85 * mesh.positions[:, 0].min()
