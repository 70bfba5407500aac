"""What every material has: its parameters with units and ranges, and its energy density at given F."""

from __future__ import annotations

from abc import abstractmethod
from typing import ClassVar, Literal, Self, TypeAlias

import numpy as np
import numpy.typing as npt

from qlb import _native
from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.fields import Varying
from qlb.mesh.tet_mesh import TetMesh
from qlb.settings import PerElement, Settings, on_mesh, quantity, require_numbers

Domain: TypeAlias = Literal["everywhere", "det F > 0", "unique R"]
"""Everywhere; or where no element is inverted; or where the rotation nearest to F is unique."""


class Material(Settings):
    """A hyperelastic solid: an energy density psi(F) [Pa] and a mass density.

    Any parameter may be one number, or vary in space: an array with one value per element, a table by region, an
    expression or a function of the rest position (see `PerElement`). What varies has its values on a mesh: `on`.
    """

    domain: ClassVar[Domain] = "everywhere"
    """Where psi and its derivatives are defined. Tests take deformation gradients from there, the docs say it."""

    objective: ClassVar[bool] = True
    """Whether psi(R F) = psi(F) for each rotation R."""

    model: str
    """Short name, as in scene files."""

    density: PerElement = quantity(1000.0, "Mass density", unit="kg/m^3", gt=0)

    @property
    def kernels(self) -> str:
        """Name of the compiled kernels."""
        return self.model

    def program(self) -> _native.Program | None:
        """What the kernels run, for a material whose density is not compiled."""
        return None

    def program_key(self) -> object:
        """Equal for two materials with the same `kernels` if their programs do the same."""
        return None

    @abstractmethod
    def kernel_parameters(self) -> tuple[PerElement, ...]:
        """The constants that the compiled kernels take, in their order."""

    @abstractmethod
    def modulus(self) -> PerElement:
        """A stiffness [Pa] that stands for the material where a scale is needed, such as Young's modulus."""

    def wave_modulus(self) -> PerElement:
        """The stiffness of small strains without sideways motion [Pa], the largest of the material: lambda + 2 mu."""
        return self.modulus()

    def on(self, mesh: TetMesh) -> Self:
        """The same material with each parameter a number or an array (m,), for the m elements of `mesh`.

        Raises:
            InputError: a parameter that does not fit the mesh or is out of range; the element or region is named.
        """
        return on_mesh(self, "material", mesh)

    def stiffened(self, factor: FloatArray) -> Self:
        """The same material, `factor` times as stiff in each element (m,), after `on`: all that is in Pa times it."""
        units = {name: field.json_schema_extra for name, field in type(self).model_fields.items()}
        stiff = [name for name, extra in units.items() if isinstance(extra, dict) and extra.get("unit") == "Pa"]
        return self.model_copy(update={name: factor * getattr(self, name) for name in stiff})

    def parameter_table(self, elements: int) -> FloatArray:
        """`kernel_parameters` for each element, shape (elements, count).

        Raises:
            InputError: a parameter array whose length is not `elements`; a table, an expression or a function, which
                have their values only on a mesh.
        """
        require_numbers(self, "material")
        columns = [per_element(self, value, elements) for value in self.kernel_parameters()]
        return np.ascontiguousarray(np.reshape(columns, (len(columns), elements)).T)

    def evaluate(
        self, F: npt.ArrayLike, *, project: bool = False, simd_level: str = ""
    ) -> tuple[FloatArray, FloatArray, FloatArray]:
        """Energy density and its derivatives at deformation gradients.

        Args:
            F: deformation gradients, shape (k, 3, 3).
            project: give the nearest positive semidefinite second derivative instead of the exact one.
            simd_level: which compiled level to use; empty for the best of this machine.

        Raises:
            InputError: as `parameter_table`.

        Returns:
            psi [Pa], shape (k,); first Piola-Kirchhoff stress dpsi/dF [Pa], shape (k, 3, 3); d2psi/dF2 [Pa], shape
            (k, 9, 9), with F flattened row by row.
        """
        F = np.ascontiguousarray(F, dtype=np.float64).reshape(-1, 3, 3)
        count = len(F)
        psi, P, C = np.empty(count), np.empty((count, 3, 3)), np.empty((count, 9, 9))
        table = self.parameter_table(count)
        _native.evaluate_density(self.kernels, F, table, project, psi, P, C, simd_level, self.program())
        return psi, P, C


class IsotropicMaterial(Material):
    """An isotropic material given by Young's modulus and Poisson's ratio of small strains."""

    young: PerElement = quantity(2e4, "Young's modulus", unit="Pa", gt=0)
    poisson: PerElement = quantity(0.49, "Poisson's ratio", gt=-1, lt=0.5)

    def modulus(self) -> PerElement:
        """Young's modulus [Pa]."""
        return self.young

    def wave_modulus(self) -> PerElement:
        """lambda + 2 mu [Pa]."""
        mu, lam = self.lame()
        return lam + 2 * mu

    def lame(self) -> tuple[PerElement, PerElement]:
        """Lame's constants (mu, lambda) [Pa] of linear elasticity."""
        mu = self.young / (2 * (1 + self.poisson))
        return mu, self.young * self.poisson / ((1 + self.poisson) * (1 - 2 * self.poisson))

    def kernel_parameters(self) -> tuple[PerElement, ...]:
        """mu and lambda, unless a material says otherwise."""
        return self.lame()


def per_element(material: Material, value: PerElement, elements: int) -> FloatArray:
    """`value` as an array over `elements`. Raises `InputError` where an array has another length."""
    if isinstance(value, Varying):
        raise InputError(f"a parameter of material {material.model} is {value}: see material.on(mesh)")
    if np.ndim(value) and np.shape(value) != (elements,):
        raise InputError(
            f"a parameter of material {material.model} has shape {np.shape(value)}, must be one number or ({elements},)"
        )
    return np.ascontiguousarray(np.broadcast_to(np.asarray(value, dtype=np.float64), (elements,)))
