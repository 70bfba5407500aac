"""The scene `bodies`: a file and a script give the same bits, settings mean what they say, runs can be run again."""

from __future__ import annotations

import json
import os
from pathlib import Path

import meshio
import numpy as np
import pytest
import yaml

import qlb
from qlb.scenes import BodiesScene, Scene, load_scene, scene_yaml
from qlb.studies import run_scene

FULL = """
version: 1
bodies:
  - name: slab
    mesh: {shape: box, size: [0.4, 0.1, 0.2], tets: 200}
    material: &stiff {model: MR, young: 5e4, poisson: 0.45, density: 1100}
    fibres: [{modulus: 1e4, direction: [0, 1, 0]}]
    placement: {rotate: {axis: [0, 1, 0], degrees: 30}, lowest: 0.005}
  - name: cube
    mesh: {shape: box, size: [0.1, 0.1, 0.1], tets: 100}
    placement: {scale: 1.5, rotation: [0.1, 0, 0], translation: [0.05, 0.3, 0]}
    velocity: [0, -1, 0]
  - mesh: {shape: box, size: [1, 1, 1], tets: 100}
    material: {<<: *stiff, young: 1e4}
    placement: {height: 0.1, translation: [1, 0.2, 0]}
material: {young: 2e4, poisson: 0.4}
pins:
  - {body: slab, nodes: y < 0.006, axes: y, until: 0.02}
handles:
  - body: body 2
    nodes: x > 1.04
    motion: {kind: keyframes, times: [0, 0.1], translations: [[0, 0, 0], [0.1, 0, 0]], ease: smooth}
  - {body: cube, nodes: y > 0.35, axes: xz, motion: {kind: rotation, axis: [0, 1, 0], origin: [0.05, 0, 0], rate: 1}}
obstacles:
  - name: ground
  - name: wall
    mesh: {shape: box, size: [0.1, 0.4, 0.4], tets: 100}
    placement: {translation: [-0.5, 0.2, 0]}
    motion: {kind: displacement, value: [0.5 * t, 0, 0]}
loads:
  gravity: [0, -5, 0]
  forces: [{body: cube, nodes: y > 0.3, value: [0.1, 0, 0]}]
  pressure: [{body: body 2, faces: y > 0.24, value: 100 * t}]
contact: {dhat: 0.004, friction: 0.2, pairs: [{between: [slab, ground], friction: 0.6}]}
damping: {viscosity: 5}
integrator: SDIRK2
solver: ND
step: 0.01
steps: 5
threads: 1
"""


