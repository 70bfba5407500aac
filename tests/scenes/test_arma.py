"""The armadillo: what is held and pulled, in any mesh; it is let go, swings back, and every solve converges."""

from __future__ import annotations

from pathlib import Path

import meshio
import numpy as np
import pytest

from qlb import InputError, Simulation, TetMesh
from qlb.scenes import load_scene

SMALL = ["mesh.tets=1500", "threads=1"]
REAL = Path(__file__).parents[3] / "shared" / "meshes" / "armadillo13K.msh"


def held_and_pulled(simulation: Simulation) -> tuple[np.ndarray, list[np.ndarray]]:
    """Nodes of the feet, and of each hand, from where they are before and after the pull."""
    x, held = simulation.mesh.positions, simulation.system.held
    assert (held.fixed.any(axis=1) == held.fixed.all(axis=1)).all()
    moved = np.abs(held.place(x, 0.4) - x).max(axis=1) > 0
    nodes, middle = np.flatnonzero(moved), x[:, 2].mean()
    hands = [nodes[x[nodes, 2] < middle], nodes[x[nodes, 2] > middle]]
    return np.flatnonzero(held.fixed.all(axis=1) & ~moved), hands


def test_feet_are_held_and_hands_pulled_apart_and_let_go():
    simulation = load_scene("arma", [*SMALL, "pull.way=-0.1,0.2,0.15"]).build()
    x, held = simulation.mesh.positions, simulation.system.held
    feet, (left, right) = held_and_pulled(simulation)
    assert (x[:, 1].min(), x[feet, 1].max()) == (0.0, pytest.approx(0.05, abs=0.02))
    assert min((x[feet, 2] < 0).sum(), (x[feet, 2] > 0).sum()) > 3
    assert np.abs(x[feet, 2]).min() > 0.05  # not the tail
    assert min(len(left), len(right)) > 3
    assert min(x[left, 1].min(), x[right, 1].min()) > 0.5
    np.testing.assert_allclose((held.place(x, 0.4) - x)[right], np.tile([-0.1, 0.2, 0.15], (len(right), 1)), atol=1e-12)
    np.testing.assert_allclose((held.place(x, 0.4) - x)[left], np.tile([-0.1, 0.2, -0.15], (len(left), 1)), atol=1e-12)
    np.testing.assert_array_equal(np.flatnonzero(held.at(0.4).fixed.all(axis=1)), feet)


def test_the_defaults_are_those_of_the_design():
    scene = load_scene("arma")
    assert (scene.integrator, scene.step, scene.damping.mass, scene.damping.viscosity) == ("BDF2", 1e-2, 0, 0)
    assert (scene.material.young, scene.material.poisson) == (2e4, 0.49)
    mesh = scene.build().mesh
    assert len(mesh.tets) == pytest.approx(8000, rel=0.1)
    assert np.ptp(mesh.positions[:, 1]) == pytest.approx(1.0)


@pytest.mark.slow
@pytest.mark.parametrize("solver", ["ND", "QLB", "QLA"])
def test_it_swings_back_past_where_it_stood(solver):
    simulation = load_scene("arma", [*SMALL, f"solver={solver}", "solver_settings.projection=on-demand"]).build()
    x = simulation.mesh.positions
    _, hands = held_and_pulled(simulation)
    apart = [np.mean((result.positions - x)[hands[1], 2]) for result in simulation.run(110)]
    assert max(apart) == pytest.approx(0.14, abs=0.005)
    assert min(apart[40:]) < -0.03


def test_a_mesh_that_looks_another_way_is_turned(tmp_path):
    mesh = TetMesh.box((2.0, 4.0, 1.0), cells=(8, 8, 2))  # its sides along x
    path = tmp_path / "body.vtu"
    meshio.write_points_cells(path, mesh.positions, [("tetra", mesh.tets)])
    simulation = load_scene("arma", [f"mesh.path={path}", "mesh.rotation=0,-1.5707963,0", "threads=1"]).build()
    np.testing.assert_allclose(np.ptp(simulation.mesh.positions, axis=0), [0.25, 1.0, 0.5], atol=1e-6)
    _, hands = held_and_pulled(simulation)
    assert [len(hand) for hand in hands] == [12, 12]  # x = 0 and x = 2, y > 2: four rows of three


@pytest.mark.parametrize(
    ("override", "message"),
    [
        ("pull.hands=z > 0.9", "nodes on one side of z = 0.5 only"),
        ("pull.feet=y < -1", "pull.feet: .* selects none"),
        ("pull.hands=y < 1", "held already"),
        ("pull.until=0", "pull.until: 0 is out of range: must be > 0 s"),
        ("pull.feet=1", "pull.feet"),
        ("mesh.rotation=0,0", "mesh.rotation"),
    ],
)
def test_wrong_settings_are_named(override, message):
    with pytest.raises(InputError, match=message):
        load_scene("arma", [*SMALL, override]).build()


@pytest.mark.slow
@pytest.mark.skipif(not REAL.exists(), reason="needs a mesh of shared/, which is not part of the project")
def test_the_real_armadillo_is_held_by_its_feet_and_pulled_by_its_hands():
    simulation = load_scene("arma", [f"mesh.path={REAL}", "mesh.rotation=0,-1.5707963,0"]).build()
    x = simulation.mesh.positions - simulation.mesh.positions.mean(axis=0)
    feet, (left, right) = held_and_pulled(simulation)
    assert np.ptp(simulation.mesh.positions[:, 1]) == pytest.approx(1.0)
    assert min((x[feet, 2] < 0).sum(), (x[feet, 2] > 0).sum()) > 50
    assert min(len(left), len(right)) > 50
    assert all(result.converged for result in simulation.run(3))
