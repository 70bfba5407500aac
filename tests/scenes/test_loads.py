"""Loads in scene files and overrides: what they build, the way through a file, and what is refused."""

from __future__ import annotations

import json

import numpy as np
import pytest

from qlb import InputError, PointForce, Pressure, Simulation, TetMesh, TimeTable, Traction
from qlb.energies import DeadLoad
from qlb.integrators import Stage
from qlb.scenes import SCENES, load_scene, scene_yaml
from qlb.scenes.loads import LoadSettings
from tests.support import Array

TEXT = """
scene: bar
mesh: {cells: [4, 2, 2]}
threads: 1
fibres: {direction: [-y, "1 + x", 0]}
damping: {viscosity: 10 * (x > 0.5)}
loads:
  gravity: [0, "-9.81 * minimum(t, 1)", 0]
  pressure:
    - {faces: y > 0.2499, value: 100 * t}
    - faces: x > 0.99
      value: {times: [0, 1, 2], values: [0, 1e2, 50]}
  traction:
    - {faces: "(x > 0.99) * (y < 0.1)", value: [0, 0, 5]}
  forces:
    - {nodes: x > 0.99, value: {times: [0, 1], values: [[0, 0, 0], [1, 2, 3]]}}
"""
OVERRIDES = [
    "mesh.cells=4,2,2",
    "threads=1",
    "fibres.direction=-y,1 + x,0",
    "damping.viscosity=10 * (x > 0.5)",
    "loads.gravity=0,-9.81 * minimum(t, 1),0",
    "loads.pressure=[{faces: y > 0.2499, value: 100 * t}, {faces: x > 0.99,"
    " value: {times: [0, 1, 2], values: [0, 1e2, 50]}}]",
    "loads.traction=[{faces: (x > 0.99) * (y < 0.1), value: [0, 0, 5]}]",
    "loads.forces=[{nodes: x > 0.99, value: {times: [0, 1], values: [[0, 0, 0], [1, 2, 3]]}}]",
]


def build(text: str, tmp_path) -> Simulation:  # type: ignore[no-untyped-def]
    (tmp_path / "scene.yaml").write_text(text)
    return load_scene(str(tmp_path / "scene.yaml")).build()


def test_a_file_builds_what_a_script_would(tmp_path) -> None:  # type: ignore[no-untyped-def]
    simulation = build(TEXT, tmp_path)
    mesh = simulation.mesh
    top, end = mesh.faces_where(lambda x: x[:, 1] > 0.2499), mesh.faces_where(lambda x: x[:, 0] > 0.99)
    low_end = mesh.faces_where(lambda x: (x[:, 0] > 0.99) & (x[:, 1] < 0.1))
    script = Simulation(
        mesh,
        material=simulation.material,
        fibres=simulation.fibres,
        damping=simulation.damping,
        gravity=lambda t: np.array([0, -9.81 * min(t, 1), 0]),
        threads=1,
    )
    script.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
    script.add(Pressure(top, lambda t: 100 * t))
    script.add(Pressure(end, TimeTable([0, 1, 2], [0, 100, 50])))
    script.add(Traction(low_end, (0, 0, 5)))
    script.add(PointForce(mesh.nodes_where(lambda x: x[:, 0] > 0.99), lambda t: t * np.array([1, 2, 3])))
    for found, expected in zip(simulation.run(6), script.run(6), strict=True):
        np.testing.assert_allclose(found.positions, expected.positions, rtol=0, atol=1e-12)
    assert np.abs(found.positions - mesh.positions).max() > 1e-4
    assert set(np.unique(simulation.system.damping.viscosity)) == {0.0, 10.0}


def test_overrides_say_the_same_as_a_file(tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "scene.yaml").write_text(TEXT)
    scene = load_scene("bar", OVERRIDES)
    assert scene == load_scene(str(tmp_path / "scene.yaml"))
    (tmp_path / "again.yaml").write_text(scene_yaml(scene))
    assert load_scene(str(tmp_path / "again.yaml")) == scene
    assert type(scene).parse(json.loads(json.dumps(scene.model_dump(mode="json")))) == scene


