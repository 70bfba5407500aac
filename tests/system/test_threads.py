"""The energies and long-vector sums give the same bits for any number of threads."""

from __future__ import annotations

import numpy as np
import pytest

from qlb import Simulation, StableNeoHookean, TetMesh, _native
from tests.support import Array, elastic_gradient, elastic_hessian, finish, left_end, make_system

THREADS = [2, 3, 8]


@pytest.fixture(scope="module")
def mesh() -> TetMesh:
    # 6144 tets are 12 chunks: enough for three threads.
    return TetMesh.box((1.0, 0.5, 0.5), cells=(16, 8, 8))


@pytest.fixture(scope="module")
def large_mesh() -> TetMesh:
    # 12 615 nodes: sums over nodes (9 groups) and over degrees of freedom (5 groups) go parallel too.
    return TetMesh.box((1.0, 0.5, 0.5), cells=(28, 20, 20))


def shaken(mesh: TetMesh) -> Array:
    return mesh.positions + 0.01 * np.random.default_rng(1).normal(size=mesh.positions.shape)


@pytest.mark.parametrize("threads", THREADS)
@pytest.mark.parametrize("level", _native.simd_levels())
def test_elastic_energy(mesh: TetMesh, threads: int, level: str) -> None:
    x, material = shaken(mesh), StableNeoHookean()
    pattern = _native.BlockPattern(len(x), mesh.tets)
    blocks = _native.TetBlocks(mesh.positions, mesh.tets, pattern)
    results = []
    for count in (1, threads):
        energy = _native.ElasticEnergy(blocks, material.model, material.parameter_table(len(mesh.tets)), count, level)
        gradient, exact, projected = np.zeros_like(x), _native.BlockMatrix(pattern), _native.BlockMatrix(pattern)
        value = energy.add_value_gradient(x, 0.5, gradient)
        energy.add_hessian(x, 0.5, False, exact)
        energy.add_hessian(x, 0.5, True, projected)
        results.append((energy.value(x), value, gradient, exact.values.copy(), projected.values.copy()))
    for one, many in zip(*results, strict=True):
        np.testing.assert_array_equal(one, many)


@pytest.mark.parametrize("threads", THREADS)
def test_repeated_evaluation(mesh: TetMesh, threads: int) -> None:
    system, x = make_system(mesh, threads=threads), shaken(mesh)
    first = elastic_gradient(system, x), elastic_hessian(system, x, project=True).values.copy()
    for _ in range(5):
        np.testing.assert_array_equal(elastic_gradient(system, x), first[0])
        np.testing.assert_array_equal(elastic_hessian(system, x, project=True).values, first[1])


@pytest.mark.parametrize("threads", THREADS)
@pytest.mark.parametrize("mass", ["lumped", "consistent"])
def test_inertia(large_mesh: TetMesh, threads: int, mass: str) -> None:
    x, target = shaken(large_mesh), large_mesh.positions
    results = []
    for count in (1, threads):
        gradient = np.zeros_like(x)
        inertia = make_system(large_mesh, mass=mass, threads=count).inertia
        results.append((inertia.add_value_gradient(x, target, 1.0, gradient), gradient))
    for one, many in zip(*results, strict=True):
        np.testing.assert_array_equal(one, many)


@pytest.mark.parametrize("threads", THREADS)
@pytest.mark.parametrize("size", [1, 8191, 8192, 8193, 200_000])
def test_inner_product(threads: int, size: int, rng: np.random.Generator) -> None:
    a, b = rng.normal(size=(2, size))
    one = _native.dot(a, b, 1)
    assert _native.dot(a, b, threads) == one
    assert one == pytest.approx(float(a @ b), rel=0, abs=1e-13 * float(np.abs(a) @ np.abs(b)))


@pytest.mark.parametrize("solver", ["ND", "QLB", "QLA"])
def test_a_whole_run(mesh: TetMesh, solver: str) -> None:
    ends = []
    for threads in (1, 2):
        simulation = Simulation(mesh, material=StableNeoHookean(), solver=solver, threads=threads)
        simulation.pin(left_end(mesh))
        ends.append(finish(simulation, 3))
    np.testing.assert_array_equal(ends[0].positions, ends[1].positions)
    np.testing.assert_array_equal(ends[0].velocities, ends[1].velocities)


@pytest.mark.slow
def test_threads_inside_a_large_factor_change_rounding_only() -> None:
    # From 1e9 operations on the factor gives BLAS all threads, whose sums depend on how many there are; two runs with
    # the same number agree to the bit all the same.
    mesh = TetMesh.box((1.0, 0.5, 0.5), cells=(24, 12, 12))
    ends = []
    for threads in (1, 2, 2):
        simulation = Simulation(mesh, material=StableNeoHookean(), solver="QLB", threads=threads)
        simulation.pin(left_end(mesh))
        ends.append(finish(simulation, 2).positions)
        assert simulation.solver.factor.cholesky.factor_flops > 1e9
    np.testing.assert_array_equal(ends[1], ends[2])
    np.testing.assert_allclose(ends[0], ends[1], rtol=0, atol=1e-12)
