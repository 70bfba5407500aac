"""Densities of one's own: held against the built-in materials, finite differences and SymPy's own numbers."""

from __future__ import annotations

import pickle
import subprocess
import sys

import numpy as np
import pytest
import sympy

from qlb import InputError, Simulation, SymbolicMaterial, TetMesh, _native
from qlb.materials import MATERIALS, Material
from tests.materials.deformations import KINDS, PROJECTION_ACCURACY, UPRIGHT, kinds_for
from tests.materials.symbolic_examples import (
    BUILT_IN,
    GENT,
    I1,
    I2,
    OTHERS,
    THIRD,
    J,
    Jm,
    kappa,
    lam,
    mu,
    rewritten,
)
from tests.support import TIGHT, Array, difference, left_end, small_bar

LEVELS = _native.simd_levels()
GENT_VALUES = OTHERS["Gent"][1]
SNH = BUILT_IN["SNH"][0]
SNH_VALUES = {"mu": 1e4, "lam": 3e4}


def invariants_of(F: Array) -> tuple[Array, Array, Array]:
    C = F.transpose(0, 2, 1) @ F
    first = np.trace(C, axis1=1, axis2=2)
    return first, 0.5 * (first**2 - np.trace(C @ C, axis1=1, axis2=2)), np.linalg.det(F)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize(("name", "kind"), [(name, kind) for name in BUILT_IN for kind in kinds_for(name)])
def test_it_is_the_built_in_material(name: str, kind: str, level: str, rng: np.random.Generator) -> None:
    built_in = MATERIALS[name](young=2e4, poisson=0.45)
    material, F = rewritten(built_in), KINDS[kind](rng)
    for project in (False, True):
        results = material.evaluate(F, project=project, simd_level=level)
        accuracy = PROJECTION_ACCURACY.get(kind, 1e-12) if project else 1e-12
        for result, expected in zip(results, built_in.evaluate(F, project=project, simd_level=level), strict=True):
            np.testing.assert_allclose(result, expected, rtol=0, atol=accuracy * (np.abs(expected).max() + 2e4))


@pytest.mark.parametrize("name", BUILT_IN)
def test_its_moduli_are_those_of_the_built_in_material(name: str) -> None:
    built_in = MATERIALS[name](young=np.array([1e4, 2e4]), poisson=0.4)
    material = rewritten(built_in)
    np.testing.assert_allclose(material.modulus(), built_in.modulus(), rtol=1e-13)
    np.testing.assert_allclose(material.wave_modulus(), built_in.wave_modulus(), rtol=1e-13)


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("kind", UPRIGHT)
@pytest.mark.parametrize("name", OTHERS)
def test_derivatives(name: str, kind: str, level: str, rng: np.random.Generator) -> None:
    psi, values = OTHERS[name]
    material, F = SymbolicMaterial(psi=psi, parameters=values), KINDS[kind](rng)
    units = np.eye(9).reshape(9, 3, 3)
    _, P, C = material.evaluate(F, simd_level=level)
    dpsi = [difference(lambda G: material.evaluate(G, simd_level=level)[0], F, u, 3e-4) for u in units]
    dP = [difference(lambda G: material.evaluate(G, simd_level=level)[1], F, u, 3e-4).reshape(-1, 9) for u in units]
    scale = float(material.modulus())  # type: ignore[arg-type]
    np.testing.assert_allclose(np.stack(dpsi, 1), P.reshape(-1, 9), rtol=0, atol=1e-6 * (np.abs(P).max() + scale))
    np.testing.assert_allclose(np.stack(dP, 2), C, rtol=0, atol=1e-6 * (np.abs(C).max() + scale))


FUNCTIONS = [
    *(getattr(sympy, f) for f in ("exp", "log", "sin", "cos", "tan", "sinh", "cosh", "tanh", "atan", "sqrt")),
    lambda x: x**-3,
    lambda x: x**7,
    lambda x: x ** sympy.Rational(-5, 2),
    lambda x: x ** (2 * THIRD),
    lambda x: x ** (-5 / 3),
    lambda x: x**1.234,
    lambda x: x**x,
    lambda x: 2**x,
    lambda x: sympy.pi * x / (1 + x * I2),
    lambda x: sympy.Abs(sympy.log(x) - sympy.Rational(1, 9)) * (x - 1),
    lambda x: sympy.Max(x, x**2, 2 - x),
    lambda x: sympy.Min(x, x**2 / 2),
]


