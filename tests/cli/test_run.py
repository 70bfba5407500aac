"""`qlb run`, `report`, `scenes` and `doctor`: exit status, files, refusals."""

from __future__ import annotations

import csv
import json
import os
import signal
import subprocess
import sys
import time
from importlib.metadata import version
from pathlib import Path

import numpy as np
import pytest

from qlb.cli.main import main
from qlb.scenes import SCENES

SMALL = ["--set", "mesh.cells=4,1,1", "--steps", "3", "--threads", "1"]


@pytest.fixture
def qlb(monkeypatch, tmp_path, capsys):
    """Call `qlb ARGUMENTS` in an empty folder: (exit status, stdout, stderr)."""
    monkeypatch.chdir(tmp_path)

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["qlb", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        streams = capsys.readouterr()
        return int(end.value.code or 0), streams.out, streams.err

    return call


def test_run_leaves_everything_it_names(qlb, tmp_path):
    status, out, _ = qlb("run", "bar", *SMALL)
    assert status == 0
    folder = tmp_path / "runs" / "bar-001"
    for name in ("scene.yaml", "stats.csv", "summary.json", "report.html", "checkpoint.npz"):
        assert (folder / name).stat().st_size > 0, name
    named = [line.split(maxsplit=1)[1] for line in out.splitlines() if "runs/" in line]
    assert len(named) >= 3
    assert all((tmp_path / path).is_file() for path in named)


def test_summary_agrees_with_the_statistics(qlb, tmp_path):
    qlb("run", "bar", *SMALL, "--out", "out", "--no-picture")
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    rows = list(csv.DictReader((tmp_path / "out" / "stats.csv").read_text().splitlines()))
    assert (summary["steps"], summary["converged"]) == (3, True)
    assert summary["factorizations"] == sum(int(row["factorizations"]) for row in rows)
    last = {(row["step"], row["stage"]): int(row["iteration"]) for row in rows}
    assert summary["iterations_mean"] == pytest.approx(sum(last.values()) / 3)


def test_a_run_takes_the_next_free_folder(qlb, tmp_path):
    (tmp_path / "runs" / "bar-001").mkdir(parents=True)
    qlb("run", "bar", *SMALL, "--no-picture")
    assert sorted(p.name for p in (tmp_path / "runs").iterdir()) == ["bar-001", "bar-002"]


def test_folder_with_a_run_is_refused_and_left_alone(qlb, tmp_path):
    qlb("run", "bar", *SMALL, "--out", "out", "--no-picture")
    before = {p: p.stat().st_mtime_ns for p in (tmp_path / "out").rglob("*")}
    status, _, err = qlb("run", "bar", *SMALL, "--out", "out")
    assert status == 2
    assert len(err.strip().splitlines()) == 1
    assert "out" in err
    assert "--overwrite" in err
    assert before == {p: p.stat().st_mtime_ns for p in (tmp_path / "out").rglob("*")}
    assert qlb("run", "bar", *SMALL, "--out", "out", "--overwrite", "--no-picture")[0] == 0


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        (["run", "ball"], ["'ball'", "bar"]),
        (["run", "bar", "--set", "material.yung=1"], ["material.yung", "material.young"]),
        (["run", "bar", "--set", "material.young=0"], ["material.young", "0", "> 0 Pa"]),
        (["run", "bar", "--set", "material.young=-2e4"], ["material.young", "-20000", "> 0 Pa"]),
        (["run", "bar", "--set", "material.young=.nan"], ["material.young", "nan", "> 0 Pa"]),
        (["run", "bar", "--set", "material.poisson=0.5"], ["material.poisson", "0.5", "> -1 and < 0.5"]),
        (["run", "bar", "--set", "material.poisson=-1"], ["material.poisson", "-1", "> -1 and < 0.5"]),
        (["run", "bar", "--set", "step=0"], ["step", "0", "> 0 s"]),
        (["run", "bar", "--set", "step=-1e-2"], ["step", "-0.01", "> 0 s"]),
        (["run", "bar", "--steps", "0"], ["steps", "0", ">= 1"]),
        (["run", "bar", "--set", "steps=2.5"], ["steps", "2.5", "whole number"]),
        (["run", "bar", "--solver", "QLX"], ["solver", "'QLX'", "ND, QLF, QLB"]),
        (["run", "bar", "--integrator", "RK4"], ["integrator", "'RK4'", "BDF1, BDF2, SDIRK2, quasistatic"]),
        (["run", "bar", "--set", "variant=fall"], ["variant", "'fall'", "'drop' or 'twist'"]),
        (["run", "bar", "--set", "mesh.cells=0,1,1"], ["(0, 1, 1)", ">= 1"]),
        (["run", "bar", "--set", "mesh.size=1,0,1"], ["(1.0, 0.0, 1.0)", "> 0 m"]),
        (["run", "bar", "--set", "step"], ["'step'", "KEY=VALUE"]),
        (["run", "bar", "--set", "loads.presure=[]"], ["loads.presure", "loads.pressure"]),
        (["run", "bar", "--set", "loads.pressure=[{faces: x > 2, value: 1}]"], ["loads.pressure.0.faces", "[0, 1]"]),
        (["run", "bar", "--set", "loads.gravity={times: [0, 0], values: [1, 2]}"], ["loads.gravity", "increase"]),
        (["run", "bar", "--set", "loads.gravity=0,t +,0"], ["loads.gravity", "'t +'", "not a formula"]),
        (["run", "bar", "--set", "mesh.path=nowhere.msh"], ["nowhere.msh", "does not exist"]),
        (["compare", "bar", "--solvers", "ND,ND"], ["ND", "once"]),
        (["compare", "bar", "--solvers", "ND:speed=9"], ["solver_settings.speed"]),
        (["scenes", "--show", "ball"], ["'ball'", "bar"]),
        (["report", "nothing-here"], ["nothing-here"]),
    ],
)
def test_wrong_input_is_one_line_and_exit_status_2(qlb, tmp_path, arguments, words):
    status, _, err = qlb(*arguments)
    assert status == 2
    assert len(err.strip().splitlines()) == 1, err
    for word in words:
        assert word in err
    assert list(tmp_path.iterdir()) == []