def script() -> qlb.Simulation:
    stiff = qlb.MooneyRivlin(young=5e4, poisson=0.45, density=1100)
    slab = qlb.shapes.box((0.4, 0.1, 0.2), tets=200)
    low = qlb.Placement(rotation=(0, np.radians(30), 0)).of(slab).positions[:, 1].min()
    bodies = [
        qlb.Body(
            slab,
            stiff,
            fibres=[qlb.Fibres(modulus=1e4, direction=(0, 1, 0))],
            placement=qlb.Placement(rotation=(0, np.radians(30), 0), translation=(0, 0.005 - low, 0)),
            name="slab",
        ),
        qlb.Body(
            qlb.shapes.box((0.1, 0.1, 0.1), tets=100),
            qlb.StableNeoHookean(young=2e4, poisson=0.4),
            placement=qlb.Placement(1.5, (0.1, 0, 0), (0.05, 0.3, 0)),
            velocity=(0, -1, 0),
            name="cube",
        ),
        qlb.Body(
            qlb.shapes.box((1, 1, 1), tets=100),
            qlb.MooneyRivlin(young=1e4, poisson=0.45, density=1100),
            placement=qlb.Placement(0.1, translation=(1, 0.2, 0)),
            name="body 2",
        ),
    ]
    block = qlb.Placement(translation=(-0.5, 0.2, 0)).of(qlb.shapes.box((0.1, 0.4, 0.4), tets=100))
    used, triangles = np.unique(block.boundary_triangles(), return_inverse=True)
    wall = qlb.Obstacle(
        block.positions[used],
        triangles.reshape(-1, 3),
        motion=lambda x, t: x + np.array([0.5 * t, 0.0, 0.0]),
        name="wall",
    )
    contact = qlb.Contact(dhat=0.004, friction=0.2, pairs=[qlb.ContactPair(between=("slab", "ground"), friction=0.6)])
    sim = qlb.Simulation(
        bodies,
        obstacles=[qlb.Plane((0, 0, 0), (0, 1, 0), name="ground"), wall],
        contact=contact,
        damping=qlb.Damping(viscosity=5),
        integrator="SDIRK2",
        solver="ND",
        gravity=(0, -5, 0),
        threads=1,
    )
    nodes = {name: sim.nodes_of(name) for name in ("slab", "cube", "body 2")}
    x = sim.mesh.positions

    def where(body: str, chosen: np.ndarray) -> np.ndarray:
        return np.intersect1d(nodes[body], np.flatnonzero(chosen))

    faces = sim.mesh.faces_where(lambda c: c[:, 1] > 0.24)
    sim.add(qlb.Pressure(faces[np.isin(faces[:, 0], nodes["body 2"])], lambda t: 100 * t))
    sim.add(qlb.PointForce(where("cube", x[:, 1] > 0.3), (0.1, 0, 0)))
    sim.pin(where("slab", x[:, 1] < 0.006), "y", until=0.02)
    sim.move(where("body 2", x[:, 0] > 1.04), qlb.Keyframes([0, 0.1], [[0, 0, 0], [0.1, 0, 0]], ease="smooth"))
    sim.move(where("cube", x[:, 1] > 0.35), qlb.Rotation((0, 1, 0), (0.05, 0, 0), 1.0), "xz")
    return sim


def load(text: str, folder: Path, name: str = "scene.yaml") -> Scene:
    (folder / name).write_text(text)
    return load_scene(str(folder / name))


def test_a_file_and_a_script_give_the_same_bits(tmp_path):
    built, written = load(FULL, tmp_path).build(), script()
    touched = 0
    for found, expected in zip(built.run(5), written.run(5), strict=True):
        np.testing.assert_array_equal(found.positions, expected.positions)
        np.testing.assert_array_equal(found.velocities, expected.velocities)
        touched += found.contact.count
    assert touched > 0
    moved = np.linalg.norm(found.positions[: len(built.mesh.positions)] - built.mesh.positions, axis=1)
    assert all(moved[built.nodes_of(name)].max() > 1e-3 for name in ("slab", "cube", "body 2"))


def test_until_lets_go(tmp_path):
    text = (
        "bodies: [{mesh: {shape: box, size: [0.2, 0.2, 0.2], tets: 100}}]\nthreads: 1\n"
        "pins: [{nodes: y > 0.099, until: 0.05}]"
    )
    simulation = load(text, tmp_path).build()
    top = np.flatnonzero(simulation.mesh.positions[:, 1] > 0.099)
    moved = [np.abs(r.positions[top] - simulation.mesh.positions[top]).max() for r in simulation.run(8)]
    assert max(moved[:5]) == 0
    assert min(moved[5:]) > 0


def as_toml(value: object) -> str:
    """Inline TOML of plain data; what is null is left out, as TOML has no word for it."""
    if isinstance(value, dict):
        return "{" + ", ".join(f"{json.dumps(k)} = {as_toml(v)}" for k, v in value.items() if v is not None) + "}"
    if isinstance(value, list):
        return "[" + ", ".join(map(as_toml, value)) + "]"
    return json.dumps(value)


def test_yaml_toml_json_and_the_file_that_is_shown_are_one_scene(tmp_path):
    scene = load(FULL, tmp_path)
    plain = scene.model_dump(mode="json")
    toml = "\n".join(f"{key} = {as_toml(value)}" for key, value in plain.items() if value is not None)
    assert load(toml, tmp_path, "scene.toml") == scene
    assert load(scene_yaml(scene), tmp_path, "shown.yaml") == scene
    assert load(json.dumps(plain), tmp_path, "scene.json") == scene
    assert load(yaml.safe_dump(plain), tmp_path, "dumped.yaml") == scene
    assert type(scene) is BodiesScene


