"""What a user's energy gets wrong is said by name, and what it raises comes out as it was."""

from __future__ import annotations

from collections.abc import Callable
from typing import Any

import numpy as np
import pytest
import scipy.sparse as sp

from qlb import InputError, NodalEnergy, Reason, Simulation, SolverSettings, StencilEnergy, StepFailed
from tests.energies.test_user_energies import FAR, MESH, N, bar
from tests.energies.user_energies import Centre, Laplacian, Springs, Tethers, node_mass
from tests.support import Array, finish


class Table(StencilEnergy):
    """Gives what it is told to."""

    def __init__(self, value: Any = None, gradient: Any = None, hessian: Any = None, stencils: Any = FAR) -> None:
        k, w = len(stencils), np.shape(stencils)[1]
        self.stencils = stencils
        self.given = {
            "value": np.zeros(k) if value is None else value,
            "gradient": np.zeros((k, w, 3)) if gradient is None else gradient,
            "hessian": np.zeros((k, 3 * w, 3 * w)) if hessian is None else hessian,
        }

    def value(self, x: Array, time: float) -> Any:
        return self.given["value"]

    def gradient(self, x: Array, time: float) -> Any:
        return self.given["gradient"]

    def hessian(self, x: Array, time: float) -> Any:
        return self.given["hessian"]


class Whole(NodalEnergy):
    """Gives what it is told to."""

    def __init__(self, value: Any = 0.0, gradient: Any = None, hessian: Any = None) -> None:
        self.given = {
            "value": value,
            "gradient": np.zeros((N, 3)) if gradient is None else gradient,
            "hessian": sp.csr_matrix((3 * N, 3 * N)) if hessian is None else hessian,
        }

    def value(self, x: Array, time: float) -> Any:
        return self.given["value"]

    def gradient(self, x: Array, time: float) -> Any:
        return self.given["gradient"]

    def hessian(self, x: Array, time: float, project: bool) -> Any:
        return self.given["hessian"]


NOTHING = type("Nothing", (), {})()
LOWER = sp.csr_matrix((np.ones(1), ([3], [2])), shape=(3 * N, 3 * N))
FAR_APART = sp.csr_matrix((np.ones(2), ([3 * (N - 1), 0], [0, 3 * (N - 1)])), shape=(3 * N, 3 * N))
WRONG = {
    "value too short": (Table(value=np.zeros(3)), r"value of Table gives shape \(3,\), must be \(4,\)"),
    "value of all": (Table(value=0.0), r"value of Table gives shape \(\), must be \(4,\)"),
    "value not returned": (Table(value=[None] * 4), "value of Table gives list, must be real numbers"),
    "value complex": (Table(value=np.zeros(4) * 1j), "value of Table gives ndarray, must be real numbers"),
    "gradient flat": (Table(gradient=np.zeros((4, 6))), r"gradient of Table gives shape \(4, 6\), must be \(4, 2, 3\)"),
    "gradient ragged": (Table(gradient=[[1], [1, 2]]), "gradient of Table gives list, must be real numbers"),
    "gradient text": (Table(gradient="0"), "gradient of Table gives str, must be real numbers"),
    "hessian of one": (
        Table(hessian=np.zeros((6, 6))),
        r"hessian of Table gives shape \(6, 6\), must be \(4, 6, 6\) or \(4, 2, 3, 2, 3\)",
    ),
    "hessian not symmetric": (
        Table(hessian=np.triu(np.ones((4, 6, 6)))),
        "hessian of Table is not symmetric: entries differ by 1 from their mirror",
    ),
    "no value": (Whole(value=NOTHING), "value of Whole gives Nothing, must be real numbers"),
    "values of nodes": (Whole(value=np.zeros(N)), rf"value of Whole gives shape \({N},\), must be one number"),
    "flat gradient": (
        Whole(gradient=np.zeros(3 * N)),
        rf"gradient of Whole gives shape \({3 * N},\), must be \({N}, 3\)",
    ),
    "sparse gradient": (Whole(gradient=LOWER), "gradient of Whole gives csr_matrix, must be real numbers"),
    "dense hessian": (
        Whole(hessian=np.zeros((3 * N, 3 * N))),
        r"hessian of Whole gives ndarray of shape \(48, 48\) and type float64,"
        r" must be a SciPy sparse matrix of shape \(48, 48\) of real numbers",
    ),
    "hessian of nodes": (
        Whole(hessian=sp.csr_matrix((N, N))),
        r"hessian of Whole gives csr_matrix of shape \(16, 16\)",
    ),
    "complex hessian": (Whole(hessian=sp.csr_matrix((48, 48), dtype=complex)), "type complex128"),
    "half a hessian": (Whole(hessian=LOWER), "hessian of Whole is not symmetric"),
    "no coupling": (
        Whole(hessian=FAR_APART),
        "hessian of Whole: nodes 0 and 15 are neither in one tet nor among the couplings",
    ),
}