@pytest.mark.parametrize(
    ("points", "tet", "words"),
    [
        ([[0, 0, 0], [0, 1, 0], [1, 0, 0], [0, 0, 1]], [0, 1, 2, 3], ["tet 0", "inverted", "> 0"]),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 1, 0]], [0, 1, 2, 3], ["tet 0", "flat"]),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, 1]], [0, 1, 2, 2], ["tet 0", "twice"]),
        ([[0, 0, 0], [1, 0, 0], [0, 1, 0], [0, 0, float("nan")]], [0, 1, 2, 3], ["node 3", "nan", "finite"]),
    ],
)
def test_bad_mesh_file_is_refused(qlb, tmp_path, points, tet, words):
    import meshio

    meshio.write(tmp_path / "bad.vtu", meshio.Mesh(points, [("tetra", [tet])]))
    status, _, err = qlb("run", "bar", "--set", "mesh.path=bad.vtu", "--out", "out")
    assert status == 2
    assert len(err.strip().splitlines()) == 1
    assert all(word in err for word in words), err
    assert not (tmp_path / "out").exists()


def test_failed_step_gives_exit_status_1_and_keeps_what_is_done(qlb, tmp_path):
    status, out, _ = qlb(
        "run",
        "bar",
        *SMALL,
        "--set",
        "solver_settings.max_iterations=1",
        "--solver",
        "QLB",
        "--out",
        "out",
        "--no-picture",
    )
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert status == 1
    assert summary["converged"] is False
    assert summary["failed_steps"] == [2]
    assert len(list((tmp_path / "out" / "frames").glob("*.npz"))) == 2  # the start, and the step that converged
    assert "max_iterations" in out
    assert (tmp_path / "out" / "report.html").exists()


@pytest.mark.slow
def test_shown_scene_runs_and_is_the_same_scene(qlb, tmp_path):
    _, text, _ = qlb("scenes", "--show", "bar")
    (tmp_path / "mine.yaml").write_text(text)
    for scene, out in (("mine.yaml", "a"), ("bar", "b")):
        assert qlb("run", scene, *SMALL, "--out", out, "--no-picture")[0] == 0
    assert (tmp_path / "a" / "scene.yaml").read_text() == (tmp_path / "b" / "scene.yaml").read_text()
    assert (tmp_path / "a" / "stats.csv").read_text() != ""


@pytest.mark.slow
def test_a_run_keeps_its_loads_in_its_scene_file(qlb, tmp_path):
    loads = ["loads.pressure=[{faces: y > 0.24, value: 100 * t}]", "loads.gravity=0,-9.81 * t,0"]
    sets = [word for load in loads for word in ("--set", load)]
    assert qlb("run", "bar", *SMALL, *sets, "--out", "a", "--no-picture")[0] == 0
    assert qlb("run", "a/scene.yaml", "--out", "b", "--no-picture")[0] == 0
    assert (tmp_path / "a" / "scene.yaml").read_text() == (tmp_path / "b" / "scene.yaml").read_text()
    frames = [np.load(tmp_path / name / "frames" / "000003.npz")["positions"] for name in "ab"]
    np.testing.assert_array_equal(frames[0], frames[1])