def test_the_scene_without_a_file_is_one_to_start_from(tmp_path):
    scene = load_scene("bodies")
    shown = scene_yaml(scene)
    assert load(shown, tmp_path) == scene
    for key in ("bodies:", "  - name: ", "    mesh:", "pins:", "handles:", "obstacles:", "contact:", "  friction: 0.3"):
        assert any(line.startswith(key) for line in shown.splitlines()), key
    changed = load_scene("bodies", ["bodies.1.material.young=1e4", "handles.0.until=0.3", "steps=3"])
    assert changed.bodies[1].material.young == 1e4
    assert load_scene("bodies") == scene  # the start is not changed by what is made of it


def test_an_alias_is_a_copy(tmp_path):
    (tmp_path / "scene.yaml").write_text(
        "bodies:\n  - {mesh: &m {shape: box}, material: &a {young: 1e4}}\n  - {mesh: *m, material: *a}\n"
    )
    scene = load_scene(str(tmp_path / "scene.yaml"), ["bodies.1.material.young=3e4"])
    assert [body.material.young for body in scene.bodies] == [1e4, 3e4]


def write_mesh(path: Path) -> None:
    mesh = qlb.TetMesh.box((0.2, 0.2, 0.2), cells=(2, 2, 2))
    meshio.write_points_cells(path, mesh.positions, [("tetra", mesh.tets)])


def write_surface(path: Path) -> None:
    points = np.array([[-1.0, 0, -1], [1, 0, -1], [1, 0, 1], [-1, 0, 1]])
    meshio.write_points_cells(path, points, [("triangle", np.array([[0, 2, 1], [0, 3, 2]]))])


PATHS = """
bodies:
  - {name: a, mesh: {path: parts/body.vtu}}
obstacles:
  - {name: floor, mesh: {path: parts/floor.obj}, placement: {translation: [0, -0.03, 0]}}
contact: {pairs: [{between: [a, floor], friction: 0.5}]}
steps: 2
threads: 1
"""


def test_a_run_can_be_run_again_from_anywhere_whatever_its_paths(tmp_path, monkeypatch):
    (tmp_path / "in" / "parts").mkdir(parents=True)
    (tmp_path / "away").mkdir()
    write_mesh(tmp_path / "in" / "parts" / "body.vtu")
    write_surface(tmp_path / "in" / "parts" / "floor.obj")
    (tmp_path / "in" / "mine.yaml").write_text(PATHS)
    monkeypatch.chdir(tmp_path)
    first = run_scene(load_scene(os.path.join("in", "mine.yaml")), Path("out/first"))
    monkeypatch.chdir(tmp_path / "away")
    again = run_scene(load_scene("../out/first/scene.yaml"), Path("again"))
    texts = [(folder / "scene.yaml").read_text() for folder in (tmp_path / "out/first", again.directory)]
    assert texts[0] == texts[1]
    frames = [np.load(folder / "frames/000002.npz")["positions"] for folder in (tmp_path / "out/first", Path("again"))]
    np.testing.assert_array_equal(frames[0], frames[1])
    assert len(frames[0]) == 27 + 4
    assert first.summary["converged"]


def test_paths_of_overrides_are_relative_to_the_working_directory(tmp_path, monkeypatch):
    (tmp_path / "in").mkdir()
    (tmp_path / "in" / "scene.yaml").write_text("bodies: [{mesh: {shape: box, tets: 100}}]")
    write_mesh(tmp_path / "body.vtu")
    monkeypatch.chdir(tmp_path)
    scene = load_scene("in/scene.yaml", ["bodies.0.mesh={path: body.vtu}"])
    assert len(scene.build().mesh.positions) == 27
    assert scene.model_dump(mode="json")["bodies"][0]["mesh"]["path"] == str(tmp_path / "body.vtu")


