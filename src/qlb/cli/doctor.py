"""`qlb doctor`: what this installation is made of, and whether it works."""

from __future__ import annotations

import os
import platform
from importlib.metadata import PackageNotFoundError, version

import numpy as np

import qlb
from qlb import _native
from qlb.cli.output import console, errors
from qlb.simulation import available_threads

PACKAGES = ("numpy", "pydantic", "typer", "matplotlib", "meshio", "pyvista", "vtk")


def examine() -> int:
    """Print versions and the results of a few checks; 0 if all is well, else 1."""
    levels = _native.simd_levels()
    facts = {
        "qlb": qlb.__version__,
        "Python": f"{platform.python_version()} on {platform.platform()}",
        **{package: _version(package) for package in PACKAGES},
        **_native.libraries(),
        "SIMD level": f"{levels[-1]} (built and usable: {', '.join(levels)})",
        "threads": f"{available_threads()} of {os.cpu_count()} CPUs",
        "OMP_WAIT_POLICY": os.environ.get("OMP_WAIT_POLICY", "not set"),
    }
    for name, value in facts.items():
        console.print(f"{name:<16} {value}", soft_wrap=True, highlight=False, markup=False)
    problems = [*_check_solve(), *_check_levels()]
    for problem in problems:
        errors.print(f"[red]problem:[/] {problem}", soft_wrap=True)
    if not problems:
        console.print("[green]all checks passed[/]: a step converges, and every SIMD level agrees")
    return 1 if problems else 0


def _version(package: str) -> str:
    try:
        return version(package)
    except PackageNotFoundError:
        return 'not installed (pip install "qlb[view]" for pictures)'


def _check_solve() -> list[str]:
    mesh = qlb.TetMesh.box(cells=(4, 1, 1))
    simulation = qlb.Simulation(mesh, material=qlb.StableNeoHookean())
    simulation.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
    try:
        simulation.advance()
    except qlb.QlbError as error:
        return [str(error)]
    return []


def _check_levels() -> list[str]:
    F = np.eye(3) + 0.3 * np.random.default_rng(1).standard_normal((16, 3, 3))
    material = qlb.StableNeoHookean()
    expected = material.evaluate(F, project=True, simd_level=_native.simd_levels()[0])
    return [
        f"SIMD level {level} disagrees with {_native.simd_levels()[0]}"
        for level in _native.simd_levels()[1:]
        if not all(
            np.allclose(a, b, rtol=1e-9, atol=1e-6)
            for a, b in zip(material.evaluate(F, project=True, simd_level=level), expected, strict=True)
        )
    ]
