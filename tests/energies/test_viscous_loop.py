"""One loop over the elements for a material and its viscosity: the same sum as with one loop for each."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Damping, _native
from qlb.energies.damping import KelvinVoigt
from qlb.materials import MATERIALS
from tests.energies.test_damping import block
from tests.support import make_system
from tests.system.test_stage_problem import moving_state, stage_of


@pytest.mark.parametrize("material", MATERIALS)
def test_the_loop_of_the_material_takes_viscosity_along(material: str, rng: np.random.Generator) -> None:
    mesh = block(rng)
    system = make_system(mesh, material=MATERIALS[material](), damping=Damping(viscosity="5 + x"), threads=2)
    state = moving_state(mesh, rng)
    (term,) = (term for term in system.terms if isinstance(term, KelvinVoigt))
    viscosity = term.at(stage_of("SDIRK2", 1, state, rng), mesh.positions)
    assert viscosity is not None
    assert system.takes_along(viscosity)
    assert not system.takes_along(system.potentials[0])
    x, scale = mesh.positions + 0.02 * rng.normal(size=mesh.positions.shape), 1e-4
    energy, gradient = system.viscous_energy(x, viscosity, scale)
    apart = np.zeros_like(x)
    parts = [part.add_value_gradient(x, scale, apart) for part in (*system.potentials, viscosity)]
    assert abs(parts[1]) > 1e-3 * abs(parts[0]) > 0  # neither is a trifle
    assert energy == pytest.approx(sum(parts), rel=1e-13)
    np.testing.assert_allclose(gradient, apart, rtol=0, atol=1e-13 * np.abs(apart).max())


def test_only_viscosity_of_the_same_elements_is_taken_along(rng: np.random.Generator) -> None:
    mesh = block(rng)
    one, other = (make_system(mesh, damping=Damping(viscosity=5.0)) for _ in range(2))
    (term,) = (term for term in other.terms if isinstance(term, KelvinVoigt))
    viscosity = term.at(stage_of("BDF1", 0, moving_state(mesh, rng), rng), mesh.positions)
    assert isinstance(viscosity, _native.Viscosity)
    with pytest.raises(ValueError, match="of other elements"):
        one.viscous_energy(mesh.positions, viscosity, 1.0)
    assert isinstance(one.elastic, _native.ElasticEnergy)
    with pytest.raises(ValueError, match="viscosity: of material 'SNH'"):
        one.elastic.add_viscous_value_gradient(mesh.positions, one.elastic, 1.0, np.zeros_like(mesh.positions))
