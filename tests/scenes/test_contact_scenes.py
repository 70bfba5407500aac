"""Bunny and ducks: what the settings build, and that they fall, touch and come to rest."""

from __future__ import annotations

from itertools import pairwise

import meshio
import numpy as np
import pytest

import qlb
from qlb.scenes import load_scene

SMALL_BUNNY = ["mesh.tets=600", "threads=1"]
SMALL_DUCKS = ["mesh.tets=300", "threads=1"]


def write_box(path, size):
    mesh = qlb.TetMesh.box(size, cells=(2, 2, 2))
    meshio.write_points_cells(path, mesh.positions, [("tetra", mesh.tets)])


def test_the_bunny_is_as_tall_and_as_high_as_told():
    scene = load_scene("bunny", [*SMALL_BUNNY, "mesh.height=0.4", "drop.height=0.25", "drop.rotation=0,0,0"])
    simulation = scene.build()
    y = simulation.mesh.positions[:, 1]
    assert (y.min(), np.ptp(y)) == (pytest.approx(0.25), pytest.approx(0.4))
    turned = load_scene("bunny", [*SMALL_BUNNY, "mesh.height=0.4", "drop.height=0.25", "drop.rotation=0,0,1.5707963"])
    x, y, _ = turned.build().mesh.positions.T
    assert (y.min(), np.ptp(x)) == (pytest.approx(0.25), pytest.approx(0.4))
    assert simulation.integrator.name == "SDIRK2"
    assert simulation.assembly.labels == ["bunny", "ground"]


def test_a_mesh_file_takes_the_place_of_the_shape_at_the_height_of_the_scene(tmp_path):
    write_box(tmp_path / "body.vtu", (2.0, 10.0, 4.0))
    (tmp_path / "scene.yaml").write_text("scene: bunny\nmesh: {path: body.vtu, height: 0.5}\ndrop: {rotation: [0,0,0]}")
    simulation = load_scene(str(tmp_path / "scene.yaml")).build()
    np.testing.assert_allclose(np.ptp(simulation.mesh.positions, axis=0), [0.1, 0.5, 0.2])
    ducks = load_scene("ducks", [f"mesh.path={tmp_path / 'body.vtu'}", "count=2", "threads=1"]).build()
    assert len(ducks.mesh.tets) == 2 * len(simulation.mesh.tets)


def test_contact_settings_reach_the_simulation(tmp_path):
    overrides = [*SMALL_BUNNY, "contact.dhat=0.0015", "contact.friction=0.7", "contact.self_contact=false"]
    contact = load_scene("bunny", overrides).build().system.contact
    assert contact.dhat == 0.0015
    np.testing.assert_array_equal(contact.friction, [[0, 0.7], [0.7, 0]])
    pairs = "contact.pairs=[{between: [duck 0, ground]}, {between: [duck 0, duck 1]}]"
    overrides = [*SMALL_DUCKS, "count=2", pairs, "contact.pairs.0.friction=0.1", "contact.pairs.1.collide=false"]
    contact = load_scene("ducks", overrides).build().system.contact
    np.testing.assert_array_equal(contact.friction, [[0.3, 0, 0.1], [0, 0.3, 0.3], [0.1, 0.3, 0]])


def test_part_of_a_group_leaves_the_rest_as_the_scene_has_it():
    scene = load_scene("ducks", ["contact.dhat=1e-3", "material.young=3e4", "mesh.height=0.1", "damping.mass=1"])
    plain = load_scene("ducks")
    assert scene.contact == plain.contact.model_copy(update={"dhat": 1e-3})
    assert scene.material == plain.material.model_copy(update={"young": 3e4})
    assert scene.mesh == plain.mesh.model_copy(update={"height": 0.1})
    assert scene.damping == plain.damping.model_copy(update={"mass": 1.0})
    assert load_scene("ducks", ["material.model=StVK"]).material == qlb.StVenantKirchhoff()
    assert load_scene("ducks", ["contact.friction=0"]).contact.friction == 0


def test_ducks_start_one_above_the_other_turned_and_the_same_each_time():
    scene = load_scene("ducks", [*SMALL_DUCKS, "count=4", "stack.spacing=0.02", "stack.height=0.06"])
    first, again = scene.build(), scene.build()
    np.testing.assert_array_equal(first.mesh.positions, again.mesh.positions)
    bodies = [first.mesh.positions[first.nodes_of(f"duck {k}")] for k in range(4)]
    assert bodies[0][:, 1].min() == pytest.approx(0.06)
    for below, above in pairwise(bodies):
        assert above[:, 1].min() - below[:, 1].max() == pytest.approx(0.02)
    edges = [(body[1:] - body[0]).T @ (body[1:] - body[0]) for body in bodies]
    for edge in edges[1:]:  # the same shape, turned
        np.testing.assert_allclose(np.linalg.eigvalsh(edge), np.linalg.eigvalsh(edges[0]), rtol=1e-9)
        assert np.abs(edge - edges[0]).max() > 0.1 * np.abs(edge).max()


@pytest.mark.parametrize(
    ("name", "override", "words"),
    [
        ("bunny", "mesh.tets=50", "mesh.tets"),
        ("bunny", "drop.height=0", "drop.height"),
        ("bunny", "contact.friction=-1", "contact.friction"),
        ("bunny", "contact.pairs=[{between: [bunny, roof]}]", "'roof' is not known: must be one of bunny, ground"),
        ("ducks", "count=0", "count"),
        ("ducks", "stack.spacing=-1", "stack.spacing"),
        ("ducks", "mesh.path=nowhere.msh", "nowhere.msh"),
    ],
)
def test_wrong_settings_are_named(name, override, words):
    small = SMALL_BUNNY if name == "bunny" else SMALL_DUCKS
    with pytest.raises(qlb.InputError, match=words):
        _ = load_scene(name, [*small, override]).build().system


@pytest.mark.slow
@pytest.mark.parametrize(
    ("name", "overrides"),
    [
        ("bunny", ["mesh.tets=600"]),
        ("ducks", ["mesh.tets=300", "count=2", "stack.height=0.02"]),
    ],
)
def test_it_falls_touches_and_comes_to_rest_without_an_intersection(name, overrides):
    scene = load_scene(name, [*overrides, "threads=1", "solver=ND", "contact.check=true"])
    simulation = scene.build()
    mass = simulation.system.mass[:, None]
    energies, contacts = [], []
    for result in simulation.run(scene.steps):
        assert result.converged
        energies.append(0.5 * float((mass * result.velocities**2).sum()))
        contacts.append(result.contact.count)
    assert contacts[0] == 0
    assert max(contacts) > 10
    assert np.mean(energies[-10:]) < 0.06 * max(energies)
    weight = 9.81 * float(mass.sum())
    on_ground = np.mean([simulation.advance().contact.on("ground")[1] for _ in range(20)])
    assert on_ground == pytest.approx(-weight, rel=0.2)
