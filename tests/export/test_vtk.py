"""VTKHDF and VTU, read back by VTK's own readers: every frame has the positions, fields and cells of the run."""

from __future__ import annotations

import xml.etree.ElementTree as ElementTree
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import qlb
from qlb.export import Recording, export_run, write_vtkhdf, write_vtu
from qlb.results import Frame, Run, RunWriter
from tests.export.expected import obstacle_points, surface_points
from tests.support import Array

pytest.importorskip("vtk")
pytest.importorskip("h5py")

SYMMETRIC = ([0, 1, 2, 0, 1, 0], [0, 1, 2, 1, 2, 2])


def read_vtkhdf(path: Path, time: float) -> Any:
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateTimeStep(time)
    return reader.GetOutput()


def times_of(path: Path) -> list[float]:
    from vtkmodules.vtkCommonExecutionModel import vtkStreamingDemandDrivenPipeline
    from vtkmodules.vtkIOHDF import vtkHDFReader

    reader = vtkHDFReader()
    reader.SetFileName(str(path))
    reader.UpdateInformation()
    return list(reader.GetOutputInformation(0).Get(vtkStreamingDemandDrivenPipeline.TIME_STEPS()))


def read_vtu(path: Path) -> Any:
    from vtkmodules.vtkIOXML import vtkXMLUnstructuredGridReader

    reader = vtkXMLUnstructuredGridReader()
    reader.SetFileName(str(path))
    reader.Update()
    return reader.GetOutput()


def collection(path: Path) -> list[tuple[float, str, Path]]:
    """Time, name and file of each entry of a PVD file."""
    entries = ElementTree.parse(path).getroot().iter("DataSet")
    return [(float(e.attrib["timestep"]), e.attrib["name"], path.parent / e.attrib["file"]) for e in entries]


def array(data: Any, name: str) -> Array:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    found = data.GetArray(name)
    assert found is not None, name
    return np.array(vtk_to_numpy(found))


def points(grid: Any) -> Array:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return np.array(vtk_to_numpy(grid.GetPoints().GetData()))


def cells(grid: Any) -> Array:
    from vtkmodules.util.numpy_support import vtk_to_numpy

    return np.array(vtk_to_numpy(grid.GetCells().GetConnectivityArray())).reshape(grid.GetNumberOfCells(), -1)


def check_volume(run: Run, frame: Frame, grid: Any) -> None:
    n = len(run.mesh.positions)
    np.testing.assert_array_equal(points(grid), frame.positions[:n])
    np.testing.assert_array_equal(cells(grid), run.mesh.tets)
    assert {grid.GetCellType(c) for c in range(grid.GetNumberOfCells())} == {10}
    state = run.snapshot(frame)
    nodes, tets = grid.GetPointData(), grid.GetCellData()
    forces = np.zeros((n, 3)) if frame.contact_forces is None else frame.contact_forces[:n]
    expected = {
        "displacement": frame.positions[:n] - run.mesh.positions,
        "velocity": frame.velocities[:n],
        "contact_force": forces,
    }
    for name, values in expected.items():
        np.testing.assert_array_equal(array(nodes, name), values.astype(np.float32), err_msg=name)
    sigma = state.cauchy_stress[:, SYMMETRIC[0], SYMMETRIC[1]]
    np.testing.assert_array_equal(array(tets, "cauchy_stress"), sigma.astype(np.float32))
    np.testing.assert_array_equal(array(tets, "von_mises_stress"), state.von_mises_stress.astype(np.float32))
    np.testing.assert_array_equal(array(tets, "energy_density"), state.energy_density.astype(np.float32))
    np.testing.assert_array_equal(array(tets, "body"), run.parts.groups[run.mesh.tets[:, 0]])


def check_surface(run: Run, frame: Frame, grid: Any) -> None:
    x = surface_points(run, frame.positions)
    np.testing.assert_allclose(points(grid), x, rtol=0, atol=1e-14)
    np.testing.assert_array_equal(cells(grid), run.mesh.rendered().triangles)
    assert {grid.GetCellType(c) for c in range(grid.GetNumberOfCells())} == {5}
    nodes = grid.GetPointData()
    np.testing.assert_allclose(array(nodes, "velocity"), surface_points(run, frame.velocities), rtol=1e-6, atol=1e-9)
    state = run.snapshot(frame)
    np.testing.assert_allclose(
        array(nodes, "von_mises_stress"), surface_points(run, state.at_nodes(state.von_mises_stress)), rtol=1e-6
    )