@pytest.mark.parametrize(("energy", "message"), WRONG.values(), ids=WRONG)
def test_what_does_not_fit_is_named(energy: Table | Whole, message: str) -> None:
    simulation = bar(energy)
    before = simulation.state
    with pytest.raises(InputError, match=message):
        simulation.advance()
    assert simulation.state is before
    assert simulation.steps_done == 0


@pytest.mark.parametrize(
    ("stencils", "message"),
    [
        ([0, 1], r"stencils of Springs have shape \(2,\) and type int64, must be integers \(k, w\)"),
        ([[0.0, 1.0]], "type float64"),
        ([[0, 1], [2]], "type object"),
        (None, "type object"),
        ([[0, 1], [3, 99]], r"stencil 1 of Springs names node 99, must be in \[0, 15\]"),
        ([[-1, 1]], r"stencil 0 of Springs names node -1, must be in \[0, 15\]"),
    ],
)
def test_stencils_that_do_not_fit_the_mesh_are_refused_when_they_are_added(stencils: Any, message: str) -> None:
    simulation = bar(None)
    with pytest.raises(InputError, match=message):
        simulation.add(Springs(stencils, 1.0, 1.0))
    finish(simulation, 1)


def test_a_stencil_energy_without_stencils_is_refused() -> None:
    energy = Table()
    del energy.stencils
    with pytest.raises(InputError, match="stencils of Table"):
        bar(energy)


def test_couplings_that_do_not_fit_the_mesh_are_refused_when_they_are_added() -> None:
    energy = Laplacian(MESH, 1.0)
    energy.couplings = [[0, 16]]
    with pytest.raises(InputError, match=r"coupling 0 of Laplacian names node 16, must be in \[0, 15\]"):
        bar(energy)


@pytest.mark.parametrize("what", [None, Springs, "springs", 3.0])
def test_what_is_no_energy_is_refused(what: Any) -> None:
    with pytest.raises(InputError, match=r"energy = .* must be an Energy"):
        bar(None).add(what)


def test_nothing_is_added_after_the_first_step() -> None:
    simulation = bar(None)
    simulation.advance()
    with pytest.raises(InputError, match="cannot add energies after the first step"):
        simulation.add(Springs(FAR, 1.0, 1.0))


# ---- what is taken as it comes


def test_lists_and_other_numbers_will_do() -> None:
    class Sloppy(Springs):
        def value(self, x: Array, time: float) -> Any:
            return np.asarray(super().value(x, time)).tolist()

        def gradient(self, x: Array, time: float) -> Any:
            return np.asarray(super().gradient(x, time)).tolist()

        def hessian(self, x: Array, time: float) -> Any:
            return np.asarray(super().hessian(x, time)).reshape(-1, 2, 3, 2, 3).astype(np.float32)

    ends = [finish(bar(cls(FAR.tolist(), 300.0, 0.6)), 5).positions for cls in (Springs, Sloppy)]
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-6)


def test_single_precision_will_do_where_the_tolerance_is_within_it() -> None:
    class Single(Springs):
        def gradient(self, x: Array, time: float) -> Any:
            return np.asarray(super().gradient(x, time), dtype=np.float32)

    ends = [finish(bar(cls(FAR, 30.0, 0.7)), 5).positions for cls in (Springs, Single)]
    np.testing.assert_allclose(*ends, rtol=0, atol=1e-5)


@pytest.mark.parametrize("form", ["csr", "csc", "coo", "bsr", "dia", "lil", "dok"])
def test_any_sparse_format_will_do_and_stays_as_it_is(form: str) -> None:
    class Formed(Laplacian):
        def hessian(self, x: Array, time: float, project: bool) -> Any:
            return kept

    kept = Laplacian(MESH, 50.0).L.asformat(form)
    before = kept.toarray()
    ends = [finish(bar(cls(MESH, 50.0)), 3).positions for cls in (Laplacian, Formed)]
    np.testing.assert_array_equal(*ends)
    np.testing.assert_array_equal(kept.toarray(), before)


def test_zeros_need_no_coupling() -> None:
    energy = Laplacian(MESH, 50.0)
    expected = finish(bar(Laplacian(MESH, 50.0)), 3).positions
    L = energy.L.tocoo()
    at = np.array([0, 3 * N - 1])
    entries = np.append(L.data, [0.0, 0.0]), (np.append(L.row, at), np.append(L.col, at[::-1]))
    energy.L = sp.csr_matrix(entries, shape=L.shape)
    assert energy.L.nnz == L.nnz + 2
    np.testing.assert_array_equal(finish(bar(energy), 3).positions, expected)


def test_no_couplings_may_be_an_empty_list() -> None:
    energy = Laplacian(MESH, 50.0)
    energy.couplings = []
    finish(bar(energy), 1)


def test_no_stencils_change_nothing() -> None:
    none = Springs(np.empty((0, 2), dtype=np.int32), 1.0, np.empty(0))
    np.testing.assert_array_equal(finish(bar(none), 3).positions, finish(bar(None), 3).positions)


# ---- not finite