@pytest.mark.parametrize("level", LEVELS)
@pytest.mark.parametrize("case", range(len(FUNCTIONS)))
def test_every_function_is_that_of_sympy(case: int, level: str, rng: np.random.Generator) -> None:
    x = (I1 + J) / 4  # 1 at rest
    change = FUNCTIONS[case](x) - FUNCTIONS[case](sympy.Integer(1))
    psi = SNH + mu * change**2 / 9  # change is zero at rest, so its square is stress free
    if case == len(FUNCTIONS) - 4:
        psi = psi.subs(I2, 3)
    material = SymbolicMaterial(psi=psi, parameters=SNH_VALUES)
    F = np.eye(3) + 0.1 * rng.normal(size=(33, 3, 3))
    expected = sympy.lambdify([I1, I2, J, mu, lam], psi, "numpy")
    values = expected(*invariants_of(F), *SNH_VALUES.values()) - expected(3.0, 3.0, 1.0, *SNH_VALUES.values())
    np.testing.assert_allclose(material.evaluate(F, simd_level=level)[0], values, rtol=1e-12, atol=1e-11 * 1e4)


@pytest.mark.parametrize("level", LEVELS)
def test_it_is_not_a_number_where_it_is_not_defined(level: str) -> None:
    turned = np.diag([1.0, 1.0, -1.2])[None]
    for psi in (
        GENT,
        mu * (I1 - 3 - 2 * sympy.log(J)) + kappa * (J - 1) ** 2 / Jm,
        mu * (I1 - 4 * J**1.5 + 2 * J**2) + (kappa + Jm) * (J - 1) ** 2,
        mu * (I1 - 4 * sympy.sqrt(J)) + (kappa + Jm) * (J - 1) ** 2,
        mu * (I1 - 3 * J ** (2 * THIRD)) + (kappa + Jm) * (J - 1) ** 2,
    ):
        assert np.isnan(SymbolicMaterial(psi=psi, parameters=GENT_VALUES).evaluate(turned, simd_level=level)[0]).all()
    stretched = np.diag([6.0, 0.5, 1 / 3])[None]  # I1 - 3 > Jm: the chains of Gent's rubber end there
    assert np.isnan(SymbolicMaterial(psi=GENT, parameters=GENT_VALUES).evaluate(stretched, simd_level=level)[0]).all()


def test_symbols_go_by_their_names() -> None:
    a, b, c, m, k, limit = sympy.symbols("I1 I2 J mu kappa Jm")
    other = GENT.subs({I1: a, J: c, mu: m, kappa: k, Jm: limit}) + 0 * b
    F = np.diag([1.1, 0.9, 1.2])[None]
    for result, expected in zip(
        SymbolicMaterial(psi=other, parameters=GENT_VALUES).evaluate(F),
        SymbolicMaterial(psi=GENT, parameters=GENT_VALUES).evaluate(F),
        strict=True,
    ):
        np.testing.assert_allclose(result, expected, rtol=1e-13)


@pytest.mark.parametrize("solver", ["ND", "QLB"])
def test_a_bar_falls_as_one_of_the_built_in_material(solver: str) -> None:
    mesh = small_bar((6, 2, 2))
    built_in = MATERIALS["SNH"](young=2e4, poisson=0.45, density=900.0)

    def last(material: Material) -> Array:
        simulation = Simulation(mesh, material=material, solver=solver, tolerance=TIGHT, threads=1)
        simulation.pin(left_end(mesh))
        return list(simulation.run(10))[-1].positions

    expected = last(built_in)
    assert np.abs(expected - mesh.positions).max() > 0.01
    np.testing.assert_allclose(last(rewritten(built_in)), expected, rtol=0, atol=1e-9)


@pytest.mark.parametrize("solver", ["ND", "QLB"])
def test_a_bar_of_gent_s_rubber_converges(solver: str) -> None:
    mesh = small_bar()
    material = SymbolicMaterial(
        psi=GENT, parameters=GENT_VALUES | {"kappa": "5e4 * (1 + x)", "Jm": {0: 5, "default": 9}}
    )
    mesh = TetMesh(mesh.positions, mesh.tets, regions=np.arange(len(mesh.tets)) % 3)
    simulation = Simulation(mesh, material=material, solver=solver, threads=1)
    simulation.pin(left_end(mesh))
    for result in simulation.run(5):
        assert result.converged


