"""Nanoseconds per tetrahedron of the element kernels, at each SIMD level; and the factors' speed."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from time import perf_counter, process_time

import numpy as np
import sympy

import qlb
from benchmarks.machine import machine_line, markdown
from benchmarks.pardiso import Pardiso, find_mkl, upper_triangle
from qlb import _native
from qlb.arrays import FloatArray
from qlb.materials import MATERIALS, Material
from qlb.mesh import TetMesh


def best_seconds(run: Callable[[], object], repeats: int = 7) -> float:
    """The fastest of several runs."""
    best = float("inf")
    for _ in range(repeats):
        start = perf_counter()
        run()
        best = min(best, perf_counter() - start)
    return best


def element_table(threads: list[int], cells: tuple[int, int, int] = (82, 20, 20)) -> str:
    """Energy, energy with gradient, exact and projected Hessian (assembly included), in ns per tet."""
    mesh = TetMesh.box(cells=cells)
    count = len(mesh.tets)
    pattern = _native.BlockPattern(len(mesh.positions), mesh.tets)
    blocks = _native.TetBlocks(mesh.positions, mesh.tets, pattern)
    snh, best = qlb.StableNeoHookean(), _native.simd_levels()[-1]
    others = {name: material() for name, material in MATERIALS.items() if name != "SNH"}
    others["SNH, symbolic"] = symbolic_stable_neo_hookean(snh)
    cases: list[tuple[str, str, Material]] = [(level, "SNH", snh) for level in _native.simd_levels()]
    cases += [(best, name, material) for name, material in others.items()]
    x = mesh.positions + 1e-3 * np.random.default_rng(0).standard_normal(mesh.positions.shape)
    gradient, matrix = np.zeros_like(x), _native.BlockMatrix(pattern)
    rows = []
    for workers in threads:
        for level, name, material in cases:
            table = material.parameter_table(count)
            energy = _native.ElasticEnergy(blocks, material.kernels, table, workers, level, material.program())
            seconds = kernel_seconds(energy, x, gradient, matrix)
            rows.append([str(workers), level, name, *(f"{1e9 * s / count:.1f}" for s in seconds)])
    header = ["threads", "SIMD", "material", "energy", "energy + gradient", "Hessian", "Hessian, projected"]
    where = machine_line(max(threads))
    return f"### Element kernels, ns per tet\n\n{count} tets. {where}.\n\n{markdown(header, rows)}"


def kernel_seconds(
    energy: _native.ElasticEnergy, x: FloatArray, gradient: FloatArray, matrix: _native.BlockMatrix
) -> list[float]:
    """Of the energy, the energy with its gradient, the exact Hessian and the projected one."""
    return [
        best_seconds(lambda: energy.value(x)),
        best_seconds(lambda: energy.add_value_gradient(x, 1.0, gradient)),
        best_seconds(lambda: energy.add_hessian(x, 1.0, False, matrix)),
        best_seconds(lambda: energy.add_hessian(x, 1.0, True, matrix)),
    ]


def symbolic_stable_neo_hookean(built_in: qlb.StableNeoHookean) -> qlb.SymbolicMaterial:
    """The same material, interpreted from its SymPy expression."""
    I1, _, J = qlb.SymbolicMaterial.invariants
    mu, lam = sympy.symbols("mu lam", positive=True)
    alpha = 1 + sympy.Rational(3, 4) * mu / lam
    psi = mu / 2 * (I1 - 3) + lam / 2 * (J - alpha) ** 2 - mu / 2 * sympy.log(I1 + 1)
    return qlb.SymbolicMaterial(psi=psi, parameters=dict(zip(("mu", "lam"), built_in.kernel_parameters(), strict=True)))


@dataclass
class Rival:
    """One kind of factor: how to run it, and what it reads of L in a solve."""

    name: str
    factorise: Callable[[], object]
    solve: Callable[[], object]
    flops: float = float("nan")
    solve_bytes: float = float("nan")


def read_bandwidth(threads: int) -> float:
    """Bytes per second at which memory is read, in the manner of STREAM: an array far larger than the L2 caches."""
    a = np.ones(1 << 25)
    return a.nbytes / best_seconds(lambda: _native.dot(a, a, threads))


def rivals(mesh: TetMesh, workers: int) -> list[Rival]:
    """Every kind of factor of the bar's stage Hessian; CHOLMOD first."""
    simulation = qlb.Simulation(mesh, material=qlb.StableNeoHookean(), threads=workers)
    simulation.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
    system, matrix = simulation.system, _native.BlockMatrix(simulation.system.pattern)
    system.elastic.add_hessian(mesh.positions, 1e-4, True, matrix)
    system.inertia.add_hessian(1.0, matrix)
    held = (mesh.positions[:, :1] < 1e-9).repeat(3, axis=1).astype(np.uint8)
    b, x = np.ones_like(mesh.positions), np.empty_like(mesh.positions)

    def rival(name: str, factor: _native.Cholesky, read: float) -> Rival:
        return Rival(name, lambda: factor.factorise(matrix), lambda: factor.apply(b, x), factor.factor_flops, read)

    cholmod = _native.CholmodCholesky(system.pattern, held, workers)
    found = [rival("CHOLMOD float64", cholmod, 16.0 * cholmod.factor_nonzeros)]
    for precision in ("float64", "float32", "compact"):
        ours = _native.SupernodalCholesky(system.pattern, held, workers, precision)
        found.append(rival(f"ours {precision}", ours, ours.solve_bytes))
    if workers == 1 and (mkl := find_mkl()):
        pardiso = Pardiso(mkl, upper_triangle(matrix, system.pattern, held.ravel() == 0))
        found.append(Rival("PARDISO float64", pardiso.factorise, pardiso.solve))
    return found


