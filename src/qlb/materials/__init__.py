"""Hyperelastic materials. Each is one class here and one header in native/materials."""

from typing import Annotated, get_args

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


def _model_of(value: object) -> str:
    """The model that settings name, from a file or an object; SNH where they name none."""
    return str(value.get("model", "SNH") if isinstance(value, dict) else getattr(value, "model", None))


AnyMaterial = Annotated[
    Annotated[StableNeoHookean, Tag("SNH")]
    | Annotated[StVenantKirchhoff, Tag("StVK")]
    | Annotated[CompressibleNeoHookean, Tag("CNH")]
    | Annotated[FixedCorotational, Tag("corotational")]
    | Annotated[Arap, Tag("ARAP")]
    | Annotated[MooneyRivlin, Tag("MR")]
    | Annotated[LinearElastic, Tag("linear")],
    Discriminator(_model_of),
]
"""Any material of a scene file, told apart by `model`: the one list of them."""

MATERIALS: dict[str, type[Material]] = {
    tag.tag: material for material, tag in map(get_args, get_args(get_args(AnyMaterial)[0]))
}
"""Every material by the name that scene files use."""

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
