from __future__ import annotations

import numpy as np
import pytest

from qlb import _native
from qlb.materials import MATERIALS, IsotropicMaterial
from tests.materials.deformations import KINDS
from tests.support import Array

YOUNG = 2e4


@pytest.fixture(params=MATERIALS.values(), ids=MATERIALS)
def material_class(request: pytest.FixtureRequest) -> type[IsotropicMaterial]:
    return request.param


@pytest.fixture(params=[-0.3, 0.0, 0.3, 0.49], ids=lambda nu: f"nu={nu}")
def material(material_class: type[IsotropicMaterial], request: pytest.FixtureRequest) -> IsotropicMaterial:
    return material_class(young=YOUNG, poisson=request.param)


@pytest.fixture(params=_native.simd_levels())
def level(request: pytest.FixtureRequest) -> str:
    return request.param


@pytest.fixture(name="F", params=KINDS.values(), ids=KINDS)
def deformation_gradients(request: pytest.FixtureRequest, rng: np.random.Generator) -> Array:
    return request.param(rng)