def check_surroundings(run: Run, frame: Frame, grid: Any) -> None:
    x = points(grid)
    for obstacle, rows in ((0, slice(0, 3)), (1, slice(3, 7))):
        np.testing.assert_array_equal(x[rows], obstacle_points(run, frame, obstacle))
    for k, rows in enumerate((slice(7, 11), slice(11, 15))):
        normal, point = run.parts.planes[k, 3:], frame.plane_points[k]
        np.testing.assert_allclose((x[rows] - point) @ normal, 0, atol=1e-12)
    np.testing.assert_array_equal(array(grid.GetCellData(), "obstacle"), [0, 1, 1, 2, 2, 3, 3])
    velocities = frame.velocities[len(run.mesh.positions) :].astype(np.float32)
    np.testing.assert_array_equal(array(grid.GetPointData(), "velocity")[:7], velocities)


def test_vtkhdf_with_the_tets(run, tmp_path):
    bodies, around = write_vtkhdf(Recording.of(run), tmp_path / "two.vtkhdf")
    assert around.name == "two-surroundings.vtkhdf"
    np.testing.assert_array_equal(times_of(bodies), [frame.time for frame in run.frames()])
    for frame in run.frames():
        check_volume(run, frame, read_vtkhdf(bodies, frame.time))
        check_surroundings(run, frame, read_vtkhdf(around, frame.time))


def test_vtkhdf_with_the_surface(run, tmp_path):
    bodies, _ = write_vtkhdf(Recording.of(run, "::2"), tmp_path / "two.vtkhdf", volume=False)
    frames = [run.frame(step) for step in (0, 2, 4)]
    np.testing.assert_array_equal(times_of(bodies), [frame.time for frame in frames])
    for frame in frames:
        check_surface(run, frame, read_vtkhdf(bodies, frame.time))


def test_vtkhdf_stores_once_what_stays(run, bar, tmp_path):
    import h5py

    write_vtkhdf(Recording.of(run), tmp_path / "two.vtkhdf")
    with h5py.File(tmp_path / "two.vtkhdf") as file:
        root = file["VTKHDF"]
        assert root["Connectivity"].shape == (run.mesh.tets.size,)
        assert root["CellData/body"].shape == (len(run.mesh.tets),)
        assert root["Points"].shape == (5 * len(run.mesh.positions), 3)
    files = write_vtkhdf(Recording.of(bar), tmp_path / "bar.vtkhdf")
    assert [file.name for file in files] == ["bar.vtkhdf"]
    single = write_vtkhdf(Recording.of(bar, "2"), tmp_path / "one.vtkhdf")
    check_points = points(read_vtkhdf(single[0], bar.frame(2).time))
    np.testing.assert_array_equal(check_points, bar.frame(2).positions)


@pytest.mark.parametrize("volume", [True, False])
def test_vtu(run, tmp_path, volume):
    files = write_vtu(Recording.of(run), tmp_path / "two.pvd", volume=volume)
    assert files[0] == tmp_path / "two.pvd"
    entries = collection(files[0])
    assert {file for _, _, file in entries} == set(files[1:])
    body = "bodies" if volume else "surface"
    assert [name for _, name, _ in entries] == [body, "surroundings"] * 5
    for k, frame in enumerate(run.frames()):
        (time, _, bodies), (same, _, around) = entries[2 * k : 2 * k + 2]
        assert time == same == frame.time
        (check_volume if volume else check_surface)(run, frame, read_vtu(bodies))
        check_surroundings(run, frame, read_vtu(around))


def test_what_stands_still_is_one_file(run, tmp_path, make_still):
    still = make_still()
    entries = collection(write_vtu(Recording.of(still), tmp_path / "still.pvd")[0])
    assert len({file for _, name, file in entries if name == "surroundings"}) == 1
    assert len({file for _, name, file in entries if name == "bodies"}) == 3


def test_a_density_of_the_users_own_is_exported_without_stress(tmp_path):
    sympy = pytest.importorskip("sympy")
    I1, _, J = qlb.SymbolicMaterial.invariants
    psi = 1e4 * (I1 * J ** sympy.Rational(-2, 3) - 3) + 1e5 * (J - 1) ** 2
    simulation = qlb.Simulation(qlb.TetMesh.box(cells=(2, 1, 1)), material=qlb.SymbolicMaterial(psi=psi), threads=1)
    with RunWriter(tmp_path / "run", {}, simulation) as writer:
        writer.record(simulation.advance())
    done = export_run(Run(tmp_path / "run"), tmp_path / "x.vtkhdf")
    assert done.notes == ["without stress: a material is a density of the user's own"]
    grid = read_vtkhdf(done.files[0], 0.0)
    assert grid.GetCellData().GetArray("cauchy_stress") is None
    assert array(grid.GetPointData(), "velocity").shape == (12, 3)