def test_placements(tmp_path):
    text = """
bodies:
  - mesh: {shape: box, size: [1, 2, 4], tets: 100}
    placement: {height: 1, rotate: {axis: [1, 0, 0], degrees: 90}, lowest: 3, translation: [7, 0, 0]}
  - mesh: {shape: box, size: [1, 2, 4], tets: 100}
    placement: {scale: 2, origin: [0.5, 0, 0], translation: [0, 20, 0]}
obstacles:
  - mesh: {shape: box, size: [1, 2, 4], tets: 100}
    placement: {height: 1, rotate: {axis: [1, 0, 0], degrees: 90}, lowest: -3}
contact: false
"""
    simulation = load(text, tmp_path).build()
    x = simulation.assembly.system_mesh.positions
    bounds = [(x[simulation.nodes_of(k)].min(axis=0), x[simulation.nodes_of(k)].max(axis=0)) for k in range(3)]
    np.testing.assert_allclose(bounds[0], [[6.75, 3, -0.5], [7.25, 5, 0.5]], atol=1e-12)
    np.testing.assert_allclose(bounds[1], [[-1.5, 18, -4], [0.5, 22, 4]], atol=1e-12)
    np.testing.assert_allclose(bounds[2], [[-0.25, -3, -0.5], [0.25, -1, 0.5]], atol=1e-12)
    assert simulation.contact is None


def test_built_in_scenes_take_obstacles_pins_and_handles_too():
    extra = [
        "obstacles=[{name: shelf, point: [0, -0.3, 0]}]",
        "pins=[{nodes: x > 0.999, axes: z}]",
        "handles=[{nodes: x > 0.999, axes: y, motion: {kind: translation, velocity: [0, 1, 0]}}]",
        "contact.friction=0.5",
    ]
    simulation = load_scene("bar", ["mesh.cells=4,1,1", "threads=1", *extra]).build()
    assert simulation.assembly.labels == ["body 0", "shelf"]
    assert simulation.contact.friction == 0.5
    far = np.flatnonzero(simulation.mesh.positions[:, 0] > 0.999)
    result = simulation.advance()
    moved = result.positions[far] - simulation.mesh.positions[far]
    np.testing.assert_allclose(moved[:, 1:], [[0.01, 0]] * len(far), atol=1e-15)
    ducks = load_scene(
        "ducks", ["count=1", "mesh.tets=300", "obstacles=[{name: roof, point: [0, 1, 0], normal: [0, -1, 0]}]"]
    )
    assert ducks.build().assembly.labels == ["duck 0", "ground", "roof"]
    assert load_scene("bar").build().contact is None


ONE = "bodies:\n  - name: a\n    mesh: {shape: box, tets: 100}\n"
TWO = ONE + "  - name: b\n    mesh: {shape: ball, tets: 200}\n    placement: {translation: [1, 0, 0]}\n"


