"""Scenes: what they build, how files and overrides reach them."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import InputError
from qlb.scenes import SCENES, load_scene, scene_yaml


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_survives_the_way_through_a_file(name, tmp_path):
    scene = load_scene(name, ["step=5e-3", "threads=1"])
    (tmp_path / "scene.yaml").write_text(scene_yaml(scene))
    assert load_scene(str(tmp_path / "scene.yaml")) == scene


@pytest.mark.parametrize("name", SCENES)
def test_every_key_of_a_scene_file_says_what_it_is(name):
    for line in scene_yaml(load_scene(name)).splitlines():
        is_leaf = ": " in line and not line.startswith(("#", "scene:"))
        assert not is_leaf or "#" in line or "model:" in line, line


def test_the_default_bar_is_that_of_the_design():
    simulation = load_scene("bar").build()
    assert len(simulation.mesh.tets) == 3000
    np.testing.assert_allclose(simulation.mesh.positions.max(axis=0), [1, 0.25, 0.25])
    assert simulation.system.mass.sum() == pytest.approx(62.5)


def test_overrides_come_in_order_and_take_lists():
    scene = load_scene("bar", ["mesh.cells=2,1,1", "mesh.cells=3,1,1", "material.young=1e5"])
    assert scene.mesh.cells == (3, 1, 1)
    assert scene.material.young == 1e5


def test_twist_turns_the_far_end_about_the_axis():
    simulation = load_scene("bar", ["variant=twist", "mesh.cells=4,2,2", "step=0.05", "threads=1"]).build()
    far = simulation.mesh.nodes_where(lambda x: x[:, 0] > 1 - 1e-9)
    result = list(simulation.run(10))[-1]  # 0.5 s at half a turn a second: a quarter
    rest = simulation.mesh.positions[far] - [0, 0.125, 0.125]
    turned = result.positions[far] - [0, 0.125, 0.125]
    np.testing.assert_allclose(turned[:, 1], -rest[:, 2], atol=1e-12)
    np.testing.assert_allclose(turned[:, 2], rest[:, 1], atol=1e-12)


def test_quasistatic_gravity_grows_over_the_run_unless_told_otherwise():
    gravity = load_scene("bar", ["integrator=quasistatic", "steps=10", "step=0.1"]).gravity()
    assert callable(gravity)
    np.testing.assert_allclose(gravity(0.25), [0, -9.81 / 4, 0])
    assert load_scene("bar", ["integrator=quasistatic", "loads.ramp=0"]).gravity() == (0.0, -9.81, 0.0)
    assert load_scene("bar").gravity() == (0.0, -9.81, 0.0)


@pytest.mark.parametrize(
    ("text", "words"),
    [
        ("scene: [", ["not valid YAML"]),
        ("", ["is empty"]),
        ("scene: sphere", ["'sphere'", "bar"]),
        ("scene: bar\nmesh: 3", ["mesh"]),
        ("scene: bar\nspeed: 3", ["'speed'"]),
        ("scene: bar\nmesh: {cells: [1, 2]}", ["mesh.cells"]),
        ("scene: bar\nmaterial: {young: soft}", ["material.young", "not a number"]),
        ("scene: bar\nmaterial: {model: jelly}", ["material.model", "SNH"]),
    ],
)
def test_wrong_scene_files_are_refused(tmp_path, text, words):
    path = tmp_path / "scene.yaml"
    path.write_text(text)
    with pytest.raises(InputError) as refusal:
        load_scene(str(path))
    assert "\n" not in str(refusal.value)
    for word in words:
        assert word in str(refusal.value)


def test_mesh_path_in_a_file_is_relative_to_the_file(tmp_path):
    (tmp_path / "scene.yaml").write_text("scene: bar\nmesh: {path: body.vtu}")
    assert load_scene(str(tmp_path / "scene.yaml")).mesh.path == tmp_path / "body.vtu"
