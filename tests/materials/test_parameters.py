"""Parameters of materials: numbers or arrays, checked against their range."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import InputError, StableNeoHookean, _native
from qlb.materials import MATERIALS, Fibres, Material
from tests.materials.conftest import has_poisson


def test_every_compiled_material_has_its_class() -> None:
    fibres = {Fibres(model="sqrtI5").kernels, Fibres(model="StVK").kernels}
    symbolic = {"symbolic", "symbolic-I2"}
    assert set(_native.material_names()) == set(MATERIALS) | fibres | symbolic | {"viscous"}


def test_each_name_is_that_of_its_class() -> None:
    for name, material in MATERIALS.items():
        assert material().model == name


def test_arrays_give_each_element_its_own_constants(
    material_class: type[Material], level: str, rng: np.random.Generator
) -> None:
    given = {"young": rng.uniform(1e3, 1e5, 11)}
    if has_poisson(material_class):
        given["poisson"] = rng.uniform(-0.2, 0.49, 11)
    F = np.eye(3) + 0.1 * rng.normal(size=(11, 3, 3))
    together = material_class(**given).evaluate(F, simd_level=level)
    for k in range(11):
        one = {name: values[k] for name, values in given.items()}
        alone = material_class(**one).evaluate(F[k : k + 1], simd_level=level)
        for whole, single in zip(together, alone, strict=True):
            np.testing.assert_allclose(whole[k], single[0], rtol=1e-13, atol=1e-13 * np.abs(single).max())


def test_one_number_beside_an_array_counts_for_all() -> None:
    mixed = StableNeoHookean(young=[1e4, 2e4], poisson=0.3).parameter_table(2)
    full = StableNeoHookean(young=[1e4, 2e4], poisson=[0.3, 0.3]).parameter_table(2)
    np.testing.assert_array_equal(mixed, full)


def test_an_array_of_another_length_is_refused(material_class: type[Material]) -> None:
    with pytest.raises(InputError, match=r"shape \(2,\), must be one number or \(3,\)"):
        material_class(young=[1e4, 2e4]).parameter_table(3)


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"young": 0.0}, "young: 0 is out of range: must be > 0 Pa"),
        ({"young": -1.0}, "young: -1 is out of range: must be > 0 Pa"),
        ({"young": np.nan}, "young: nan is out of range: must be > 0 Pa"),
        ({"young": np.inf}, "young: inf is out of range: must be > 0 Pa"),
        ({"young": [1.0, 2.0, -3.0]}, "young: -3 at index 2 is out of range: must be > 0 Pa"),
        ({"young": ["stiff"]}, "young: ['stiff'] is not a number"),
        ({"young": True}, "young: True is not a number"),
        ({"poisson": 0.5}, "poisson: 0.5 is out of range: must be > -1 and < 0.5"),
        ({"poisson": -1.0}, "poisson: -1 is out of range: must be > -1 and < 0.5"),
        ({"poisson": np.nan}, "poisson: nan is out of range: must be > -1 and < 0.5"),
        ({"poisson": [0.3, 0.7]}, "poisson: 0.7 at index 1 is out of range: must be > -1 and < 0.5"),
        ({"density": 0.0}, "density: 0 is out of range: must be > 0 kg/m^3"),
        ({"density": -5.0}, "density: -5 is out of range: must be > 0 kg/m^3"),
        ({"yuong": 1.0}, "unknown key 'yuong'; did you mean 'young'?"),
    ],
)
def test_a_wrong_parameter_is_named_with_its_range(arguments: dict[str, object], message: str) -> None:
    with pytest.raises(InputError) as caught:
        StableNeoHookean(**arguments)  # type: ignore[arg-type]
    assert str(caught.value) == message