@pytest.mark.parametrize(
    ("text", "place", "words"),
    [
        (ONE + "speed: 3\n", "4:1", ["unknown key 'speed'"]),
        (ONE + "stpes: 3\n", "4:1", ["unknown key 'stpes'; did you mean 'steps'"]),
        (ONE + "step: -1\n", "4:1", ["step: -1 is out of range: must be > 0 s"]),
        (ONE + "version: 2\n", "4:1", ["version = 2 is not known: this qlb reads version 1"]),
        (ONE + "version: true\n", "4:1", ["version = True"]),
        (ONE + "scene: bodie\n", "4:1", ["scene = 'bodie' is not known", "bodies"]),
        (ONE + "    mass: 3\n", "4:5", ["unknown key 'bodies.0.mass'"]),
        (ONE + "    density: 3\n", "4:5", ["'bodies.0.density'; did you mean 'bodies.0.material.density'?"]),
        (ONE + "gravity: [0, 0, 0]\n", "4:1", ["unknown key 'gravity'; did you mean 'loads.gravity'?"]),
        (ONE + "step: 10 ms\n", "4:1", ["step: '10 ms' is not a number: write it without a unit, in s"]),
        (ONE + "    material: {young: 30kPa}\n", "4:16", ["young: '30kPa' is not a number", "without a unit, in Pa"]),
        (ONE + "    mesh: {shape: box}\n", "4:5", ["'mesh'", "again", "line 3"]),
        (ONE + "    material:\n      yong: 3\n", "5:7", ["bodies.0.material.yong", "bodies.0.material.young"]),
        (ONE + "    placement: {height: 1, scale: 2}\n", "4:5", ["bodies.0.placement", "scale and height"]),
        (ONE + "    placement: {translation: [0, 1]}\n", "4:17", ["bodies.0.placement.translation"]),
        (ONE + "    placement: {translation: [0, .nan, 1]}\n", "4:34", ["bodies.0.placement.translation.1", "finite"]),
        (ONE + "    material: {young: 1e4 * (y - 5)}\n", "4:5", ["bodies.0.material", "young of element 0", "> 0 Pa"]),
        (ONE + "material: {young: {1: 3}}\n", "4:1", ["material", "regions"]),
        ("bodies: []\n", "1:1", ["bodies", "at least 1"]),
        ("bodies: 3\n", "1:1", ["bodies: 3 must be a list"]),
        ("bodies:\n  - 3\n", "2:5", ["bodies.0 = 3 must hold keys and values"]),
        (
            "bodies:\n  - mesh: a.obj\n",
            "2:5",
            ["bodies.0.mesh = 'a.obj' must hold keys and values, such as {path: a.obj}"],
        ),
        ("bodies:\n  - mesh: ball\n", "2:5", ["must hold keys and values, such as {shape: ball}"]),
        (ONE + "    material: rubber\n", "4:5", ["must hold keys and values, such as {model: SNH}"]),
        ("bodies:\n  - {name: a}\n", "2:5", ["bodies.0.mesh is missing"]),
        ("bodies:\n  - mesh: {radius: 3}\n", "2:5", ["bodies.0.mesh.shape is missing", "ball"]),
        ("bodies:\n  - mesh: {shape: bal}\n", "2:12", ["bodies.0.mesh.shape: 'bal' is not known", "ball"]),
        ("bodies:\n  - mesh: {shape: ball, size: 3}\n", "2:25", ["unknown key 'bodies.0.mesh.size'"]),
        ("bodies:\n  - mesh: {shape: ball, tets: 1e12}\n", "2:25", ["bodies.0.mesh.tets", "<= 2e+06"]),
        ("bodies:\n  - mesh: {shape: ball, edge: 1e-9}\n", "2:5", ["bodies.0.mesh", "edge 1e-09 is out of range"]),
        ("bodies:\n  - mesh: {shape: box, edge: 1e-9}\n", "2:5", ["bodies.0.mesh", "tets, must be at most 2e+07"]),
        ("bodies:\n  - mesh: {path: no.vtu}\n", "2:5", ["bodies.0.mesh", "no.vtu does not exist"]),
        (TWO + "pins: [{body: c, nodes: x > 0}]\n", "7:9", ["pins.0.body: no body has the name 'c'; bodies: a, b"]),
        (TWO + "pins: [{nodes: x > 0}]\n", "7:8", ["pins.0.body is missing", "a, b"]),
        (TWO + "pins:\n  - {body: b, nodes: x < 0}\n", "8:15", ["pins.0.nodes", "selects none", "x in [0.90"]),
        (TWO + "pins: [{body: a, nodes: x > 0, axes: xw}]\n", "7:32", ["pins.0.axes", "'xw'"]),
        (TWO + "loads: {forces: [{nodes: x, value: [0, 0, 1]}]}\n", "7:18", ["loads.forces.0.body is missing"]),
        (ONE + "pins: [{nodes: x > 0}, {nodes: y > 0}]\n", "4:24", ["pins.1", "is held already"]),
        (ONE + "pins: {nodes: x > 0}\n", "4:1", ["pins", "must be a list, such as [{nodes: x < 0.01}]"]),
        (ONE + "pins: [{nodes: __import__('os')}]\n", "4:9", ["pins.0.nodes", "not known"]),
        (ONE + "handles: [{nodes: x > 0}]\n", "4:11", ["handles.0.motion is missing"]),
        (ONE + "handles: [{nodes: x > 0, motion: {}}]\n", "4:26", ["handles.0.motion.kind is missing", "keyframes"]),
        (
            ONE + "handles: [{nodes: x > 0, motion: {kind: rotation, axis: [0, 0, 0]}}]\n",
            "4:26",
            ["handles.0.motion", "has no length"],
        ),
        (
            ONE + "handles: [{nodes: x > 0, motion: {kind: keyframes, times: [0, 0]}}]\n",
            "4:26",
            ["handles.0.motion", "must increase"],
        ),
        (
            ONE + "handles: [{nodes: x > 0, motion: {kind: displacement, value: [1 + t, 0, 0]}}]\n",
            "4:26",
            ["handles.0.motion", "[1.0, 0.0, 0.0]", "must be [0, 0, 0]"],
        ),
        (ONE + "obstacles: [{name: a}]\n", "4:14", ["obstacles.0.name: 'a' is given already to bodies.0"]),
        (ONE + "obstacles: [{normal: [0, 0, 0]}]\n", "4:13", ["obstacles.0", "has no length"]),
        (ONE + "obstacles: [{mesh: {shape: torus, radius: -1}}]\n", "4:35", ["obstacles.0.mesh.radius", "> 0 m"]),
        (ONE + "contact: {pairs: [{between: [a, c]}]}\n", "4:19", ["contact.pairs.0: 'c' is not known"]),
        (ONE + "contact: 3\n", "4:1", ["contact = 3 must hold keys and values"]),
        ("bodys: []\n", "1:1", ["scene is missing", "bodies"]),
    ],
)
def test_what_is_wrong_is_named_with_its_place(tmp_path, text, place, words):
    (tmp_path / "scene.yaml").write_text(text)
    with pytest.raises(qlb.InputError) as refusal:
        run_scene(load_scene(str(tmp_path / "scene.yaml")), tmp_path / "out")
    message = str(refusal.value)
    assert "\n" not in message
    start = f"{tmp_path / 'scene.yaml'}:{place}: " if place else str(tmp_path / "scene.yaml")
    assert message.startswith(start), message
    for word in words:
        assert word in message
    assert not (tmp_path / "out").exists()


