"""Hyperelastic materials. Each is one class here and one header in native/materials."""

from typing import TYPE_CHECKING, Annotated, TypeAlias, Union

from pydantic import Discriminator, Tag

from qlb.materials.compressible_neo_hookean import CompressibleNeoHookean
from qlb.materials.corotational import Arap, FixedCorotational
from qlb.materials.fibres import Fibres
from qlb.materials.linear_elastic import LinearElastic
from qlb.materials.material import IsotropicMaterial, Material
from qlb.materials.mooney_rivlin import MooneyRivlin
from qlb.materials.st_venant_kirchhoff import StVenantKirchhoff
from qlb.materials.stable_neo_hookean import StableNeoHookean
from qlb.materials.symbolic import SymbolicMaterial
from qlb.registry import found_in


def _model_of(value: object) -> str:
    """The model that settings name, from a file or an object; SNH where they name none."""
    return str(value.get("model", "SNH") if isinstance(value, dict) else getattr(value, "model", None))


def _name_of(kind: type[Material]) -> str | None:
    default = kind.model_fields["model"].default
    return default if isinstance(default, str) else None


MATERIALS: dict[str, type[Material]] = found_in(
    __name__,
    Material,  # type: ignore[type-abstract]
    _name_of,
    first=("SNH", "StVK", "CNH", "corotational", "ARAP", "MR", "linear"),
    skip="symbolic*",
)
"""Every material by the name that scene files use. Densities of one's own are for scripts alone."""

if TYPE_CHECKING:
    AnyMaterial: TypeAlias = Material
else:
    AnyMaterial = Annotated[
        Union[tuple(Annotated[kind, Tag(name)] for name, kind in MATERIALS.items())],  # noqa: UP007
        Discriminator(_model_of),
    ]
"""Any material of a scene file, told apart by `model`."""

__all__ = [
    "MATERIALS",
    "AnyMaterial",
    "Arap",
    "CompressibleNeoHookean",
    "Fibres",
    "FixedCorotational",
    "IsotropicMaterial",
    "LinearElastic",
    "Material",
    "MooneyRivlin",
    "StVenantKirchhoff",
    "StableNeoHookean",
    "SymbolicMaterial",
]
