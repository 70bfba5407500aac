"""A density of one's own, written as a SymPy expression."""

from __future__ import annotations

from collections.abc import Mapping
from types import ModuleType
from typing import TYPE_CHECKING, Any, ClassVar, Literal, Self

import numpy as np
from pydantic import Field, PrivateAttr

from qlb import _native
from qlb.arrays import FloatArray
from qlb.errors import InputError, MissingExtra
from qlb.fields import Varying
from qlb.materials.material import Material
from qlb.mesh.tet_mesh import TetMesh
from qlb.settings import PerElement, element_values, within

if TYPE_CHECKING:
    from qlb.materials.symbolic_density import Density
    from qlb.materials.symbolic_program import OperationList

STRESS_FREE = 1e-9
"""Largest stress at rest, relative to lambda + 2 mu."""


class _InvariantSymbols:
    """The symbols I1, I2 and J, as an attribute of a class: SymPy is imported where they are asked for."""

    def __get__(self, instance: object, owner: type) -> tuple[Any, Any, Any]:
        symbols: tuple[Any, Any, Any] = _density_module().INVARIANTS
        return symbols


class SymbolicMaterial(Material):
    """An isotropic material whose density is a SymPy expression of I1 = tr C, I2 = |cof F|^2 and J = det F.

        I1, I2, J = SymbolicMaterial.invariants
        mu, kappa = sympy.symbols("mu kappa", positive=True)
        psi = mu / 2 * (I1 * J ** sympy.Rational(-2, 3) - 3) + kappa / 2 * (J - 1) ** 2
        SymbolicMaterial(psi=psi, parameters={"mu": 1e4, "kappa": 1e5})

    Its derivatives are taken by SymPy; the element kernels run psi and them as lists of SIMD operations, without a
    compiler. psi may be made of + - * / ** with any exponent, sqrt, exp, log, sin, cos, tan, sinh, cosh, tanh, atan,
    Abs, sign, Min and Max. It is not defined (NaN) where a log, a root or a power whose exponent is no integer has an
    argument < 0. Its value at rest is taken off.

    Needs SymPy (`pip install "qlb[symbolic]"`); for scripts only, as a scene file could run code in an expression.

    Raises:
        InputError: psi has something else, or a symbol that is neither an invariant nor a parameter; a parameter is not
            used or out of the range that its symbol's assumptions mean; the rest state is not stress free to 1e-9 of
            lambda + 2 mu, or has no mu > 0 and lambda + 2/3 mu > 0; psi takes more operations than there is room for.
        MissingExtra: SymPy is not installed.
    """

    invariants: ClassVar[_InvariantSymbols] = _InvariantSymbols()
    """The symbols I1, I2 and J; others with these names mean the same."""

    model: Literal["symbolic"] = "symbolic"
    psi: Any = Field(description="Energy density [Pa], a SymPy expression of I1, I2, J and the parameters")
    parameters: dict[str, PerElement] = Field({}, description="Value of each parameter, which may vary in space")

    _density: Density = PrivateAttr()
    _lists: tuple[OperationList, OperationList, OperationList] = PrivateAttr()

    def __init__(self, **values: Any) -> None:
        if "psi" not in values:
            super().__init__(**values)  # raises
        given = values.get("parameters", {})
        if not isinstance(given, Mapping):
            raise InputError(f"parameters = {given!r} must be a dict of names and values")
        density = _density_module().parse_density(values["psi"], tuple(given))
        parameters = {s.name: _checked_parameter(s, given[s.name]) for s in density.parameters}
        super().__init__(**(values | {"parameters": parameters}))
        self._density = density
        self._lists = _program_module().compile_density(density)
        self._require_rest()

    @property
    def kernels(self) -> str:
        """Name of the compiled kernels."""
        return "symbolic-I2" if self._density.uses_second_invariant else "symbolic"

    def program(self) -> _native.Program:
        """psi and its derivatives as lists of operations."""
        return _native.Program(len(self.parameters), *self._lists)

    def program_key(self) -> object:
        """The number of parameters and all bytes of the lists."""
        return len(self.parameters), *(np.asarray(part).tobytes() for parts in self._lists for part in parts)

    def kernel_parameters(self) -> tuple[PerElement, ...]:
        """The parameters, in the order in which they were given."""
        return tuple(self.parameters.values())

    def modulus(self) -> PerElement:
        """Young's modulus of small strains [Pa]."""
        _, mu, lam = self._rest()
        return _plain(mu * (3 * lam + 2 * mu) / (lam + mu))

    def wave_modulus(self) -> PerElement:
        """lambda + 2 mu of small strains [Pa]."""
        _, mu, lam = self._rest()
        return _plain(lam + 2 * mu)

    def on(self, mesh: TetMesh) -> Self:
        """As `Material.on`; the rest state is checked in every element."""
        values = dict(self.parameters)
        for symbol in self._density.parameters:
            value = values[symbol.name]
            if isinstance(value, np.ndarray | Varying):
                bounds = _density_module().bounds_of(symbol)
                values[symbol.name] = element_values(f"material parameter {symbol.name}", value, bounds, "", mesh)
        moved = super().on(mesh).model_copy(update={"parameters": values})
        moved._require_rest()
        return moved

    def _rest(self) -> tuple[FloatArray, FloatArray, FloatArray]:
        """P_00 = P_11 = P_22, mu and lambda [Pa] at rest, each of shape () or (m,)."""
        for name, value in self.parameters.items():
            if isinstance(value, Varying):
                raise InputError(f"material parameter {name} is {value}: it has its values only on a mesh")
        values: Any = self.parameters.values()
        return self._density.at_rest(values)

    def _require_rest(self) -> None:
        """Raise `InputError` for a rest state that is known, and is not one."""
        values: list[Any] = list(self.parameters.values())
        shapes = {np.shape(value) for value in values} - {()}
        if len(shapes) > 1 or any(isinstance(value, Varying) for value in values):
            return  # `parameter_table` and `on` go on from here
        stress, mu, lam = self._rest()
        scale = np.abs(lam) + 2 * np.abs(mu)
        for what, value, good, allowed in (
            ("stress", stress, np.abs(stress) <= STRESS_FREE * scale, "0 Pa, to 1e-9 of lambda + 2 mu"),
            ("shear modulus mu", mu, (mu > 0) & (mu < np.inf), "> 0 Pa and finite"),
            ("bulk modulus lambda + 2/3 mu", lam + 2 / 3 * mu, (3 * lam + 2 * mu > 0) & (lam < np.inf), "> 0 Pa"),
        ):
            if not np.all(good):
                e = int(np.argmin(good))
                where = f" of element {e}" if np.ndim(value) else ""
                raise InputError(f"the {what} of psi at rest{where} = {np.ravel(value)[e]:g} Pa, must be {allowed}")


def _checked_parameter(symbol: Any, value: Any) -> Any:
    try:
        return within(value, _density_module().bounds_of(symbol))
    except ValueError as error:
        raise InputError(f"parameter {symbol.name}: {error}") from None


def _plain(value: FloatArray) -> PerElement:
    return value if value.ndim else float(value)


def _density_module() -> ModuleType:
    try:
        from qlb.materials import symbolic_density
    except ImportError as error:
        raise MissingExtra(f'a SymbolicMaterial needs SymPy: pip install "qlb[symbolic]" ({error})') from None
    return symbolic_density


def _program_module() -> ModuleType:
    from qlb.materials import symbolic_program

    return symbolic_program