def test_one_mistake_is_one_and_two_are_two(tmp_path):
    (tmp_path / "scene.yaml").write_text("bodies:\n  - mesh: {shape: bal}\n")
    with pytest.raises(qlb.InputError, match=r"torus$"):
        load_scene(str(tmp_path / "scene.yaml"))
    (tmp_path / "scene.yaml").write_text("bodies:\n  - mesh: {shape: bal}\n  - mesh: {shape: torsu}\nstep: 0\n")
    with pytest.raises(qlb.InputError, match=r"out of range: must be > 0 s \(and 2 more problems\)$"):
        load_scene(str(tmp_path / "scene.yaml"))


def test_a_name_that_is_nearly_right_is_named(tmp_path):
    (tmp_path / "scene.yaml").write_text(ONE)
    for name, meant in (("barr", "bar"), (str(tmp_path / "scene.yml"), str(tmp_path / "scene.yaml"))):
        with pytest.raises(qlb.InputError, match=f"did you mean '{meant}'"):
            load_scene(name)


def test_the_place_in_a_toml_file(tmp_path):
    text = '[[bodies]]\nname = "a"\nmesh = {shape = "box"}\n\n[[bodies]]\nmesh = {shape = "box"}\nmaterial.young = -1\n'
    with pytest.raises(qlb.InputError, match=r"scene.toml:7:1: bodies.1.material.young: -1 is out of range"):
        load(text, tmp_path, "scene.toml")


def test_an_override_is_not_blamed_on_the_file(tmp_path):
    (tmp_path / "scene.yaml").write_text(ONE + "step: 1\n")
    with pytest.raises(qlb.InputError) as refusal:
        load_scene(str(tmp_path / "scene.yaml"), ["step=-3"])
    assert str(refusal.value) == "step: -3 is out of range: must be > 0 s"