def test_parameters_vary_in_space(rng: np.random.Generator) -> None:
    mesh = TetMesh.box((1, 0.25, 0.25), cells=(4, 1, 1))
    x = mesh.centroids()[:, 0]
    given = {"mu": "1e4 * (1 + x)", "lam": lambda c: 3e4 + c[:, 0]}
    material = SymbolicMaterial(psi=SNH, parameters=given, density="900 + x")
    with pytest.raises(InputError, match=r"material parameter mu is the expression .* only on a mesh"):
        material.modulus()
    with pytest.raises(InputError, match=r"on\(mesh\)"):
        material.parameter_table(24)
    there = material.on(mesh)
    np.testing.assert_array_equal(there.parameter_table(24), np.column_stack([1e4 * (1 + x), 3e4 + x]))
    np.testing.assert_array_equal(there.density, 900 + x)
    F = np.eye(3) + 0.1 * rng.normal(size=(24, 3, 3))
    P = there.evaluate(F)[1]
    for k in (0, 13, 23):
        alone = SymbolicMaterial(psi=SNH, parameters={"mu": 1e4 * (1 + x[k]), "lam": 3e4 + x[k]})
        np.testing.assert_allclose(P[k], alone.evaluate(F[k])[1][0], rtol=1e-12, atol=1e-9)


def test_it_needs_no_parameters() -> None:
    material = SymbolicMaterial(psi=100 * ((I1 - 3 - 2 * sympy.log(J)) + (J - 1) ** 2))
    assert material.wave_modulus() == pytest.approx(600)
    assert material.evaluate(np.eye(3))[0] == 0
    assert material.on(TetMesh.box(cells=(1, 1, 1))).parameter_table(6).shape == (6, 0)


def test_it_is_immutable_equal_where_written_the_same_and_can_be_stored() -> None:
    array = np.array([1e4, 2e4])
    material = SymbolicMaterial(psi=SNH, parameters={"mu": array, "lam": 3e4})
    array[0] = -1.0
    assert material == SymbolicMaterial(psi=SNH, parameters={"mu": [1e4, 2e4], "lam": 3e4})
    assert material != SymbolicMaterial(psi=SNH, parameters={"mu": 1e4, "lam": 3e4})
    assert material != rewritten(MATERIALS["CNH"]())
    again = pickle.loads(pickle.dumps(material))
    assert again == material
    np.testing.assert_array_equal(again.modulus(), material.modulus())


def x_of(name: str) -> sympy.Symbol:
    return sympy.Symbol(name)


