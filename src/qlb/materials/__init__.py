"""Hyperelastic materials. Each is one class here and one header in native/materials."""

from qlb.materials.material import IsotropicMaterial, Material
from qlb.materials.stable_neo_hookean import StableNeoHookean

MATERIALS: dict[str, type[IsotropicMaterial]] = {"SNH": StableNeoHookean}
"""Every material by the name that scene files use."""

AnyMaterial = StableNeoHookean
"""The union of all materials, told apart by `model`."""

__all__ = ["MATERIALS", "AnyMaterial", "IsotropicMaterial", "Material", "StableNeoHookean"]
