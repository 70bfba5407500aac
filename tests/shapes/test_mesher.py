"""The mesher: convergence to closed forms, angles for any surface and placement, refusal of what is too thin."""

from __future__ import annotations

import numpy as np
import pytest
from scipy.integrate import quad

import qlb
from qlb import shapes
from qlb.mesh.geometry import tet_components
from qlb.shapes.topology import is_closed_surface
from tests.shapes.surfaces import dihedral_angles


def rounded_cylinder_volume(radius: float, height: float, rounding: float) -> float:
    def area(y: float) -> float:
        inset = max(0.0, abs(y) - (height / 2 - rounding))
        return float(np.pi * (radius - rounding + np.sqrt(rounding**2 - inset**2)) ** 2)

    return float(2 * quad(area, 0, height / 2 - rounding)[0] + 2 * quad(area, height / 2 - rounding, height / 2)[0])


@pytest.mark.parametrize(
    ("solid", "volume"),
    [
        pytest.param(shapes.sphere(1.0), 4 / 3 * np.pi, marks=pytest.mark.slow),
        (shapes.ellipsoid((1.0, 0.7, 0.6)), 4 / 3 * np.pi * 0.42),
        pytest.param(shapes.ring(1.0, 0.4), 2 * np.pi**2 * 0.16, marks=pytest.mark.slow),
        (shapes.rounded_cylinder(0.6, 1.6, 0.3), rounded_cylinder_volume(0.6, 1.6, 0.3)),
        (
            shapes.round_cone((-0.5, 0, 0), (0.5, 0.3, 0), 0.4, 0.4),
            np.pi * 0.16 * np.sqrt(1.09) + 4 / 3 * np.pi * 0.064,
        ),
    ],
    ids=["sphere", "ellipsoid", "ring", "cylinder", "capsule"],
)
def test_volume_is_of_second_order(solid, volume):
    # Averaged over placements, since where the lattice lies scatters the error.
    spacings = np.array([0.3, 0.2, 0.13])
    errors = []
    for spacing in spacings:
        turned = [solid.rotated((1, 2, 3), 20 * k) for k in range(3)]
        volumes = [shapes.mesh_solid(s, edge=spacing).volumes().sum() for s in turned]
        errors.append(abs(np.mean(volumes) - volume))
    order = np.polyfit(np.log(spacings), np.log(errors), 1)[0]
    assert 1.7 < order < 2.5
    assert errors[-1] < 0.02 * volume


def test_boundary_nodes_lie_on_the_surface():
    solid = shapes.ellipsoid((1.0, 0.7, 0.6)).rotated((1, 1, 0), 30)
    mesh = shapes.mesh_solid(solid, tets=4000)
    boundary = np.unique(mesh.boundary_triangles())
    assert np.abs(solid(mesh.positions[boundary])).max() < 1e-9


@pytest.mark.slow
def test_angles_of_any_surface_in_any_place():
    generator = np.random.default_rng(7)
    low, high = 180.0, 0.0
    for _ in range(40):
        solid = shapes.rounded_box(generator.uniform(0.5, 1.2, 3), 0.15).smooth_union(
            shapes.sphere(0.4, generator.uniform(-0.5, 0.5, 3)), 0.2
        )
        solid = solid.rotated(generator.normal(size=3), generator.uniform(0, 360)).moved(generator.normal(size=3))
        angles = dihedral_angles(shapes.mesh_solid(solid, edge=generator.uniform(0.08, 0.14), smoothing=False))
        low, high = min(low, angles.min()), max(high, angles.max())
    assert low >= 10.0
    assert high <= 164.8


def test_two_pieces_are_refused():
    apart = shapes.sphere(0.3) | shapes.sphere(0.3, (1, 0, 0))
    with pytest.raises(qlb.InputError, match="pair of 2000 tets falls into 2 pieces"):
        shapes.mesh_solid(apart, tets=2000, name="pair")


def test_holes_where_there_should_be_none_are_refused():
    with pytest.raises(qlb.InputError, match="its surface has Euler characteristic 0, not 2"):
        shapes.mesh_solid(shapes.ring(0.1, 0.04), tets=2000, euler=2)


def test_a_solid_too_thin_for_its_tets_is_refused_soon():
    with pytest.raises(qlb.InputError, match="too much to fill"):
        shapes.mesh_solid(shapes.ellipsoid((1, 1, 0.0005)).rotated((1, 2, 3), 40), tets=500)


def test_a_solid_without_bounds_is_refused():
    with pytest.raises(qlb.InputError, match="bounds"):
        shapes.mesh_solid(shapes.above(0.0), tets=1000)


def test_surfaces_that_touch_at_an_edge_or_a_node_are_not_closed():
    corners = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], dtype=float)
    # Two tets on the same edge, and two at the same node.
    edge = qlb.TetMesh(np.vstack([corners, [[0, -1, 0], [0, 0, -1]]]), [[0, 1, 2, 3], [0, 1, 4, 5]])
    node = qlb.TetMesh(np.vstack([corners, -corners[1:]]), [[0, 1, 2, 3], [0, 5, 4, 6]])
    assert is_closed_surface(qlb.TetMesh(corners, [[0, 1, 2, 3]]))
    assert not is_closed_surface(edge)
    assert not is_closed_surface(node)
    assert tet_components(edge.tets) == tet_components(node.tets) == 2
    assert tet_components(qlb.TetMesh.box((1, 1, 1), cells=(2, 1, 1)).tets) == 1