@pytest.mark.parametrize(
    ("psi", "parameters", "message"),
    [
        ("mu * I1", {"mu": 1}, "psi = 'mu * I1' is of type str, must be a SymPy expression"),
        (3.0, {}, "psi = 3.0 is of type float, must be a SymPy expression"),
        (sympy.Eq(I1, J), {}, "psi = Eq(I1, J) is of type Equality, must be a SymPy expression"),
        (SNH, [1, 2], "parameters = [1, 2] must be a dict of names and values"),
        (SNH, {"mu": 1}, "psi has the symbol lam, must be of I1, I2, J, mu"),
        (SNH + x_of("kapa"), GENT_VALUES | SNH_VALUES, "psi has the symbol kapa, must be of I1, I2, J, mu, kappa, Jm,"
         " lam; did you mean kappa?"),
        (SNH, SNH_VALUES | {"nu": 1}, "parameter nu is not in psi = "),
        (SNH, SNH_VALUES | {"J": 1}, "parameter 'J' must have a name other than I1, I2 and J"),
        (SNH, SNH_VALUES | {3: 1}, "parameter 3 must have a name other than I1, I2 and J"),
        (SNH + sympy.gamma(J), SNH_VALUES, "psi has gamma, must be made of + - * / **, sqrt, exp, log, sin, "),
        (SNH + sympy.Function("f")(J), SNH_VALUES, "psi has f, must be made of + - * / **"),
        (SNH + sympy.Piecewise((J, J > 1), (1, True)), SNH_VALUES, "psi has Piecewise, must be"),
        (SNH + sympy.Derivative(sympy.log(J), J), SNH_VALUES, "psi has Derivative, must be"),
        (SNH + sympy.I * J, SNH_VALUES, "psi has the constant I: constants must be real and finite"),
        (SNH + J * sympy.log(-2), SNH_VALUES, "psi has the constant log(2) + I*pi: constants must be real and finite"),
        (SNH + J * (-1) ** THIRD, SNH_VALUES, "psi has the constant (-1)**(1/3): constants must be real"),
        (SNH + sympy.oo * J, SNH_VALUES, "psi has the constant oo: constants must be real and finite"),
        (SNH + sympy.zoo, SNH_VALUES, "psi has the constant zoo: constants"),
        (sympy.nan, {}, "psi has the constant nan: constants"),
        (SNH + J * 10**400, SNH_VALUES, "psi has the constant 1000000000"),
        (SNH + sympy.sqrt(I1 - 3), SNH_VALUES, " or a derivative is not finite at rest, I1 = I2 = 3, J = 1"),
        (SNH + sympy.log(J - 2), SNH_VALUES, " or a derivative is not finite at rest, I1 = I2 = 3, J = 1"),
        (SNH + J, SNH_VALUES, "the stress of psi at rest = 1 Pa, must be 0 Pa, to 1e-9 of lambda + 2 mu"),
        (mu * (I1 - 3), {"mu": [1, 2]}, "the stress of psi at rest of element 0 = 2 Pa, must be 0 Pa"),
        (sympy.Integer(3) * (J - 1) ** 2, {}, "the shear modulus mu of psi at rest = 0 Pa, must be > 0 Pa"),
        (x_of("a") * (I1 - 3 - 2 * sympy.log(J)) + 9 * (J - 1) ** 2, {"a": [1, -2]},
         "the shear modulus mu of psi at rest of element 1 = -4 Pa, must be > 0 Pa and finite"),
        (I1 - 3 - 2 * sympy.log(J) - x_of("a") * (J - 1) ** 2, {"a": 3},
         "the bulk modulus lambda + 2/3 mu of psi at rest = -4.66667 Pa, must be > 0 Pa"),
        (SNH, {"mu": -1, "lam": 3}, "parameter mu: -1 is out of range: must be > 0"),
        (SNH, {"mu": np.nan, "lam": 3}, "parameter mu: nan is out of range: must be > 0"),
        (SNH, {"mu": "soft", "lam": 3}, "parameter mu: 'soft' is not a number"),
        (SNH, {"mu": [1.0, -3.0], "lam": 3}, "parameter mu: -3 at index 1 is out of range: must be > 0"),
    ],
    ids=range(31),
)  # fmt: skip
def test_what_is_wrong_is_named(psi: object, parameters: object, message: str) -> None:
    with pytest.raises(InputError) as refusal:
        SymbolicMaterial(psi=psi, parameters=parameters)
    assert message in str(refusal.value)
    assert "\n" not in str(refusal.value)


def test_other_arguments_are_those_of_every_material() -> None:
    with pytest.raises(InputError, match=r"^psi is missing"):
        SymbolicMaterial(parameters={})
    with pytest.raises(InputError, match="unknown key 'densty'; did you mean 'density'"):
        SymbolicMaterial(psi=SNH, parameters=SNH_VALUES, densty=3)
    with pytest.raises(InputError, match="density: -1 is out of range: must be > 0 kg/m"):
        SymbolicMaterial(psi=SNH, parameters=SNH_VALUES, density=-1)


def test_what_is_wrong_on_a_mesh_is_named_with_its_element() -> None:
    mesh = TetMesh.box((1, 0.25, 0.25), cells=(4, 1, 1))
    e = int(np.argmax(mesh.centroids()[:, 0] > 0.8))
    for value in ("where(x > 0.8, -1, 5)", lambda c: np.where(c[:, 0] > 0.8, -1, 5)):
        with pytest.raises(
            InputError, match=rf"^material parameter mu of element {e} = -1 is out of range: must be > 0$"
        ):
            SymbolicMaterial(psi=SNH, parameters={"mu": value, "lam": 3}).on(mesh)
    with pytest.raises(InputError, match=r"material parameter mu has shape \(2,\), must be one number or \(24,\)"):
        SymbolicMaterial(psi=SNH, parameters={"mu": [1, 2], "lam": 3}).on(mesh)
    with pytest.raises(InputError, match=r"shape \(2,\), must be one number or \(3,\)"):
        SymbolicMaterial(psi=SNH, parameters={"mu": [1, 2], "lam": [1, 2, 3]}).parameter_table(3)
    a = sympy.Symbol("a")
    with pytest.raises(InputError, match=rf"shear modulus mu of psi at rest of element {e} = -2 Pa"):
        SymbolicMaterial(
            psi=a * (I1 - 3 - 2 * sympy.log(J)) + 9 * (J - 1) ** 2, parameters={"a": "where(x > 0.8, -1, 5)"}
        ).on(mesh)