def test_verbose_prints_a_readable_line_for_each_step(qlb):
    _, out, _ = qlb("run", "bar", *SMALL, "--verbose", "--no-picture")
    lines = [line for line in out.splitlines() if line.startswith("step ")]
    assert len(lines) == 3
    assert "3/3" in lines[-1]
    assert "iterations" in lines[-1]


def test_quiet_when_not_a_terminal(qlb):
    status, out, err = qlb("run", "bar", *SMALL, "--no-picture")
    assert status == 0
    assert err == ""
    assert "\x1b" not in out
    assert len(out.splitlines()) < 10


def test_scenes_and_the_version_are_told(qlb):
    status, out, _ = qlb("scenes")
    assert status == 0
    assert all(name in out for name in (*SCENES, "qlb run NAME"))
    assert qlb("--version")[:2] == (0, f"qlb {version('qlb')}\n")


def test_doctor_is_content(qlb):
    status, out, _ = qlb("doctor")
    assert status == 0
    assert "SIMD level" in out
    assert "METIS" in out


@pytest.mark.slow
def test_compare_writes_one_table_and_one_plot(qlb, tmp_path):
    solvers = "ND,ND:projection=on-demand,QLB"
    status, out, _ = qlb("compare", "bar", *SMALL, "--solvers", solvers, "--out", "out")
    assert status == 0
    assert out.count("│") >= 4 * 9
    page = (tmp_path / "out" / "report.html").read_text()
    assert all(name in page for name in solvers.split(","))
    assert len(list((tmp_path / "out").glob("*.png"))) >= 1
    assert json.loads((tmp_path / "out" / "ND" / "summary.json").read_text())["converged"]


@pytest.mark.slow
@pytest.mark.parametrize("name", [signal.SIGINT, signal.SIGTERM])
def test_interrupt_keeps_what_is_done(tmp_path, name):
    command = [sys.executable, "-c", "from qlb.cli.main import main; main()"]
    arguments = ["run", "bar", "--steps", "100000", "--set", "mesh.cells=4,1,1", "--out", "out", "--no-picture"]
    process = subprocess.Popen([*command, *arguments], cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    frames = tmp_path / "out" / "frames"
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and (not frames.exists() or len(os.listdir(frames)) < 5):
        time.sleep(0.05)
    process.send_signal(name)
    _, err = process.communicate(timeout=120)
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert process.returncode == 130
    assert "kept" in err
    assert summary["status"] == "interrupted"
    assert 4 <= summary["steps"] == len(list(Path(frames).glob("*.npz"))) - 1
    done = summary["steps"]
    resumed = [*command, "resume", "out", "--steps", str(done + 2), "--no-picture"]
    again = subprocess.run(resumed, cwd=tmp_path, capture_output=True, text=True, check=False)
    assert again.returncode == 0, again.stderr
    assert f"{done + 2} steps" in again.stdout
    assert len(list(Path(frames).glob("*.npz"))) == done + 3


@pytest.mark.slow
def test_a_run_with_contact_shows_it(qlb, tmp_path):
    small = ["--set", "mesh.tets=500", "--set", "drop.height=0.01", "--set", "contact.friction=0.5"]
    status, out, _ = qlb("run", "bunny", *small, "--steps", "8", "--threads", "1", "--solver", "ND", "--out", "out")
    assert status == 0
    assert "contact.png" in out
    summary = json.loads((tmp_path / "out" / "summary.json").read_text())
    assert 0 < summary["minimum_distance"] < summary["contact"]["dhat"]
    page = (tmp_path / "out" / "report.html").read_text()
    assert '"contact":{"steps":[1,2' in page
    assert f"{summary['minimum_distance']:.4g} m" in page
    status, out, _ = qlb("run", "bar", *SMALL, "--out", "bar", "--no-picture")
    assert "contact.png" not in out
    assert '"contact":{"steps"' not in (tmp_path / "bar" / "report.html").read_text()


def test_a_check_that_finds_an_intersection_ends_the_run_with_status_1(qlb, tmp_path):
    keys = ("contact.mode=penalty", "contact.stiffness=10", "contact.check=true", "drop.height=0.01")
    weak = [word for key in keys for word in ("--set", key)]
    arguments = [*weak, "--set", "mesh.tets=500", "--steps", "20", "--threads", "1", "--solver", "ND", "--no-picture"]
    status, out, err = qlb("run", "bunny", *arguments, "--out", "out")
    assert status == 1
    assert "behind ground" in out + err
    assert len(list((tmp_path / "out" / "frames").iterdir())) > 1
