"""Plots are made for every kind of run, and show what they should."""

from __future__ import annotations

from pathlib import Path
from xml.etree import ElementTree

import pytest
from PIL import Image

import qlb
from qlb.results import RunWriter, WriteError, plot_iterations, plot_residuals, plot_seconds

FEW = {
    "on_failure": "accept",
    "tolerance": qlb.Tolerance(relative=0, absolute=0, scaled=0),
    "solver_settings": qlb.SolverSettings(max_iterations=2),
}


def _text(svg: Path) -> str:
    return " ".join(ElementTree.parse(svg).getroot().itertext())


def test_pictures_of_one_run(make_run, tmp_path):
    run = make_run()
    for suffix in ("png", "svg"):
        plot_iterations({"QLB": run}, tmp_path / f"iterations.{suffix}")
        plot_residuals(run, tmp_path / f"residuals.{suffix}")
        plot_seconds(run, tmp_path / f"seconds.{suffix}")
    for png in tmp_path.glob("*.png"):
        with Image.open(png) as image:
            assert image.size[0] >= 1000
            assert len(image.convert("RGB").getcolors(1 << 24)) > 20
    assert "time step" in _text(tmp_path / "iterations.svg")
    assert "relative tolerance 1e-06" in _text(tmp_path / "residuals.svg")
    assert "factor" in _text(tmp_path / "seconds.svg")


def test_several_runs_have_a_legend_with_means(make_run, tmp_path):
    runs = {name: make_run(name, solver=name) for name in ("ND", "QLB")}
    plot_iterations(runs, tmp_path / "plot.svg")
    text = _text(tmp_path / "plot.svg")
    for name, run in runs.items():
        assert f"{name}: mean {run.summary['iterations_mean']:.3g}, max {run.summary['iterations_max']}" in text


def test_failed_steps_are_marked(make_run, tmp_path):
    run = make_run(**FEW)
    plot_iterations({"QLB": run}, tmp_path / "iterations.svg")
    text = _text(tmp_path / "iterations.svg")
    assert "3 failed" in text
    assert "did not converge" in text
    plot_residuals(run, tmp_path / "residuals.svg")
    assert "did not converge" in _text(tmp_path / "residuals.svg")


def test_two_stages_get_two_curves(make_run, tmp_path):
    run = make_run(integrator="SDIRK2")
    plot_iterations({"one": run, "two": run}, tmp_path / "plot.svg")
    text = _text(tmp_path / "plot.svg")
    assert text.count("first stage") == text.count("second stage") == 2


def test_a_run_without_steps_can_be_plotted(tmp_path, make_simulation):
    writer = RunWriter(tmp_path / "run", {}, make_simulation())
    writer.finish("interrupted")
    run = qlb.results.Run(tmp_path / "run")
    plot_iterations({"none": run}, tmp_path / "iterations.png")
    plot_residuals(run, tmp_path / "residuals.png")
    plot_seconds(run, tmp_path / "seconds.png")


def test_a_label_is_shown_as_it_is(make_run, tmp_path):
    plot_iterations({r"$\alpha$ & <_>": make_run()}, tmp_path / "plot.svg")
    assert r"$\alpha$ & <_>: mean" in _text(tmp_path / "plot.svg")


def test_a_plot_that_cannot_be_written(make_run, tmp_path):
    with pytest.raises(WriteError, match=r"cannot write .*nowhere/plot\.png: No such file"):
        plot_iterations({"QLB": make_run()}, tmp_path / "nowhere" / "plot.png")
