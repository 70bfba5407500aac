from __future__ import annotations

import numpy as np
import pytest

from qlb import _native
from qlb.materials import MATERIALS, IsotropicMaterial, Material
from tests.materials.deformations import KINDS, kinds_for
from tests.materials.symbolic_examples import symbolic_example
from tests.support import Array

YOUNG = 2e4
RATIOS = [-0.3, 0.49]


def has_poisson(material_class: type[Material]) -> bool:
    return issubclass(material_class, IsotropicMaterial)


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Every material with each Poisson's ratio it can have and, where a test wants one, each F it is defined at."""
    names = set(metafunc.fixturenames)
    if "material" not in names:
        return
    objective = metafunc.definition.get_closest_marker("objective") is not None
    cases, ids = [], []
    for name in [*MATERIALS, "symbolic"]:
        if objective and name in MATERIALS and not MATERIALS[name].objective:
            continue
        for nu in RATIOS if name == "symbolic" or has_poisson(MATERIALS[name]) else [0.0]:
            for kind in kinds_for(name) if names & {"F", "kind"} else [""]:
                cases.append((name, nu, kind))
                ids.append("-".join(filter(None, [name, f"nu={nu}", kind])))
    metafunc.parametrize("case", cases, ids=ids)


@pytest.fixture(params=MATERIALS.values(), ids=MATERIALS)
def material_class(request: pytest.FixtureRequest) -> type[Material]:
    return request.param


@pytest.fixture
def material(case: tuple[str, float, str]) -> Material:
    name, nu, _ = case
    if name == "symbolic":
        return symbolic_example(YOUNG, nu)
    cls = MATERIALS[name]
    return cls(young=YOUNG, poisson=nu) if has_poisson(cls) else cls(young=YOUNG)


@pytest.fixture
def kind(case: tuple[str, float, str]) -> str:
    return case[2]


@pytest.fixture(name="F")
def deformation_gradients(kind: str, rng: np.random.Generator) -> Array:
    return KINDS[kind](rng)


@pytest.fixture
def level() -> str:
    """The level in use; test_simd_levels holds the others against it."""
    return _native.simd_levels()[-1]
