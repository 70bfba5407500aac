"""Nanoseconds per tetrahedron of the element kernels, at each SIMD level; and the factor's GFlop/s and GB/s."""

from __future__ import annotations

from collections.abc import Callable
from time import perf_counter

import numpy as np
import sympy

import qlb
from benchmarks.machine import machine_line, markdown
from qlb import _native
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
            seconds = [
                best_seconds(lambda e=energy: e.value(x)),
                best_seconds(lambda e=energy: e.add_value_gradient(x, 1.0, gradient)),
                best_seconds(lambda e=energy: e.add_hessian(x, 1.0, False, matrix)),
                best_seconds(lambda e=energy: e.add_hessian(x, 1.0, True, matrix)),
            ]
            rows.append([str(workers), level, name, *(f"{1e9 * s / count:.1f}" for s in seconds)])
    header = ["threads", "SIMD", "material", "energy", "energy + gradient", "Hessian", "Hessian, projected"]
    where = machine_line(max(threads))
    return f"### Element kernels, ns per tet\n\n{count} tets. {where}.\n\n{markdown(header, rows)}"


def symbolic_stable_neo_hookean(built_in: qlb.StableNeoHookean) -> qlb.SymbolicMaterial:
    """The same material, interpreted from its SymPy expression."""
    I1, _, J = qlb.SymbolicMaterial.invariants
    mu, lam = sympy.symbols("mu lam", positive=True)
    alpha = 1 + sympy.Rational(3, 4) * mu / lam
    psi = mu / 2 * (I1 - 3) + lam / 2 * (J - alpha) ** 2 - mu / 2 * sympy.log(I1 + 1)
    return qlb.SymbolicMaterial(psi=psi, parameters=dict(zip(("mu", "lam"), built_in.kernel_parameters(), strict=True)))


def factor_table(threads: list[int], sizes: list[str]) -> str:
    """Factorisation and solve of the bar's stage Hessian."""
    rows = []
    for cells in sizes:
        mesh = TetMesh.box(cells=tuple(map(int, cells.split(","))))  # type: ignore[arg-type]
        for workers in threads:
            simulation = qlb.Simulation(mesh, material=qlb.StableNeoHookean(), threads=workers)
            simulation.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
            system, matrix = simulation.system, _native.BlockMatrix(simulation.system.pattern)
            system.elastic.add_hessian(mesh.positions, 1e-4, True, matrix)
            system.inertia.add_hessian(1.0, matrix)
            factor, b = system.analyse(), np.ones_like(mesh.positions)
            x = np.empty_like(b)
            made = best_seconds(lambda f=factor, a=matrix: f.factorise(a))
            solved = best_seconds(lambda f=factor, x=x, b=b: f.apply(b, x))
            rows.append(
                [
                    str(len(mesh.tets)),
                    str(workers),
                    f"{factor.factor_nonzeros / 1e6:.2f}",
                    f"{1e3 * made:.2f}",
                    f"{factor.factor_flops / made / 1e9:.1f}",
                    f"{1e3 * solved:.2f}",
                    f"{16 * factor.factor_nonzeros / solved / 1e9:.1f}",
                ]
            )
    header = ["tets", "threads", "nnz(L) 1e6", "factor ms", "GFlop/s", "solve ms", "GB/s"]
    return f"### Factor and solve (CHOLMOD)\n\n{machine_line(max(threads))}.\n\n{markdown(header, rows)}"