def test_an_override_changes_one_entry_of_a_list(tmp_path) -> None:  # type: ignore[no-untyped-def]
    (tmp_path / "scene.yaml").write_text(TEXT)
    scene = load_scene(str(tmp_path / "scene.yaml"), ["loads.pressure.1.value=7", "loads.forces.0.nodes=x < 0.5"])
    assert [load.value for load in scene.loads.pressure[1:]] == [7.0]
    assert scene.loads.forces[0].nodes.text == "x < 0.5"
    assert scene.loads.pressure[0] == load_scene("bar", OVERRIDES).loads.pressure[0]


def test_a_key_that_is_null_in_a_file_can_be_set(tmp_path) -> None:  # type: ignore[no-untyped-def]
    # As in the file that `qlb scenes --show` prints.
    (tmp_path / "scene.yaml").write_text(scene_yaml(load_scene("bar")))
    scene = load_scene(str(tmp_path / "scene.yaml"), ["fibres.modulus=1e5"])
    assert scene.fibres is not None
    assert scene.fibres.modulus == 1e5


@pytest.mark.parametrize("name", SCENES)
def test_every_scene_has_the_loads_of_its_settings(name: str) -> None:
    alone = (
        ["bodies=[{mesh: {shape: box, tets: 100}}]", "pins=[]", "handles=[]", "obstacles=[]"]
        if name == "bodies"
        else []
    )
    simulation = load_scene(name, [*alone, "loads.forces=[{nodes: '1', value: [1, 2, 3]}]", "threads=1"]).build()
    stage = Stage(0.0, 0.1, ((1.0, simulation.mesh.positions),), np.zeros_like(simulation.mesh.positions))
    load = simulation.system.terms[-1].at(stage, simulation.mesh.positions)
    assert isinstance(load, DeadLoad)
    gradient = np.zeros_like(simulation.mesh.positions)
    load.add_value_gradient(simulation.mesh.positions, 1.0, gradient)
    np.testing.assert_array_equal(gradient, np.tile([-1.0, -2.0, -3.0], (len(gradient), 1)))


def acceleration(time: float, *overrides: str) -> Array:
    gravity = load_scene("bar", ["step=0.1", "steps=10", *overrides]).gravity()
    return np.asarray(gravity(time) if callable(gravity) else gravity)


TABLE = "loads.gravity={times: [0, 2], values: [[0, 0, 0], [0, -8, 0]]}"


@pytest.mark.parametrize("integrator", ["BDF2", "quasistatic"])
def test_gravity_in_time_has_no_ramp_unless_told(integrator: str) -> None:
    name = f"integrator={integrator}"
    np.testing.assert_allclose(acceleration(0.5, name, TABLE), [0, -2, 0])
    np.testing.assert_allclose(acceleration(0.5, name, "loads.gravity=t,0,1"), [0.5, 0, 1])
    np.testing.assert_allclose(acceleration(0.5, name, TABLE, "loads.ramp=2"), [0, -0.5, 0])
    np.testing.assert_allclose(acceleration(0.5, name, "loads.ramp=2"), [0, -9.81 / 4, 0])


def test_viscosity_by_region() -> None:
    box = TetMesh.box(cells=(4, 1, 1))
    mesh = TetMesh(box.positions, box.tets, regions=(box.centroids()[:, 0] > 0.5).astype(int))
    damping = load_scene("bar", ["damping.viscosity={0: 5, 1: 20}"]).damping
    simulation = Simulation(mesh, material=load_scene("bar").material, damping=damping, threads=1)
    np.testing.assert_array_equal(simulation.system.damping.viscosity, np.where(mesh.regions == 0, 5.0, 20.0))
    simulation.advance()


