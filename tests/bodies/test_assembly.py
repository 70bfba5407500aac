"""Several bodies as one system, held against the systems of each alone."""

from __future__ import annotations

import numpy as np
import pytest
import sympy

from qlb import (
    Body,
    Damping,
    Fibres,
    InputError,
    MooneyRivlin,
    Obstacle,
    Placement,
    Plane,
    StableNeoHookean,
    SymbolicMaterial,
    TetMesh,
    _native,
)
from qlb.bodies import Assembly
from qlb.system import HeldNodes, System
from tests.support import dense, small_bar

RNG = np.random.default_rng(5)
GROUND = Obstacle([[0, -9, 0], [1, -9, 0], [0, -9, 1]], [[0, 1, 2]], name="ground")


def with_regions(mesh: TetMesh) -> TetMesh:
    return TetMesh(mesh.positions, mesh.tets, regions=np.arange(len(mesh.tets)) % 2)


def symbolic(factor: float) -> SymbolicMaterial:
    I1, _, J = SymbolicMaterial.invariants
    mu = sympy.Symbol("mu", positive=True)
    psi = mu / 2 * (I1 * J ** sympy.Rational(-2, 3) - 3) + factor * mu * (J - 1) ** 2
    return SymbolicMaterial(psi=psi, parameters={"mu": 1e4})


def system(*bodies: Body, mass: str = "lumped", obstacles: tuple[Obstacle | Plane, ...] = ()) -> System:
    whole = Assembly(bodies, obstacles)
    return System(
        whole,
        gravity=(0, -9.81, 0),
        mass=mass,  # type: ignore[arg-type]
        damping=Damping(viscosity=3.0),
        held=HeldNodes(len(whole.system_mesh.positions)),
        threads=1,
    )


@pytest.fixture
def bodies() -> list[Body]:
    """Equal and different models, parameters of every kind, fibres on some, meshes of different sizes."""
    mesh = small_bar()
    young = np.linspace(1e4, 4e4, len(mesh.tets))
    return [
        Body(mesh, StableNeoHookean(young=young), name="array"),
        Body(mesh, MooneyRivlin(), placement=Placement(translation=(0, 2, 0)), fibres=[Fibres()]),
        Body(
            small_bar((2, 2, 1)),
            StableNeoHookean(young="1e4 * (1 + y)", density="1000 + 100 * z"),
            placement=Placement(scale=2, rotation=(0, 0, 1), translation=(0, 4, 0)),
            fibres=[Fibres(direction=("y", "1", "0")), Fibres(model="StVK", modulus=5e3)],
        ),
        Body(with_regions(mesh), StableNeoHookean(young={0: 1e4, 1: 5e4}), placement=Placement(translation=(0, 6, 0))),
        Body(mesh, symbolic(3.0), placement=Placement(translation=(0, 8, 0))),
        Body(mesh, symbolic(7.0), placement=Placement(translation=(0, 10, 0))),
        Body(mesh, symbolic(3.0), placement=Placement(translation=(0, 12, 0))),
    ]


@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_a_system_of_several_is_the_sum_of_its_parts(bodies, mass):
    together, alone = system(*bodies, mass=mass, obstacles=(GROUND,)), [system(body, mass=mass) for body in bodies]
    for name in ("mass", "stiffness", "spring", "viscous_spring"):
        parts = np.concatenate([*(getattr(s, name) for s in alone), np.zeros(3)])
        np.testing.assert_allclose(getattr(together, name), parts, rtol=1e-14)
    assert together.energy_scale == pytest.approx(sum(s.energy_scale for s in alone), rel=1e-13)
    np.testing.assert_array_equal(together.rest, np.concatenate([*(s.rest for s in alone), GROUND.vertices]))