def interleaved_seconds(
    runs: list[Callable[[], object]], workers: int, repeats: int = 9, in_a_row: int = 1
) -> list[float]:
    """The median of each; of CPU time with one thread, so that other jobs of the machine count little.

    Of runs `in_a_row` the first does not count: it finds the caches as another left them.
    """
    clock = process_time if workers == 1 else perf_counter
    seconds: list[list[float]] = [[] for _ in runs]
    for _ in range(repeats):
        for run, taken in zip(runs, seconds, strict=True):
            for again in range(in_a_row):
                start = clock()
                run()
                if again or in_a_row == 1:
                    taken.append(clock() - start)
    return [float(np.median(taken)) for taken in seconds]


def factor_table(threads: list[int], sizes: list[str]) -> str:
    """Factorisation and solve of the bar's stage Hessian, each kind against CHOLMOD and against memory."""
    rows = []
    for cells in sizes:
        mesh = TetMesh.box(cells=tuple(map(int, cells.split(","))))  # type: ignore[arg-type]
        for workers in threads:
            kinds, bandwidth = rivals(mesh, workers), read_bandwidth(workers)
            made = interleaved_seconds([kind.factorise for kind in kinds], workers)
            solves = [kind.solve for kind in kinds]
            solved = interleaved_seconds(solves, workers, repeats=7, in_a_row=5)
            after_others = interleaved_seconds(solves, workers, repeats=25)
            for kind, factor, solve, cold in zip(kinds, made, solved, after_others, strict=True):
                rows.append(
                    [
                        f"{len(mesh.tets)}",
                        f"{workers}",
                        kind.name,
                        f"{1e3 * factor:.2f}",
                        f"{made[0] / factor:.2f}",
                        f"{kind.flops / factor / 1e9:.1f}",
                        f"{1e3 * solve:.3f}",
                        f"{solved[0] / solve:.2f}",
                        f"{kind.solve_bytes / solve / 1e9:.1f}",
                        f"{kind.solve_bytes / solve / bandwidth:.2f}",
                        f"{kind.solve_bytes / cold / bandwidth:.2f}",
                    ]
                )
    header = [
        "tets",
        "threads",
        "factor",
        "ms",
        "speed-up",
        "GFlop/s",
        "solve ms",
        "speed-up",
        "GB/s",
        "of memory",
        "cold",
    ]
    note = (
        'Speed-ups over CHOLMOD; "of memory": L read twice, against the bandwidth of reading 256 MB, for solves in a'
        ' row; "cold": with those of the others in between.'
    )
    return f"### Factor and solve\n\n{note} {machine_line(max(threads))}.\n\n{markdown(header, rows)}"
