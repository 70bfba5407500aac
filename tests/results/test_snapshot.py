"""What a run directory says of stress, energies and momentum is what the simulation said, also after it is gone."""

from __future__ import annotations

from dataclasses import asdict

import numpy as np
import pytest

import qlb
from qlb.analysis import Snapshot
from qlb.results import Run, RunWriter

MESH = qlb.TetMesh.box((0.3, 0.1, 0.1), cells=(3, 1, 1))
FIELDS = ("first_piola_kirchhoff_stress", "cauchy_stress", "von_mises_stress", "energy_density", "linear_momentum")


def two_bodies() -> qlb.Simulation:
    """Materials, fibres, densities, contact, moving gravity and a load: all that a run must remember."""
    bodies = [
        qlb.Body(
            MESH,
            qlb.StableNeoHookean(young="2e4 * (1 + x)", density=lambda x: 1000 + x[:, 1]),
            fibres=[qlb.Fibres(direction=("1", "x", "0"))],
            name="low",
            placement=qlb.Placement(translation=(0, 0.002, 0)),
        ),
        qlb.Body(MESH, qlb.MooneyRivlin(young=5e4), placement=qlb.Placement(translation=(0, 0.105, 0))),
    ]
    simulation = qlb.Simulation(
        bodies,
        obstacles=[qlb.Plane((0, 0, 0), (0, 1, 0))],
        gravity=lambda time: np.array([0, -9.81 - time, 0]),
        mass="consistent",
        contact=qlb.Contact(friction=0.3),
        threads=1,
    )
    simulation.add(qlb.PointForce([3], (0.1, 0.0, 0.2)))
    return simulation


def test_a_run_gives_the_fields_of_its_simulation(tmp_path):
    simulation = two_bodies()
    told = [Snapshot.of(simulation)]
    with RunWriter(tmp_path / "run", {"anything": "at all"}, simulation) as writer:
        for result in simulation.run(6):
            writer.record(result)
            told.append(Snapshot.of(simulation))
    run = Run(tmp_path / "run")
    assert max(now.energies.contact for now in told) > 0
    for step, now in enumerate(told):
        read = run.snapshot(step)
        assert read.time == now.time
        assert asdict(read.energies) == asdict(now.energies)
        np.testing.assert_array_equal(read.contact_forces, now.contact_forces)
        np.testing.assert_array_equal(read.angular_momentum((1, 2, 3)), now.angular_momentum((1, 2, 3)))
        for name in FIELDS:
            np.testing.assert_array_equal(getattr(read, name), getattr(now, name), err_msg=name)
    np.testing.assert_array_equal(run.snapshot(run.frame(6)).positions, told[-1].positions)


def test_a_density_of_the_users_own_is_not_in_a_run(tmp_path):
    sympy = pytest.importorskip("sympy")
    I1, _, J = qlb.SymbolicMaterial.invariants
    psi = 1e4 * (I1 * J ** sympy.Rational(-2, 3) - 3) + 1e5 * (J - 1) ** 2
    simulation = qlb.Simulation(MESH, material=qlb.SymbolicMaterial(psi=psi), threads=1)
    with RunWriter(tmp_path / "run", {}, simulation) as writer:
        writer.record(simulation.advance())
    assert Snapshot.of(simulation).von_mises_stress.shape == (18,)
    state = Run(tmp_path / "run").snapshot(1)
    assert not state.constitution.is_known
    assert state.linear_momentum[1] < 0
    np.testing.assert_allclose(state.volume_ratio, 1, atol=1e-3)
    for name in ("von_mises_stress", "energies"):
        with pytest.raises(qlb.InputError, match="a density of the user's own, which a run does not hold"):
            getattr(state, name)


def test_a_run_of_an_earlier_version(make_run):
    run = make_run(steps=1)
    with np.load(run.directory / "frames" / "000001.npz") as file:
        arrays = {name: file[name] for name in file.files if name != "gravity"}
    np.savez(run.directory / "frames" / "000001.npz", **arrays)
    with pytest.raises(qlb.InputError, match="written by an earlier version"):
        assert run.snapshot(1).energies
    (run.directory / "materials.npz").unlink()
    with pytest.raises(qlb.InputError, match=r"materials\.npz does not exist: .* run it again"):
        Run(run.directory).snapshot(1)


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"kernels": np.array(["SNHH"])}, "SNHH"),
        ({"parameters_0": np.ones((1, 7))}, "parameters"),
        ({"parameters_0": np.ones((5, 2))}, r"shape \(5, 2\)"),
        ({"tets": np.array([[0, 99]])}, "0 to 99 are out of range"),
        ({"density": np.ones(3)}, "density"),
        ({"density": -np.ones(1)}, "density"),
        ({"mass": np.array("heavy")}, "mass"),
        ({"kernels": np.array(["SNH", "SNH"])}, "differ in number"),
        ({"tets": np.zeros(2)}, "'tets' has shape"),
    ],
)
def test_materials_that_are_damaged_are_named(make_run, changed, message):
    run = make_run(steps=1)
    path = run.directory / "materials.npz"
    with np.load(path) as file:
        arrays = {name: file[name] for name in file.files}
    np.savez(path, **(arrays | changed))
    with pytest.raises(qlb.InputError, match=f"materials.npz is not what it should be: .*{message}"):
        assert run.constitution