def test_energies_gradients_and_hessians_are_those_of_the_parts(bodies):
    together, alone = system(*bodies, obstacles=(GROUND,)), [system(body) for body in bodies]
    x = together.rest + 0.02 * RNG.normal(size=together.rest.shape)
    found, expected = np.zeros_like(x), np.zeros_like(x)
    energy = sum(p.add_value_gradient(x, 1.0, found) for p in together.potentials)
    blocks = np.zeros((x.size, x.size))
    energy_of_parts, begin = 0.0, 0
    for s in alone:
        rows = slice(begin, begin + s.nodes)
        own, gradient = np.ascontiguousarray(x[rows]), np.zeros((s.nodes, 3))
        energy_of_parts += sum(p.add_value_gradient(own, 1.0, gradient) for p in s.potentials)
        expected[rows] = gradient
        blocks[3 * begin : 3 * (begin + s.nodes), 3 * begin : 3 * (begin + s.nodes)] = hessian(s, own)
        begin += s.nodes
    assert energy == pytest.approx(energy_of_parts, rel=1e-12)
    np.testing.assert_allclose(found, expected, atol=1e-12 * np.abs(expected).max())
    np.testing.assert_allclose(hessian(together, x), blocks, atol=1e-12 * np.abs(blocks).max())


def hessian(s: System, x: np.ndarray) -> np.ndarray:
    matrix = _native.BlockMatrix(s.pattern)
    for potential in s.potentials:
        potential.add_hessian(x, 1.0, True, matrix)
    return dense(matrix, s.pattern)


def test_the_elastic_energy_of_several_models_is_their_sum(bodies):
    together = system(*bodies)
    x = together.rest + 0.02 * RNG.normal(size=together.rest.shape)
    gradient = np.zeros_like(x)
    parts = together.potentials[:4]
    assert together.elastic.value(x) == pytest.approx(sum(p.value(x) for p in parts), rel=1e-13)  # type: ignore[attr-defined]
    assert together.elastic.add_value_gradient(x, 2.0, gradient) == pytest.approx(2 * together.elastic.value(x))


def test_bodies_of_one_model_share_an_energy(bodies):
    # neo-Hookean, Mooney-Rivlin and two different programs; three families of fibres.
    assert len(system(*bodies).potentials) == 4 + 3
    assert len(system(bodies[4], bodies[6]).potentials) == 1
    one = system(bodies[0])
    assert one.potentials == [one.elastic]


def test_fibres_act_on_their_own_body_alone():
    mesh = small_bar()
    near = Body(mesh, StableNeoHookean(), fibres=[Fibres(modulus=1e5)])
    far = Body(mesh, StableNeoHookean(), placement=Placement(translation=(0, 3, 0)))
    s = system(near, far)
    x = s.rest * [1.3, 1, 1]
    gradient = np.zeros_like(x)
    s.potentials[-1].add_value_gradient(x, 1.0, gradient)
    assert np.abs(gradient[:16]).max() > 1
    np.testing.assert_array_equal(gradient[16:], 0.0)


def test_groups_faces_and_planes():
    mesh = small_bar()
    second = Obstacle(GROUND.vertices - (0, 1, 0), GROUND.triangles)
    plane = Plane((0, -5, 0), (0, 1, 0))
    other = Body(mesh, StableNeoHookean(), placement=Placement(translation=(0, 3, 0)))
    s = system(Body(mesh, StableNeoHookean()), other, obstacles=(GROUND, plane, second))
    n = len(mesh.positions)
    assert s.nodes == 2 * n + 6
    assert s.groups.dtype == np.int32
    np.testing.assert_array_equal(s.groups, np.repeat([0, 1, 2, 3], [n, n, 3, 3]))
    own = mesh.boundary_triangles()
    expected = np.concatenate([own, own + n, [[2 * n, 2 * n + 1, 2 * n + 2]], [[2 * n + 3, 2 * n + 4, 2 * n + 5]]])
    np.testing.assert_array_equal(s.surface_faces, expected)
    assert s.surface_faces.dtype == np.int32
    assert s.planes == (plane,)


def test_loose_nodes_change_no_bit_of_the_energies_of_bodies():
    mesh = TetMesh.box(cells=(6, 3, 3))
    far = Obstacle(GROUND.vertices * 1e3, GROUND.triangles)
    alone, among = system(Body(mesh, StableNeoHookean())), system(Body(mesh, StableNeoHookean()), obstacles=(far,))
    x = mesh.positions + 0.01 * RNG.normal(size=mesh.positions.shape)
    padded = np.concatenate([x, far.vertices])
    gradient, padded_gradient = np.zeros_like(x), np.zeros_like(padded)
    value = alone.elastic.add_value_gradient(x, 1.0, gradient)
    assert among.elastic.add_value_gradient(padded, 1.0, padded_gradient) == value
    np.testing.assert_array_equal(padded_gradient, np.concatenate([gradient, np.zeros((3, 3))]))


