"""Parameters that vary in space: arrays, tables by region, expressions and functions, on a mesh and in scenes."""

from __future__ import annotations

import json
from pathlib import Path

import meshio
import numpy as np
import pytest

from qlb import Fibres, InputError, Simulation, StableNeoHookean, TetMesh
from qlb.fields import Expression, RegionTable
from qlb.materials import MATERIALS, Material, MooneyRivlin
from qlb.scenes import BarScene, load_scene, scene_yaml

SLABS = "2e4 * (1 + 9 * (floor(8 * x) % 2))"
SIZE, CELLS = (1.0, 0.25, 0.25), (8, 1, 1)


@pytest.fixture
def mesh() -> TetMesh:
    plain = TetMesh.box(SIZE, cells=CELLS)
    return TetMesh(plain.positions, plain.tets, regions=np.where(plain.centroids()[:, 0] < 0.5, 1, 7))


def slabs(mesh: TetMesh) -> np.ndarray:
    x = mesh.positions[mesh.tets].mean(axis=1)[:, 0]
    return 2e4 * (1 + 9 * (np.floor(8 * x) % 2))


def test_every_material_takes_every_way_to_vary(material_class: type[Material], mesh: TetMesh) -> None:
    explicit = material_class(young=slabs(mesh)).on(mesh).parameter_table(len(mesh.tets))
    for young in (SLABS, lambda c: 2e4 * (1 + 9 * (np.floor(8 * c[:, 0]) % 2))):
        np.testing.assert_array_equal(
            material_class(young=young).on(mesh).parameter_table(len(mesh.tets)), explicit, strict=True
        )
    x = mesh.centroids()[:, 0]
    table = material_class(young={1: 2e4, "default": 5e4}, density={7: 900, 1: "1.1e3"}).on(mesh)
    np.testing.assert_array_equal(table.young, np.where(x < 0.5, 2e4, 5e4))
    np.testing.assert_array_equal(table.density, np.where(x < 0.5, 1100.0, 900.0))


def test_parameters_of_one_material_vary_too(mesh: TetMesh) -> None:
    given = MooneyRivlin(second_share="x").on(mesh)
    np.testing.assert_array_equal(given.second_share, mesh.centroids()[:, 0])


def test_fibres_vary_in_strength(mesh: TetMesh) -> None:
    table = Fibres(modulus="1e4 * x").parameter_table(mesh)
    np.testing.assert_array_equal(table[:, 0], 1e4 * mesh.centroids()[:, 0])
    with pytest.raises(InputError, match=r"fibre modulus of element \d+ = -\S+ is out of range: must be >= 0 Pa"):
        Fibres(modulus="x - 0.5").parameter_table(mesh)


@pytest.mark.parametrize("solver", ["ND", "QLB", "QLA"])
def test_a_bar_of_an_expression_is_that_of_the_array_to_the_bit(mesh: TetMesh, solver: str) -> None:
    def last(young: object) -> np.ndarray:
        material = StableNeoHookean(young=young, density="1000 + 500 * y")  # type: ignore[arg-type]
        simulation = Simulation(mesh, material=material, solver=solver, threads=1)
        simulation.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
        return list(simulation.run(3))[-1].positions

    expected = last(slabs(mesh))
    np.testing.assert_array_equal(last(SLABS), expected)
    np.testing.assert_array_equal(last(lambda c: slabs(mesh)), expected)
    assert np.abs(expected - last(2e4)).max() > 1e-5


def test_a_material_of_numbers_on_a_mesh_is_itself(material_class: type[Material], mesh: TetMesh) -> None:
    assert material_class().on(mesh) == material_class()