class Wall(Tethers):
    """A logarithm that keeps nodes above a height; undefined below."""

    height = -0.02
    seen = 0

    def value(self, x: Array, time: float) -> Any:
        room = x[:, 0, 1] - self.height
        self.seen += int((room <= 0).any())
        return np.where(room > 0, -self.stiffness * np.log(np.maximum(room, 1e-300)), np.nan)

    def gradient(self, x: Array, time: float) -> Any:
        gradient = np.zeros_like(x)
        gradient[:, 0, 1] = -self.stiffness / (x[:, 0, 1] - self.height)
        return gradient

    def hessian(self, x: Array, time: float) -> Any:
        hessian = np.zeros((len(x), 3, 3))
        hessian[:, 1, 1] = self.stiffness / (x[:, 0, 1] - self.height) ** 2
        return hessian


@pytest.mark.parametrize("solver", ["ND", "QLB"])
def test_the_line_search_backs_off_where_the_energy_is_not_defined(solver: str) -> None:
    wall = Wall(np.arange(N), MESH.positions, 0.01)
    simulation = bar(wall, "BDF1", solver, step=0.05)
    x = finish(simulation, 10).positions
    assert wall.seen > 0
    assert -0.02 < x[:, 1].min() < -0.01


@pytest.mark.parametrize("integrator", ["BDF2", "SDIRK2", "quasistatic"])
@pytest.mark.parametrize("solver", ["ND", "QLF", "QLB"])
@pytest.mark.parametrize("what", ["value", "gradient", "hessian"])
@pytest.mark.parametrize("bad", [np.nan, np.inf])
def test_a_start_that_is_not_finite_fails_as_such(bad: float, what: str, solver: str, integrator: str) -> None:
    full = {"value": np.zeros(4), "gradient": np.zeros((4, 2, 3)), "hessian": np.zeros((4, 6, 6))}
    full[what].flat[{"value": 0, "gradient": 3, "hessian": 21}[what]] = bad  # of a node that is free
    simulation = bar(Table(**full), integrator, solver)
    before = simulation.state
    with pytest.raises(StepFailed, match="not_finite") as caught:
        simulation.advance()
    assert caught.value.result.reason is Reason.NOT_FINITE
    assert simulation.state is before


@pytest.mark.parametrize("projection", ["always", "on-demand", "never"])
def test_a_sparse_hessian_that_is_not_finite_fails_as_such(projection: str) -> None:
    hessian = sp.csr_matrix((np.array([np.nan]), ([30], [30])), shape=(3 * N, 3 * N))
    settings = SolverSettings(projection=projection)  # type: ignore[arg-type]
    with pytest.raises(StepFailed, match="not_finite"):
        bar(Whole(hessian=hessian), solver_settings=settings).advance()


# ---- exceptions


class MistakeError(Exception):
    """The user's own."""


class Fragile(Springs):
    """Raises once when it is armed."""

    armed: dict[str, Exception]

    def _maybe(self, what: str) -> None:
        if what in self.armed:
            raise self.armed.pop(what)

    def value(self, x: Array, time: float) -> Any:
        self._maybe("value")
        return super().value(x, time)

    def gradient(self, x: Array, time: float) -> Any:
        self._maybe("gradient")
        return super().gradient(x, time)

    def hessian(self, x: Array, time: float) -> Any:
        self._maybe("hessian")
        return super().hessian(x, time)


def fragile(solver: str) -> tuple[Fragile, Simulation]:
    energy = Fragile(FAR, 300.0, 0.6)
    energy.armed = {}
    return energy, bar(energy, "BDF2", solver)


@pytest.mark.parametrize("what", ["value", "gradient", "hessian"])
@pytest.mark.parametrize("solver", ["ND", "QLF", "QLB"])
@pytest.mark.parametrize(
    "make", [MistakeError, FloatingPointError, ValueError, InputError, StopIteration, KeyboardInterrupt]
)
def test_an_exception_comes_out_as_it_was_and_leaves_no_trace(
    make: Callable[[str], Exception], solver: str, what: str
) -> None:
    calm, (energy, simulation) = fragile(solver)[1], fragile(solver)
    for at in (0, 1, 3):  # the SDIRK2 start, the first step of BDF2, and later
        if what == "hessian" and solver == "QLF" and at == 3:
            break  # its factor stays
        finish(simulation, at - simulation.steps_done)
        before, mistake = simulation.state, make("mine")
        energy.armed = {what: mistake}
        with pytest.raises(type(mistake)) as caught:
            simulation.advance()
        assert caught.value is mistake
        assert simulation.state is before
        assert simulation.steps_done == at
    steps = 5 - simulation.steps_done
    np.testing.assert_array_equal(finish(simulation, steps).positions, finish(calm, 5).positions)


def test_the_same_system_is_made_after_a_refusal() -> None:
    energy = Centre(node_mass(MESH), 10.0, (0, 0, 0))
    energy.couplings = np.empty((0, 2), dtype=int)
    with pytest.raises(InputError, match=r"hessian of Centre: nodes \d+ and \d+ are neither in one tet"):
        bar(energy).advance()
