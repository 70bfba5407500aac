"""`qlb mesh`: what a mesh file holds, tets in a surface, tets in another format."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from pathlib import Path

import numpy as np
from rich.markup import escape
from rich.table import Table

from qlb.cli.output import console, errors
from qlb.errors import InputError
from qlb.mesh import MeshQuality, SurfaceReport, TetMesh
from qlb.mesh.files import MeshFile
from qlb.mesh.filling import fill
from qlb.mesh.surface import repair


def mesh_file(
    source: Path,
    target: Path | None,
    *,
    edge: float | None,
    tets: int | None,
    scale: float | None,
    height: float | None,
    overwrite: bool,
) -> None:
    """Read `source`, print what it is, and where there is a target, fill it with tets if need be and write them."""
    if target is not None and target.exists() and not overwrite:
        raise InputError(f"{target} exists; --overwrite replaces it")
    if target is not None and not target.absolute().parent.is_dir():
        raise InputError(f"{target} cannot be written: its folder does not exist")
    with errors.status(f"Reading {escape(source.name)}"):
        file = scaled(MeshFile.read(source), scale, height)
    if len(file.tets):
        if edge is not None or tets is not None:
            raise InputError(f"{source} holds tets already: --edge and --tets are for surfaces")
        positions, cells, regions = file.used_tets()
        mesh = TetMesh(positions, cells, regions=regions)
    else:
        vertices, triangles = file.surface()
        if target is None:
            _print_surface(source, repair(vertices, triangles)[1], np.ptp(vertices, axis=0).tolist())
            return
        with errors.status(f"Filling {escape(source.name)} with tets"):
            mesh = fill(source.name, vertices, triangles, edge=edge, tets=tets)
    _print_tets(source, mesh)
    if target is not None:
        mesh.write(target)
        console.print(f"written     {escape(str(target))}", soft_wrap=True, highlight=False)


def scaled(file: MeshFile, scale: float | None, height: float | None) -> MeshFile:
    """What the file holds, times `scale`, or `height` [m] along y."""
    if scale is not None and height is not None:
        raise InputError("give either --scale or --height, not both")
    for name, value in (("scale", scale), ("height", height)):
        if value is not None and not (np.isfinite(value) and value > 0):
            raise InputError(f"--{name} {value!r} is out of range: must be > 0")
    if height is not None:
        used = file.points[np.unique(file.tets if len(file.tets) else file.triangles)]
        tall = float(np.ptp(used[:, 1])) if len(used) else 0.0
        if not (np.isfinite(tall) and tall > 0):
            raise InputError(f"{file.path} has the height {tall:g} along y, which cannot be scaled to --height")
        scale = height / tall
    return file if scale is None else replace(file, points=file.points * scale)


def _print_tets(source: Path, mesh: TetMesh) -> None:
    table = _table(source.name)
    if mesh.report is not None:
        _add_rows(table, mesh.report.rows())
        table.add_section()
    _add_rows(table, MeshQuality.of(mesh).rows())
    if mesh.regions is not None:
        table.add_row("regions", f"{len(np.unique(mesh.regions))}")
    console.print(table)


def _print_surface(source: Path, found: SurfaceReport, size: list[float]) -> None:
    table = _table(source.name)
    _add_rows(table, found.rows())
    table.add_row("size", " x ".join(f"{length:.4g}" for length in size) + " m")
    console.print(table)
    for note in found.notes():
        errors.print(f"[yellow]note:[/] {escape(source.name)}: {escape(note)}", soft_wrap=True, highlight=False)


def _table(name: str) -> Table:
    return Table("", escape(name), show_header=True, title_justify="left")


def _add_rows(table: Table, rows: Sequence[tuple[str, str]]) -> None:
    for name, value in rows:
        table.add_row(name, value)