@pytest.mark.parametrize(
    ("override", "words"),
    [
        ("loads.pressure=3", ["loads.pressure: 3 must be a list", "{faces: 'x > 0.99', value: 100}"]),
        ("loads.forces={nodes: x, value: 1}", ["loads.forces", "must be a list", "nodes:"]),
        ("loads.pressure=[3]", ["loads.pressure.0 = 3 must hold keys and values"]),
        ("loads.pressure=[{faces: x > 0}]", ["loads.pressure.0.value is missing"]),
        ("loads.pressure=[{face: x > 0, value: 1}]", ["unknown key 'loads.pressure.0.face'", "faces"]),
        (
            "loads.traction=[{nodes: x > 0, value: 1}]",
            ["unknown key 'loads.traction.0.nodes'; ", "loads.traction.0.faces"],
        ),
        ("loads.pressure=[{faces: 1, value: 1}]", ["loads.pressure.0.faces: 1 must be an expression of x, y, z"]),
        ("loads.pressure=[{faces: x >, value: 1}]", ["loads.pressure.0.faces", "is not a formula"]),
        ("loads.pressure=[{faces: t > 1, value: 1}]", ["loads.pressure.0.faces", "'t', which is not known"]),
        ("loads.pressure=[{faces: x > 0, value: [1, 2, 3]}]", ["loads.pressure.0.value", "must be a number"]),
        ("loads.pressure=[{faces: x > 0, value: x}]", ["loads.pressure.0.value", "'x', which is not known"]),
        ("loads.pressure=[{faces: x > 0, value: .nan}]", ["loads.pressure.0.value", "nan"]),
        ("loads.traction=[{faces: x > 0, value: 3}]", ["loads.traction.0.value: 3 must be a vector of 3"]),
        (
            "loads.traction=[{faces: x > 0, value: {times: [1, 0], values: [[0, 0, 0], [0, 0, 1]]}}]",
            ["loads.traction.0.value: times of a table must increase"],
        ),
        (
            "loads.forces=[{nodes: x > 0, value: {times: [0, 1], values: [[0, 0, 0]]}}]",
            ["loads.forces.0.value: values of a table have shape (1, 3)", "(2, d) for 2 times"],
        ),
        ("loads.gravity=0,1", ["loads.gravity: [0, 1] must be a vector of 3"]),
        ("loads.gravity=0,x,0", ["loads.gravity", "'x', which is not known"]),
        ("loads.gravity={times: [0], value: [1]}", ["loads.gravity: unknown key 'value'", "times, values"]),
        ("loads.presure=[]", ["unknown key 'loads.presure'", "loads.pressure"]),
        ("loads.pressure.0.value=3", ["loads.pressure is a list of 0 entries and has no entry 0"]),
        ("loads.gravity.1=3", ["unknown key 'loads.gravity.1'"]),
        ("damping.viscosity=-1", ["damping.viscosity: -1 is out of range: must be >= 0 Pa s"]),
        ("damping.viscosity=t", ["damping.viscosity", "'t', which is not known"]),
        ("fibres.direction=x,y", ["fibres.direction", "must be three numbers or expressions of x, y, z"]),
        ("fibres.direction=x,y,t", ["fibres.direction", "'t', which is not known"]),
    ],
)
def test_wrong_settings_are_refused_at_once(override: str, words: list[str]) -> None:
    with pytest.raises(InputError) as refusal:
        load_scene("bar", [override])
    for word in words:
        assert word in str(refusal.value)
    assert "\n" not in str(refusal.value)


@pytest.mark.parametrize(
    ("override", "message"),
    [
        (
            "loads.pressure=[{faces: x > 1, value: 1}]",
            "loads.pressure.0.faces: the expression 'x > 1' selects none of the 900 centroids of surface triangles,"
            " which have x in [0, 1], y in [0, 0.25], z in [0, 0.25] m",
        ),
        (
            "loads.forces=[{nodes: z > 1, value: [0, 0, 1]}]",
            "loads.forces.0.nodes: the expression 'z > 1' selects none of the 756 nodes, which have x in [0, 1],"
            " y in [0, 0.25], z in [0, 0.25] m",
        ),
        (
            "loads.traction=[{faces: sqrt(x - 0.5), value: [0, 0, 1]}]",
            "loads.traction.0.faces: the expression 'sqrt(x - 0.5)' is not defined at (0.03333, 0.01667, 0) m",
        ),
    ],
)
def test_a_selection_that_does_not_fit_the_body_is_refused_with_its_extents(override: str, message: str) -> None:
    with pytest.raises(InputError) as refusal:
        load_scene("bar", [override]).build()
    assert str(refusal.value) == message


def test_functions_of_time_belong_to_scripts() -> None:
    with pytest.raises(InputError, match=r"gravity: <function .* must be a vector of 3"):
        LoadSettings(gravity=lambda t: t)
