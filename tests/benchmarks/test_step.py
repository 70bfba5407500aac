"""The benchmarks of a step run, and their cases end in one state."""

from __future__ import annotations

from pathlib import Path

import pytest

from benchmarks import armadillo, step
from qlb import shapes

CASES = [step.BEST_ND, "QLA"]


def off(row: str) -> float:
    return float(row.strip("| ").split(" | ")[-1])


def test_the_bar(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setitem(step.CELLS, 192, "8,2,2")
    rows = step.table([192], CASES, steps=3, repeats=1).splitlines()[-2:]
    assert [row.split("`")[1] for row in rows] == CASES
    assert max(map(off, rows)) < 1e-5


def test_a_mesh_from_a_file(tmp_path: Path) -> None:
    shapes.ball(tets=500).write(tmp_path / "body.msh")
    rows = armadillo.table(tmp_path / "body.msh", CASES, steps=2, threads=1, repeats=1).splitlines()[-2:]
    assert [row.split("`")[1] for row in rows] == CASES
    assert max(map(off, rows)) < 1e-5