def test_tables_and_expressions_need_a_mesh() -> None:
    for young in ({1: 2e4}, "2e4 + x", lambda c: c[:, 0]):
        with pytest.raises(InputError, match=r"material young is the .* only on a mesh, see material.on\(mesh\)"):
            StableNeoHookean(young=young).evaluate(np.eye(3))
        with pytest.raises(InputError, match="only on a mesh"):
            StableNeoHookean(young=young).kernel_parameters()
    psi, _, _ = StableNeoHookean(young=[1e4, 2e4]).evaluate(np.stack([np.eye(3)] * 2))
    assert psi.shape == (2,)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"young": "where(x > 0.2, 2e4, -3)"}, "material young of element 0 = -3 is out of range: must be > 0 Pa"),
        ({"poisson": "0.5 + 0 * x"}, "material poisson of element 0 = 0.5 is out of range: must be > -1 and < 0.5"),
        ({"density": "x / 0"}, "material density of element 0 = inf is out of range: must be finite"),
        ({"young": "log(x - 2)"}, "material young of element 0 = nan is out of range: must be finite"),
        ({"young": [1.0, 2.0]}, "material young has shape (2,), must be one number or (48,)"),
        (
            {"young": {1: 2e4, 3: 1e4}},
            "material young: region 7 of the mesh is missing from the table of region 1, region 3",
        ),
        (
            {"young": {3: 1e4}},
            "material young: region 1 of the mesh (and 1 more) is missing from the table of region 3",
        ),
        ({"young": lambda c: c}, "material young: the function <lambda> gives shape (48, 3), must be (48,)"),
        ({"young": lambda c: "soft"}, "material young: the function <lambda> gives no numbers but str"),
    ],
)
def test_what_does_not_fit_the_mesh_is_named(mesh: TetMesh, arguments: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as refusal:
        StableNeoHookean(**arguments).on(mesh)  # type: ignore[arg-type]
    assert str(refusal.value) == message


def test_the_element_out_of_range_is_the_first_one(mesh: TetMesh) -> None:
    wrong = np.flatnonzero(mesh.centroids()[:, 0] > 0.8)[0]
    with pytest.raises(InputError, match=rf"young of element {wrong} = -3 is out of range: must be > 0 Pa"):
        StableNeoHookean(young="where(x > 0.8, -3, 2e4)").on(mesh)


def test_a_table_needs_a_mesh_with_regions() -> None:
    with pytest.raises(InputError, match=r"^material young: the table of region 1, default needs a mesh with regions"):
        StableNeoHookean(young={1: 2e4, "default": 1e4}).on(TetMesh.box(SIZE, cells=CELLS))


@pytest.mark.parametrize(
    ("value", "message"),
    [
        ({}, "young: a table by region is empty, must have one region or more, or 'default'"),
        ({1: -3}, "young: region 1 = -3 is out of range: must be > 0 Pa"),
        ({1: 1, "default": 0}, "young: default = 0 is out of range: must be > 0 Pa"),
        ({1: float("nan")}, "young: region 1 = nan is out of range: must be > 0 Pa"),
        ({1: "soft"}, "young: region 1 has value 'soft', which is not a number"),
        ({1: [1, 2]}, "young: region 1 has value [1, 2], which is not a number"),
        ({1: True}, "young: region 1 has value True, which is not a number"),
        ({"steel": 1}, "young: 'steel' is not a region: must be a whole number or 'default'"),
        ({1.5: 1}, "young: 1.5 is not a region: must be a whole number or 'default'"),
        ({True: 1}, "young: True is not a region: must be a whole number or 'default'"),
        ({1: 1, "1": 2}, "young: region '1' is in the table twice"),
        ("-3 * 2", "young: the expression '-3 * 2' = -6 is out of range: must be > 0 Pa"),
        ("9**9**9**9", "young: the expression '9**9**9**9' = inf is out of range: must be > 0 Pa"),
        (10**400, f"young: {10**400} is not a number"),
    ],
    ids=range(14),
)
def test_what_is_wrong_without_a_mesh_is_refused_at_once(value: object, message: str) -> None:
    with pytest.raises(InputError) as refusal:
        StableNeoHookean(young=value)  # type: ignore[arg-type]
    assert str(refusal.value) == message


def test_only_parameters_of_elements_vary() -> None:
    for override in ("step=1e-2*x", "step={1: 0.1}", "damping.mass=x"):
        with pytest.raises(InputError, match="is not a number"):
            load_scene("bar", [override])


def test_materials_do_not_change() -> None:
    given = np.array([1e4, 2e4])
    material = StableNeoHookean(young=given)
    given[0] = -1
    np.testing.assert_array_equal(material.young, [1e4, 2e4])
    with pytest.raises(ValueError, match="read-only"):
        material.young[0] = 1.0  # type: ignore[index]
    with pytest.raises(ValueError, match="frozen"):
        material.young = 1.0  # type: ignore[misc]


def test_materials_are_equal_where_their_parameters_are() -> None:
    for young, other in (([1e4, 2e4], [1e4, 3e4]), (SLABS, "x"), ({1: 2e4, 2: 1e4}, {1: 2e4}), (2e4, [2e4])):
        assert StableNeoHookean(young=young) == StableNeoHookean(young=young)
        assert StableNeoHookean(young=young) != StableNeoHookean(young=other)
    assert StableNeoHookean(young={1: 2e4, 2: 1e4}) == StableNeoHookean(young={2: 1e4, 1: 2e4})
    assert StableNeoHookean() != MATERIALS["StVK"]()


OVERRIDES = {
    "number": ("2e4", 2e4),
    "expression": (SLABS.replace(" ", ""), Expression(SLABS.replace(" ", ""))),
    "commas": ("where(x < 0.5, 1e4, clip(2e4 * y, 1, 9))", Expression("where(x < 0.5, 1e4, clip(2e4 * y, 1, 9))")),
    "table": ("{2: 5e4, 1: 2e4, default: 10}", RegionTable(((1, 2e4), (2, 5e4)), 10.0)),
    "array": ("1e4,2e4,3", [1e4, 2e4, 3.0]),
}


@pytest.mark.parametrize("name", OVERRIDES)
def test_scenes_keep_what_is_written(name: str, tmp_path: Path) -> None:
    text, value = OVERRIDES[name]
    scene = load_scene("bar", [f"material.young={text}", "mesh.cells=4,1,1"])
    assert scene.mesh.cells == (4, 1, 1)  # type: ignore[attr-defined]
    assert np.all(scene.material.young == value)
    (tmp_path / "scene.yaml").write_text(scene_yaml(scene))
    assert load_scene(str(tmp_path / "scene.yaml")) == scene
    assert BarScene.parse(json.loads(json.dumps(scene.model_dump(mode="json")))) == scene


def test_a_scene_file_prints_tables_and_expressions() -> None:
    scene = load_scene("bar", [f"material.young={SLABS}", "material.density={1: 2e3, default: 1e3}"])
    assert f"  young: {SLABS} # Young's modulus; > 0 Pa" in scene_yaml(scene)
    assert "  density: {1: 2000.0, default: 1000.0} # Mass density; > 0 kg/m^3" in scene_yaml(scene)


def test_a_scene_file_cannot_hold_a_function() -> None:
    scene = BarScene(material=StableNeoHookean(young=lambda c: c[:, 0]))
    for write in (scene_yaml, lambda s: s.model_dump(mode="json")):
        with pytest.raises(InputError, match=r"^the function <lambda> cannot be written to a scene file"):
            write(scene)


def test_the_slabs_of_the_bar_multiply_an_expression() -> None:
    common = ["mesh.cells=8,1,1", "heterogeneous=true", "anisotropic=true"]
    plain = load_scene("bar", common).build().system
    varying = load_scene("bar", [*common, "material.young=2e4 + 0 * x"]).build().system
    np.testing.assert_array_equal(varying.stiffness, plain.stiffness)


def test_a_wrong_expression_in_a_scene_names_the_key() -> None:
    with pytest.raises(InputError, match=r"^material.young: 'x.real' is not a number, .* has attribute access"):
        load_scene("bar", ["material.young=x.real"])


REGIONS = [3, 3, 5, 5, 5, 9]


@pytest.mark.parametrize(
    ("suffix", "form", "name"),
    [("vtu", None, "region"), ("msh", "gmsh22", "gmsh:physical"), ("mesh", None, "medit:ref")],
)
def test_regions_of_a_mesh_file_are_kept(tmp_path: Path, suffix: str, form: str | None, name: str) -> None:
    box = TetMesh.box((1, 1, 1), cells=(1, 1, 1))
    surface = box.boundary_triangles()
    data = {name: [np.zeros(len(surface), dtype=np.int32), np.array(REGIONS, dtype=np.int32)]}
    if name == "gmsh:physical":
        data["gmsh:geometrical"] = data[name]
    path = tmp_path / f"box.{suffix}"
    meshio.Mesh(box.positions, [("triangle", surface), ("tetra", box.tets)], cell_data=data).write(path, form)
    read = TetMesh.read(path)
    assert read.regions is not None
    np.testing.assert_array_equal(read.regions, REGIONS)
    scene = load_scene("bar", [f"mesh.path={path}", "material.young={3: 1e4, 5: 2e4, 9: 3e4}"])
    young = scene.material.on(scene.build().mesh).young
    np.testing.assert_array_equal(young, [1e4, 1e4, 2e4, 2e4, 2e4, 3e4])


def test_data_that_are_no_regions_are_left(tmp_path: Path) -> None:
    box = TetMesh.box((1, 1, 1), cells=(1, 1, 1))
    data = {"region": [np.linspace(0, 1, 6)], "medit:ref": [np.array(REGIONS, dtype=float)]}
    meshio.Mesh(box.positions, [("tetra", box.tets)], cell_data=data).write(tmp_path / "box.vtu")
    np.testing.assert_array_equal(TetMesh.read(tmp_path / "box.vtu").regions, REGIONS)


@pytest.mark.parametrize(
    ("regions", "message"),
    [
        ([1, 2], r"^regions have shape \(2,\), must be \(6,\), one for each tet$"),
        ([[1]] * 6, r"^regions have shape \(6, 1\), must be \(6,\), one for each tet$"),
        ([0.5] * 6, "^regions have type float64, must be integers$"),
        (["a"] * 6, "^regions have type <U1, must be integers$"),
        ([[1], [1, 2]], "^regions are not an array of numbers"),
    ],
)
def test_wrong_regions_are_refused(regions: object, message: str) -> None:
    box = TetMesh.box((1, 1, 1), cells=(1, 1, 1))
    with pytest.raises(InputError, match=message):
        TetMesh(box.positions, box.tets, regions=regions)  # type: ignore[arg-type]


def test_regions_are_the_mesh_s_own() -> None:
    box, given = TetMesh.box((1, 1, 1), cells=(1, 1, 1)), np.array(REGIONS)
    mesh = TetMesh(box.positions, box.tets, regions=given)
    given[0] = 0
    assert mesh.regions is not None
    assert mesh.regions.tolist() == REGIONS
    assert not mesh.regions.flags.writeable
    assert box.regions is None


def test_a_stiffened_material_has_all_its_moduli_times_the_factor() -> None:
    mesh = TetMesh.box(cells=(1, 1, 1))
    factor = np.arange(1.0, 7.0)
    for kind in MATERIALS.values():
        material = kind(young="1e4 + x").on(mesh)
        stiff = material.stiffened(factor)
        F = np.eye(3) + 0.1 * np.random.default_rng(3).normal(size=(6, 3, 3))
        for before, after in zip(material.evaluate(F), stiff.evaluate(F), strict=True):
            np.testing.assert_allclose(
                after, before * factor.reshape(-1, *[1] * (before.ndim - 1)), rtol=1e-10, atol=1e-9
            )
        assert stiff.density == material.density
