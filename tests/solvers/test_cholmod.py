"""With CHOLMOD in place of our own Cholesky every solver goes the same way, or says that it cannot."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import InputError, Plane, Simulation, SolverSettings, StableNeoHookean, Tolerance, _native
from qlb.solvers import SOLVERS
from qlb.system.system import CholeskyKind
from tests.support import finish, left_end, make_system, small_bar

MESH = small_bar((3, 1, 1))
REFUSED = ("QLA", True)
KINDS: tuple[CholeskyKind, ...] = ("supernodal", "cholmod")
GROUND = -0.06
"""its height [m]"""


def falling(solver: str, cholesky: CholeskyKind, on_ground: bool) -> Simulation:
    simulation = Simulation(
        MESH,
        material=StableNeoHookean(young=1e4, poisson=0.4),
        obstacles=[Plane((0.0, GROUND, 0.0), (0.0, 1.0, 0.0))] if on_ground else [],
        solver=solver,
        tolerance=Tolerance(relative=1e-10),
        solver_settings=SolverSettings(cholesky=cholesky),
        threads=1,
    )
    simulation.pin(left_end(MESH))
    return simulation


@pytest.mark.parametrize(("solver", "on_ground"), [(s, g) for s in SOLVERS for g in (False, True) if (s, g) != REFUSED])
def test_it_goes_the_same_way(solver: str, on_ground: bool) -> None:
    ours, theirs = (finish(falling(solver, kind, on_ground), 15).positions for kind in KINDS)
    assert (GROUND < ours[:, 1].min() < 0.5 * GROUND) if on_ground else ours[:, 1].min() < GROUND
    np.testing.assert_allclose(theirs, ours, rtol=0, atol=1e-8)


def test_qla_in_contact_cannot_do_with_it() -> None:
    with pytest.raises(InputError, match="cholesky = 'cholmod': must be 'supernodal' for QLA in contact"):
        finish(falling("QLA", "cholmod", on_ground=True), 1)


def test_it_has_one_precision() -> None:
    with pytest.raises(InputError, match="'float32' is not to be had from cholmod: must be 'float64'"):
        make_system(MESH).analyse("cholmod", "float32")


def test_a_build_without_it_says_so(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.delattr(_native, "CholmodCholesky")
    with pytest.raises(InputError, match="'cholmod' is not in this build: see 'Reference'"):
        make_system(MESH).analyse("cholmod")
