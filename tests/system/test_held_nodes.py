"""Held nodes are exactly where they are held; wrong selections and motions are refused."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import InputError, Rotation, Simulation, StableNeoHookean, TetMesh, Translation
from qlb.system import HeldNodes
from tests.support import Array, left_end, right_end, small_bar

AXIS = Rotation(axis=(1.0, 0.0, 0.0), origin=(0.0, 0.125, 0.125), rate=0.5)


@pytest.fixture
def mesh() -> TetMesh:
    return small_bar()


def bar(mesh: TetMesh, **arguments: object) -> Simulation:
    defaults = {"material": StableNeoHookean(), "step": 0.01, "threads": 1}
    return Simulation(mesh, **(defaults | arguments))  # type: ignore[arg-type]


@pytest.mark.parametrize("integrator", ["BDF1", "BDF2", "SDIRK2", "quasistatic"])
def test_moved_nodes_are_exactly_where_the_script_says(mesh: TetMesh, integrator: str) -> None:
    simulation, nodes = bar(mesh, integrator=integrator), right_end(mesh)
    simulation.pin(left_end(mesh))
    simulation.move(nodes, AXIS)
    for result in simulation.run(4):
        np.testing.assert_array_equal(result.positions[nodes], AXIS(mesh.positions[nodes], result.time))
        np.testing.assert_array_equal(result.positions[left_end(mesh)], mesh.positions[left_end(mesh)])


def test_the_script_is_asked_at_the_time_of_each_stage(mesh: TetMesh) -> None:
    times: set[float] = set()

    def still(anchors: Array, time: float) -> Array:
        times.add(time)
        return anchors

    simulation = bar(mesh, integrator="SDIRK2", step=0.1)
    simulation.move(right_end(mesh), still)
    simulation.advance()
    a = 1 - np.sqrt(0.5)
    assert sorted(times) == pytest.approx([0.1 * a, 0.1])


def test_the_script_is_given_the_positions_at_time_zero(mesh: TetMesh) -> None:
    nodes = right_end(mesh)

    def check(anchors: Array, time: float) -> Array:
        np.testing.assert_array_equal(anchors, mesh.positions[nodes])
        return anchors + time

    simulation = bar(mesh)
    simulation.move(nodes, check)
    for _ in simulation.run(3):
        pass
    assert simulation.state.positions[nodes[0], 0] == mesh.positions[nodes[0], 0] + simulation.state.time


def test_a_node_held_along_some_axes_moves_along_the_others(mesh: TetMesh) -> None:
    simulation, nodes = bar(mesh, gravity=(1.0, 2.0, 3.0)), left_end(mesh)
    simulation.pin(nodes, axes="xz")
    simulation.advance()
    moved = simulation.state.positions[nodes] - mesh.positions[nodes]
    np.testing.assert_array_equal(moved[:, [0, 2]], 0.0)
    assert (moved[:, 1] > 0).all()


def test_a_node_may_be_held_axis_by_axis(mesh: TetMesh) -> None:
    simulation, nodes = bar(mesh), left_end(mesh)
    for axis in "zxy":
        simulation.pin(nodes, axes=axis)
    simulation.advance()
    np.testing.assert_array_equal(simulation.state.positions[nodes], mesh.positions[nodes])


def test_axes_may_move_by_a_script(mesh: TetMesh) -> None:
    held = HeldNodes(len(mesh.positions))
    held.hold([3, 5], mesh.positions, Translation((1.0, 1.0, 1.0)), axes="y")
    placed = held.place(mesh.positions, 2.0)
    np.testing.assert_array_equal(placed[[3, 5], 1], mesh.positions[[3, 5], 1] + 2.0)
    placed[[3, 5], 1] = mesh.positions[[3, 5], 1]
    np.testing.assert_array_equal(placed, mesh.positions)


def test_placing_leaves_its_argument_alone(mesh: TetMesh) -> None:
    held = HeldNodes(len(mesh.positions))
    held.hold([0], mesh.positions, Translation((1.0, 0.0, 0.0)))
    x = mesh.positions.copy()
    held.place(x, 1.0)
    np.testing.assert_array_equal(x, mesh.positions)


@pytest.mark.parametrize(
    ("nodes", "axes", "message"),
    [
        ([], "xyz", "no nodes to hold: the selection is empty"),
        ([-1, 2], "xyz", "held node -1 is out of range: must be in [0, 15]"),
        ([2, 16], "xyz", "held node 16 is out of range: must be in [0, 15]"),
        ([0], "xw", "axes 'xw' must be letters out of x, y, z"),
        ([0], "", "axes '' must be letters out of x, y, z"),
        ([0], "X", "axes 'X' must be letters out of x, y, z"),
    ],
)
def test_a_wrong_selection_is_named_with_its_range(mesh: TetMesh, nodes: list[int], axes: str, message: str) -> None:
    with pytest.raises(InputError) as caught:
        bar(mesh).pin(nodes, axes=axes)
    assert str(caught.value) == message


def test_a_node_held_twice_is_refused(mesh: TetMesh) -> None:
    simulation = bar(mesh)
    simulation.pin([2, 7], axes="xy")
    with pytest.raises(InputError, match="node 7 is held already"):
        simulation.move([7, 9], AXIS)
    with pytest.raises(InputError, match="node 2 is held already"):
        simulation.pin([1, 2], axes="yz")


def test_a_refused_selection_holds_nothing(mesh: TetMesh) -> None:
    held = HeldNodes(len(mesh.positions))
    held.hold([2], mesh.positions)
    with pytest.raises(InputError):
        held.hold([1, 2], mesh.positions)
    assert held.fixed.sum() == 3


def test_naming_a_node_twice_in_one_selection_holds_it_once(mesh: TetMesh) -> None:
    held = HeldNodes(len(mesh.positions))
    held.hold([4, 4], mesh.positions)
    assert held.fixed.sum() == 3


@pytest.mark.parametrize(
    "selection",
    [
        pytest.param([True] + 15 * [False], id="mask"),
        pytest.param([0.5, 1.5], id="fractions"),
        pytest.param([np.nan], id="nan"),
        pytest.param([2**40], id="beyond 32 bits"),
        pytest.param(["left"], id="text"),
    ],
)
def test_a_selection_that_is_no_list_of_indices_is_refused(mesh: TetMesh, selection: list[object]) -> None:
    # A mask would hold nodes 0 and 1, silently.
    with pytest.raises(InputError):
        bar(mesh).pin(selection)  # type: ignore[arg-type]


@pytest.mark.parametrize(
    "motion",
    [
        pytest.param(lambda x, t: np.full_like(x, np.nan), id="nan"),
        pytest.param(lambda x, t: np.full_like(x, np.inf), id="inf"),
        pytest.param(lambda x, t: x[:1], id="too few nodes"),
        pytest.param(lambda x, t: x[:, :2], id="two axes"),
        pytest.param(lambda x, t: None, id="nothing"),
    ],
)
def test_a_wrong_motion_is_refused_and_the_state_kept(mesh: TetMesh, motion: object) -> None:
    simulation = bar(mesh)
    simulation.move(right_end(mesh), motion)  # type: ignore[arg-type]
    before = simulation.state
    with pytest.raises(InputError, match=r"motion .* at time"):
        simulation.advance()
    assert simulation.state is before


def test_nodes_cannot_be_held_after_the_first_step(mesh: TetMesh) -> None:
    simulation = bar(mesh)
    simulation.advance()
    with pytest.raises(InputError, match="cannot pin nodes after the first step"):
        simulation.pin([0])
    with pytest.raises(InputError, match="cannot move nodes after the first step"):
        simulation.move([0], AXIS)


def test_held_everywhere_the_body_does_not_move(mesh: TetMesh) -> None:
    simulation = bar(mesh)
    simulation.pin(np.arange(len(mesh.positions)))
    result = simulation.advance()
    assert result.converged
    np.testing.assert_array_equal(result.positions, mesh.positions)
