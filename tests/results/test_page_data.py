"""Data of pages: a plain reading of the packed arrays gives them back, and pages stay as small as they are told to."""

from __future__ import annotations

import base64
import json
import zlib
from pathlib import Path

import numpy as np
import pytest

import qlb
from qlb.results import Run, RunWriter, finish_run
from qlb.results.page import Animation, page_content, run_charts
from qlb.results.page.packing import Quantised, numbers, pack, positions_data
from qlb.results.page.thinning import merge_vertices, spread


def unpack(text: str, size: int, columns: int) -> np.ndarray:
    """Byte by byte and number by number, as the docstring of `pack` says it."""
    data = zlib.decompress(base64.b64decode(text))
    count, bits = len(data) // size, 8 * size
    values: list[int] = []
    for i in range(count):
        folded = sum(data[plane * count + i] << (8 * plane) for plane in range(size))
        difference = folded // 2 if folded % 2 == 0 else -(folded + 1) // 2
        values.append(((values[i - columns] if i >= columns else 0) + difference) % 2**bits)
    return np.reshape(values, (-1, columns))


@pytest.mark.parametrize("kind", [np.uint8, np.uint16, np.uint32])
def test_packed_integers_come_back(kind):
    random = np.random.default_rng(0)
    rows = random.integers(0, np.iinfo(kind).max, size=(7, 12), dtype=kind, endpoint=True)
    rows[3] = np.iinfo(kind).max
    rows[4] = 0
    np.testing.assert_array_equal(unpack(pack(rows), rows.itemsize, 12), rows)


def test_smooth_motion_packs_well():
    time = np.linspace(0, 1, 100)[:, None]
    smooth = (30000 + 20000 * np.sin(3 * time + np.linspace(0, 5, 900))).astype(np.uint16)
    assert len(pack(smooth)) < 0.75 * smooth.nbytes


def test_positions_are_off_by_half_a_65535th_of_their_box():
    x = np.random.default_rng(1).normal(size=(4, 30, 3)) * [1.0, 10.0, 0.01]
    data = positions_data(x)
    integers = unpack(data["data"], 2, 90).reshape(4, 3, 30).transpose(0, 2, 1)
    low, high = np.array(data["low"]), np.array(data["high"])
    off = np.abs(low + integers * (high - low) / 65535 - x).max(axis=(0, 1))
    half = 0.5 * np.ptp(x, axis=(0, 1)) / 65535
    assert (off <= half * (1 + 1e-9)).all()
    assert (off > 0.5 * half).all()


def test_a_field_without_range_is_its_value():
    flat = Quantised.of(np.full((2, 3), 4.0), 4.0, 4.0, bits=8)
    np.testing.assert_array_equal(flat.integers, 0)


def test_numbers_for_json():
    assert numbers(np.array([1.23456789, np.nan, np.inf])) == [1.23457, None, None]
    assert numbers(np.array([3, 4])) == [3, 4]


def test_spread_keeps_both_ends():
    assert spread(range(10), 20) == list(range(10))
    assert spread(range(101), 5) == [0, 25, 50, 75, 100]
    assert spread([3, 5, 9], 2) == [3, 9]


def test_merged_vertices_keep_the_shape():
    mesh = qlb.TetMesh.box((1, 1, 1), cells=(20, 20, 20))
    surface = mesh.rendered()
    x = surface.of_nodes(mesh.positions)
    kept, triangles = merge_vertices(x, surface.triangles, 600)
    assert 150 < len(kept) <= 600
    corners = x[kept][triangles]
    volume = np.einsum("ti,ti->t", corners[:, 0], np.cross(corners[:, 1], corners[:, 2])).sum() / 6
    assert volume == pytest.approx(1, abs=0.25)
    everything, same = merge_vertices(x, surface.triangles, len(x))
    np.testing.assert_array_equal(everything, np.arange(len(x)))
    np.testing.assert_array_equal(same, surface.triangles)


def make_frames(folder: Path, cells: tuple[int, int, int], frames: int) -> Run:
    """A run of one step whose frame is there many times, each shaken anew: nothing packs worse."""
    mesh = qlb.TetMesh.box((1, 0.25, 0.25), cells=cells)
    simulation = qlb.Simulation(mesh, material=qlb.StableNeoHookean(), threads=1)
    simulation.pin(mesh.nodes_where(lambda x: x[:, 0] < 1e-9))
    with RunWriter(folder, {"scene": "shaken"}, simulation) as writer:
        writer.record(simulation.advance())
    random = np.random.default_rng(2)
    first = dict(np.load(folder / "frames" / "000001.npz"))
    for step in range(1, frames):
        shaken = first["positions"] + 1e-3 * random.normal(size=first["positions"].shape)
        arrays = {**first, "step": step, "time": 0.01 * step, "positions": shaken, "velocities": shaken}
        np.savez(folder / "frames" / f"{step:06d}.npz", **arrays)
    return Run(folder)


@pytest.mark.slow
def test_a_hundred_frames_of_5k_tets_fit_into_15_megabytes(tmp_path):
    run = make_frames(tmp_path / "run", (24, 6, 6), 101)
    assert len(run.mesh.tets) >= 5000
    report = finish_run(run.directory, picture=False)["report"]
    assert report.stat().st_size < 15e6
    assert "To keep the page small" not in report.read_text(encoding="utf-8")


def test_frames_and_vertices_are_left_out_to_keep_a_page_small(tmp_path):
    run = make_frames(tmp_path / "run", (8, 2, 2), 101)
    content = page_content({"run": run}, most_bytes=60_000)
    animation = json.loads(content)["animations"][0]
    steps = animation["chunks"][0]["steps"]
    assert len(content) < 75_000
    assert 20 < len(steps) < 101
    assert (steps[0], steps[-1]) == (0, 100)
    assert f"{len(steps)} of 101 frames" in animation["note"]
    assert "merged" in json.loads(page_content({"run": run}, most_bytes=20_000))["animations"][0]["note"]
    with pytest.raises(qlb.InputError, match="too small"):
        page_content({"run": run}, most_bytes=0)


def test_outliers_do_not_take_the_colours_from_the_rest(tmp_path):
    run = make_frames(tmp_path / "run", (4, 1, 1), 30)
    spike = dict(np.load(run.directory / "frames" / "000007.npz"))
    spike["velocities"][5] = [1000, 0, 0]
    np.savez(run.directory / "frames" / "000007.npz", **spike)
    speed = Animation(run).chunk(run.frame_steps)["fields"][0]
    assert speed["name"] == "speed"
    assert speed["largest"] == pytest.approx(1000)
    assert speed["high"] < 2


def test_charts_follow_the_statistics(make_run):
    run = make_run(steps=4, integrator="SDIRK2")
    charts = run_charts(run)
    assert [curve["name"] for curve in charts["iterations"]] == ["first stage", "second stage"]
    assert sum(sum(curve["values"]) for curve in charts["iterations"]) == pytest.approx(
        4 * run.summary["iterations_mean"]
    )
    assert sum(charts["factorizations"]["values"]) == run.summary["factorizations"]
    assert len(charts["residuals"]["lines"]) == charts["residuals"]["solves"] == 8
    assert charts["contact"] is None
    assert sum(map(sum, (part["values"] for part in charts["seconds"]["parts"]))) == pytest.approx(
        sum(run.stats[name].sum() for name in run.stats if name.startswith("seconds_")), rel=1e-4
    )