def test_there_is_room_for_so_much(monkeypatch: pytest.MonkeyPatch) -> None:
    symbols = sympy.symbols("p0:130", positive=True)
    psi = SNH + sum(p * (J - 1) ** 2 for p in symbols)
    with pytest.raises(InputError, match=r"^psi takes \d+ registers with its derivatives, must be <= 128$"):
        SymbolicMaterial(psi=psi, parameters=SNH_VALUES | {p.name: 1.0 for p in symbols})
    monkeypatch.setattr(_native, "MAX_OPERATIONS", 10)
    with pytest.raises(InputError, match=r"^psi takes 17 operations with its derivatives, must be <= 10$"):
        SymbolicMaterial(psi=SNH, parameters=SNH_VALUES)


def test_many_terms_share_registers() -> None:
    terms = [(I1 / 3) ** k * J**k * (J - 1) ** 2 * (k + 0.5) for k in range(10)]
    material = SymbolicMaterial(psi=SNH + sum(terms) / 1000, parameters=SNH_VALUES)
    F = np.diag([1.01, 0.98, 1.02])[None]
    expected = sympy.lambdify([I1, I2, J, mu, lam], material.psi, "numpy")
    values = expected(*invariants_of(F), 1e4, 3e4) - expected(3.0, 3.0, 1.0, 1e4, 3e4)
    np.testing.assert_allclose(material.evaluate(F)[0], values, rtol=1e-9)


def native_program(
    operations: object = (0,), registers: object = ((3, 0, 1, 0),), constants: object = (), output: int = 3
) -> _native.Program:
    part = (
        np.array(operations, dtype=np.int32),
        np.array(registers, dtype=np.int32),
        np.array(constants, dtype=np.float64),
    )
    return _native.Program(0, *((*part, np.full(count, output, dtype=np.int32)) for count in (1, 4, 9)))


@pytest.mark.parametrize(
    ("wrong", "message"),
    [
        ({"registers": [[3, 0, 3, 0]]}, "register 3 is read but not set"),
        ({"registers": [[3, 0, -1, 0]]}, "register -1 is read but not set"),
        ({"registers": [[3, 0, 128, 0]]}, "register 128 is read but not set"),
        ({"registers": [[128, 0, 1, 0]]}, "there is no register 128"),
        ({"registers": [[-1, 0, 1, 0]]}, "there is no register -1"),
        ({"registers": [[3, 0, 1]]}, "shape"),
        ({"operations": [99]}, "operation 99 is not known"),
        ({"operations": [-1]}, "operation -1 is not known"),
        ({"constants": [np.inf]}, "not finite"),
        ({"constants": np.ones(126)}, "more than 128 registers"),
        ({"operations": [0] * 4097, "registers": [[3, 0, 1, 0]] * 4097}, "more than 4096 operations"),
        ({"output": 4}, "register 4 is read but not set"),
    ],
    ids=str,
)
def test_no_wrong_program_ever_runs(wrong: dict[str, object], message: str) -> None:
    native_program()
    with pytest.raises(ValueError, match=message):
        native_program(**wrong)  # type: ignore[arg-type]


def test_programs_and_materials_belong_together() -> None:
    outputs = np.empty(1), np.empty((1, 3, 3)), np.empty((1, 9, 9))
    with pytest.raises(ValueError, match="'symbolic' needs a program"):
        _native.evaluate_density("symbolic", np.eye(3)[None], np.ones((1, 2)), False, *outputs)
    with pytest.raises(ValueError, match="'SNH' takes no program"):
        _native.evaluate_density("SNH", np.eye(3)[None], np.ones((1, 2)), False, *outputs, "", native_program())


def test_sympy_is_imported_only_where_it_is_needed() -> None:
    code = (
        "import sys, qlb; assert 'sympy' not in sys.modules; sys.modules['sympy'] = None\n"
        "try: qlb.SymbolicMaterial.invariants\n"
        "except qlb.QlbError as error: print(error)\n"
    )
    done = subprocess.run([sys.executable, "-c", code], check=True, capture_output=True, text=True)
    assert done.stdout.startswith('a SymbolicMaterial needs SymPy: pip install "qlb[symbolic]"')