def test_a_node_without_tets_has_the_identity_for_a_map_and_changes_no_other():
    mesh = small_bar()
    alone, among = system(Body(mesh, StableNeoHookean())), system(Body(mesh, StableNeoHookean()), obstacles=(GROUND,))
    x = mesh.positions @ np.diag([1.2, 0.9, 1.1]) + 0.01 * RNG.normal(size=mesh.positions.shape)
    maps, padded = np.empty((16, 3, 3)), np.empty((19, 3, 3))
    alone.geometry.nodal_maps(x, mesh.positions, 0.3, maps)
    among.geometry.nodal_maps(np.concatenate([x, GROUND.vertices]), among.rest, 0.3, padded)
    np.testing.assert_array_equal(padded[:16], maps)
    np.testing.assert_allclose(padded[16:], np.broadcast_to(np.eye(3), (3, 3, 3)), atol=1e-15)


def test_a_union_has_regions_where_all_bodies_have_them():
    plain, marked = small_bar(), with_regions(small_bar())
    np.testing.assert_array_equal(TetMesh.union([marked, marked]).regions, np.tile(marked.regions, 2))
    assert TetMesh.union([marked, plain]).regions is None
    assert TetMesh.union([plain]) is plain


def test_parameters_that_do_not_fit_name_the_body():
    mesh = small_bar()
    good = Body(mesh, StableNeoHookean())
    bad = Body(mesh, StableNeoHookean(young=np.full(5, 1e4)), name="soft one")
    with pytest.raises(InputError, match=r"^body 'soft one': material young has shape \(5,\)"):
        system(good, bad)
    nameless = Body(mesh, StableNeoHookean(young={4: 1e4}))
    with pytest.raises(InputError, match=r"^body 1: material young: .* this mesh has none"):
        system(good, nameless)
    with pytest.raises(InputError, match=r"^material young has shape \(5,\)"):
        system(bad)
    fibred = Body(mesh, StableNeoHookean(), fibres=[Fibres(direction=(0, 0, 0))])
    with pytest.raises(InputError, match=r"^body 1: fibre direction of element 0"):
        system(good, fibred)


def test_bodies_and_obstacles_are_found_by_themselves_their_names_and_numbers():
    mesh = small_bar()
    first, second = Body(mesh, StableNeoHookean(), name="a"), Body(mesh, StableNeoHookean())
    whole = Assembly([first, second], [GROUND])
    for which, expected in (
        (first, np.arange(16)),
        ("a", np.arange(16)),
        (0, np.arange(16)),
        (second, np.arange(16, 32)),
        (np.int64(1), np.arange(16, 32)),
        (GROUND, np.arange(32, 35)),
        ("ground", np.arange(32, 35)),
        (2, np.arange(32, 35)),
    ):
        nodes = whole.nodes_of(which)  # type: ignore[arg-type]
        np.testing.assert_array_equal(nodes, expected)
        assert nodes.dtype == np.int32
    for which, message in (
        (3, r"group 3 is out of range: must be in \[0, 2\]"),
        (-1, r"group -1 is out of range"),
        ("b", "no body or obstacle has the name 'b': 'a', 'ground'"),
        ("", "no body or obstacle has the name ''"),
        (Body(mesh, StableNeoHookean()), "Body is not among the bodies"),
        (True, "bool is not among"),
    ):
        with pytest.raises(InputError, match=message):
            whole.nodes_of(which)  # type: ignore[arg-type]


def test_wrong_members_are_refused():
    body = Body(small_bar(), StableNeoHookean(), name="ground")
    for bodies, obstacles, message in (
        ([], [], "a simulation needs a body, and none is given"),
        ([small_bar()], [], "number 0 of the bodies is a TetMesh, must be Body"),
        (3, [], "bodies = int must be a sequence of Body"),
        ([body], [body], "number 0 of the obstacles is a Body, must be Obstacle or Plane"),
        ([body], GROUND, "obstacles = Obstacle must be a sequence of Obstacle or Plane"),
        ([body, body], [], "a body or obstacle is given more than once"),
        ([body], [GROUND], "the name 'ground' is given to more than one body or obstacle"),
    ):
        with pytest.raises(InputError, match=message):
            Assembly(bodies, obstacles)  # type: ignore[arg-type]
