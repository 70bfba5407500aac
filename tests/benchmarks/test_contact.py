"""The benchmark of contact: its scenes come into contact, and its table says what a run by hand says."""

from __future__ import annotations

import sys

import numpy as np
import pytest

import qlb
from benchmarks import __main__, contact
from qlb.studies import SolverCase


class Ended:
    """A solve that ended, of which the benchmark reads no more than this."""

    def __init__(self, iterations: int, factorizations: int, contacts: int, distance: float) -> None:
        self.iterations, self.factorizations = iterations, factorizations
        self.rows = [Row(9999, 0.0), Row(contacts, distance)]  # what is not the end must not count


class Row:
    def __init__(self, contacts: int, distance: float) -> None:
        self.contacts, self.minimum_distance = contacts, distance


class Step:
    def __init__(self, positions: list[list[float]], solves: list[Ended], converged: bool = True) -> None:
        self.positions, self.solves, self.converged = np.array(positions), solves, converged


def measured(*steps: Step, second: float) -> contact.ContactMeasurement:
    """A run whose every step takes `second`."""
    found = contact.ContactMeasurement(tets=7, extent=2.0, seconds={"candidates": 1.0, "contact": 2.0, "other": 5.0})
    for k, step in enumerate(steps, start=1):
        found.add(step, k * second)  # type: ignore[arg-type]
    return found


def test_a_row_has_means_of_stages_shares_of_a_step_and_worst_cases() -> None:
    start, end = [[0.0, 0, 0], [1, 0, 0]], [[0.0, 0, 0], [1, 3, 4]]
    first = measured(
        Step(start, [Ended(4, 3, 5, 0.2), Ended(6, 1, 2, 0.1)]), Step(end, [Ended(2, 2, 1, 0.3)]), second=3
    )
    other = measured(Step(start, [Ended(8, 0, 0, np.inf)]), Step(start, [Ended(1, 1, 0, np.inf)], False), second=1)
    rows = contact.contact_rows("scene", {"A": first, "B": other}, 2)
    assert rows[0] == [
        "scene",
        "7",
        "`A`",
        "3000.0",
        "3.00",
        "4.0",
        "2.00",
        "12 %",
        "25 %",
        "0",
        "1.0e-01",
        "5",
        "0e+00",
    ]
    assert rows[1][3:7] == ["1000.0", "1.00", "4.5", "0.50"]
    assert rows[1][9:] == ["1", "inf", "0", "2e+00"]  # a distance of 5 over an extent of 2


def test_runs_that_stop_early_are_compared_over_the_steps_of_both() -> None:
    x = [[[float(k), 0.0, 0.0]] for k in range(3)]
    whole = measured(*(Step(p, [Ended(1, 1, 0, np.inf)]) for p in x), second=2)
    short = measured(*(Step(p, [Ended(1, 1, 0, np.inf)]) for p in x[:2]), second=10)
    assert short.ratio(whole) == 5.0
    assert whole.off(short) == 0.0  # at step 2, not 3
    assert contact.contact_rows("scene", {"short": short, "whole": whole}, 3)[0][9] == "0, stopped after 2"


@pytest.mark.parametrize(("limit", "steps"), [(0.0, 1), (np.inf, 3)])
def test_a_run_stops_after_the_step_that_exceeds_its_limit(limit: float, steps: int) -> None:
    simulation = contact.squeeze(48, SolverCase.parse("QLA"), None)
    assert contact.run_case(simulation, 3, limit).steps == steps


def test_measures_what_a_run_by_hand_gives() -> None:
    found = contact.measure("squeeze", ["QLA"], contact.Amount(tets=384, steps=6))["QLA"]
    block = qlb.Body(qlb.TetMesh.box((0.2,) * 3, cells=(4,) * 3), qlb.StableNeoHookean(young=2e4, poisson=0.45))
    down = np.array([0, -0.05, 0])  # [m/s]
    planes = [
        qlb.Plane((0, -0.0015, 0), (0, 1, 0), motion=lambda x, t: x - t * down),
        qlb.Plane((0, 0.2015, 0), (0, -1, 0), motion=lambda x, t: x + t * down),
    ]
    by_hand = qlb.Simulation(block, obstacles=planes, gravity=(0, 0, 0), threads=1)
    results = list(by_hand.run(6))
    assert found.iterations == [s.iterations for r in results for s in r.solves]
    assert found.factorizations == [s.factorizations for r in results for s in r.solves]
    np.testing.assert_array_equal(found.positions[-1], results[-1].positions)
    y, moved = results[-1].positions[:, 1], 0.05 * 6 * 0.01
    gaps = np.concatenate([y - (-0.0015 + moved), (0.2015 - moved) - y])
    dhat = 0.1 * _mean_edge(block.mesh)
    assert found.contacts >= int((gaps < dhat).sum()) > 0
    assert 0 < found.distance <= gaps.min() + 1e-15 < dhat


def _mean_edge(mesh: qlb.TetMesh) -> float:
    """Of its surface [m]."""
    faces = mesh.boundary_triangles()
    edges = np.unique(np.sort(np.concatenate([faces[:, [0, 1]], faces[:, [1, 2]], faces[:, [2, 0]]]), axis=1), axis=0)
    return float(np.linalg.norm(mesh.positions[edges[:, 0]] - mesh.positions[edges[:, 1]], axis=1).mean())


def test_the_planes_close_to_half() -> None:
    low, high = contact.squeeze(48, SolverCase.parse("QLA"), None).assembly.planes
    gaps = [float(high.point_at(t)[1] - low.point_at(t)[1]) for t in (0.0, 0.5, 1.0, 2.0)]
    assert gaps == pytest.approx([0.203, 0.153, 0.103, 0.103])


def test_prints_a_row_for_each_scene_and_solver(
    monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    options = ["contact", "--tets", "600", "--steps", "2", "--repeats", "1"]
    monkeypatch.setattr(sys, "argv", ["benchmarks", *options])
    __main__.main()
    lines = [line.strip("| ").split(" | ") for line in capsys.readouterr().out.splitlines() if line.startswith("|")]
    title, rows = lines[0], [dict(zip(lines[0], row, strict=True)) for row in lines[2:]]
    assert [(row["scene"], row["solver"].strip("`").split(":")[0]) for row in rows] == [
        (scene, solver) for scene in ("bunny", "ducks", "squeeze") for solver in ("ND", "QLB", "QLA")
    ]
    assert {row["failed steps"] for row in rows} == {"0"}
    assert all(float(row[title[-1]]) < 0.01 for row in rows)
    assert all(int(row["most contacts"]) > 0 for row in rows if row["scene"] == "squeeze")


def test_names_a_scene_that_does_not_exist() -> None:
    with pytest.raises(qlb.InputError, match="'rabbit' is not known: must be one of bunny, ducks, squeeze"):
        contact.measure("rabbit", ["QLA"], contact.Amount())
