"""`qlb sweep`: the product of lists, its table against the runs, failures as rows, going on, and a cluster.

Runs are held against `run_scene` in this process; the rows of a dask cluster against those of processes.
"""

from __future__ import annotations

import csv
import json
import subprocess
import sys
from itertools import product
from pathlib import Path

import pytest

import qlb
from qlb.cli.main import main
from qlb.errors import MissingExtra
from qlb.scenes import load_scene
from qlb.studies import SweepPlan, Update, plan_sweep, processes, run_scene, sweep
from qlb.studies.sweep import COUNTS, TIMINGS

LISTS = ["mesh.cells=[4,1,1],[6,1,1]", "material.young=6e3,5e4"]
STEPS = ["steps=3"]


def plan(directory: Path, *lists: str, overrides: list[str] = STEPS, scene: str = "bar") -> SweepPlan:
    return plan_sweep(scene, lists or LISTS, directory, overrides)


def table(directory: Path) -> list[dict[str, str]]:
    with (directory / "sweep.csv").open() as file:
        return list(csv.DictReader(file))


def untimed(directory: Path) -> list[dict[str, str]]:
    return [{key: value for key, value in row.items() if key not in TIMINGS} for row in table(directory)]


def test_a_case_is_not_charged_for_imports(tmp_path: Path) -> None:
    """A run in a fresh process, as cases are: nothing slow is imported within its time loop."""
    code = (
        "import sys; from pathlib import Path; from qlb.scenes import load_scene; from qlb.studies import run_scene\n"
        f"out = Path({str(tmp_path / 'out')!r})\n"
        "run_scene(load_scene('bar', ['mesh.cells=4,1,1', 'steps=2']), out, overwrite=True)\n"
        "assert 'matplotlib.figure' not in sys.modules and 'qlb.export' not in sys.modules"
    )
    subprocess.run([sys.executable, "-P", "-c", code], check=True)


def test_the_cases_are_the_product_in_order(tmp_path: Path) -> None:
    members = plan(tmp_path).members
    chosen = [tuple(member.values.values()) for member in members]
    assert chosen == list(product(["[4,1,1]", "[6,1,1]"], ["6e3", "5e4"]))
    scenes = [member.case.scene for member in members if member.case]
    assert [(s["mesh"]["cells"][0], s["material"]["young"]) for s in scenes] == list(product([4, 6], [6e3, 5e4]))
    assert members[0].name == "cells-4x1x1_young-6e3"
    assert all((s["threads"], s["steps"]) == (1, 3) for s in scenes)


def test_names_of_folders_are_plain_and_differ(tmp_path: Path) -> None:
    values = ["fibres.direction=['.5/x/.5', 1, 0],['.5*x/.5', 1, 0]", "fibres.modulus=1e3", "step=1e-2,0.01"]
    names = [member.name for member in plan(tmp_path, *values).members]
    assert len(set(names)) == 4
    assert all(set(name) <= set("abcdefghijklmnopqrstuvwxyz0123456789_.+-") and ".." not in name[:2] for name in names)


@pytest.mark.parametrize(
    ("lists", "message"),
    [
        (["mesh.cells=4,1,1"], r"stands in brackets, as in mesh.cells=\[4,1,1\]"),
        (["mesh.celz=[4,1,1]"], "unknown key 'mesh.celz'; did you mean 'mesh.cells'?"),
        (["step=-1,0"], "step: -1 is out of range"),
        (["step=1e-2", "step=2e-2"], "more than once"),
        (["step"], "must have the form KEY=VALUE,VALUE"),
        (["step=1e-2,,2e-2"], "must have the form"),
        (["step="], "must have the form"),
    ],
)
def test_wrong_lists_are_refused_before_anything_is_written(tmp_path: Path, lists: list[str], message: str) -> None:
    with pytest.raises(qlb.InputError, match=message):
        plan(tmp_path / "out", *lists)
    with pytest.raises(qlb.InputError, match="processes"):
        sweep(plan(tmp_path / "out"), processes=0)
    assert not (tmp_path / "out").exists()


def test_the_table_says_what_the_runs_do(tmp_path: Path) -> None:
    result = sweep(plan(tmp_path / "out"), processes=2)
    assert result.converged
    assert result.table == tmp_path / "out" / "sweep.csv"
    rows = table(tmp_path / "out")
    assert list(rows[0])[:5] == ["case", "mesh.cells", "material.young", "status", "error"]
    for row in rows:
        values = [f"{key}={row[key]}" for key in ("mesh.cells", "material.young")]
        alone = run_scene(load_scene("bar", ["threads=1", *STEPS, *values]), tmp_path / row["case"]).summary
        assert (row["status"], row["converged"], row["failed_steps"]) == ("complete", "true", "0")
        numbers = {name: row[name] for name in COUNTS if name not in ("converged", "minimum_distance")}
        assert numbers == {name: str(alone[name]) for name in numbers}


@pytest.mark.slow
def test_done_cases_are_kept_and_new_values_are_added(tmp_path: Path) -> None:
    out, states = tmp_path / "out", []

    def watch(update: Update) -> None:
        if update.state != "step":
            states.append((update.case.name, update.state))

    sweep(plan(out, "material.young=6e3,5e4"), processes=2, on_update=watch)
    before = table(out)
    sweep(plan(out, "material.young=5e4,1e5"), processes=2, on_update=watch)
    assert dict(states[2:]) == {"young-5e4": "kept", "young-1e5": "finished"}
    assert table(out)[0] == before[1]
    sweep(plan(out, "material.young=5e4"), processes=1, overwrite=True, on_update=watch)
    assert states[-1] == ("young-5e4", "finished")
    with pytest.raises(qlb.InputError, match=r"steps = 3, not 2.*--overwrite"):
        sweep(plan(out, "material.young=5e4", overrides=["steps=2"]), processes=1)


@pytest.mark.slow
def test_stopping_keeps_what_is_done_and_the_same_call_goes_on(tmp_path: Path) -> None:
    ended: list[Update] = []

    def watch(update: Update) -> None:
        if update.state in ("kept", "finished"):
            ended.append(update)

    result = sweep(plan(tmp_path), processes=1, on_update=watch, stop=lambda: len(ended) == 2)
    assert (result.interrupted, result.rows) == (True, [])
    assert not result.table.exists()
    again = sweep(plan(tmp_path), processes=1, on_update=watch)
    assert [update.state for update in ended] == ["finished"] * 2 + ["kept"] * 2 + ["finished"] * 2
    assert len(again.rows) == 4


FAILING = ["solver_settings.max_iterations=1,500", "step=1e-2,-1"]
CRASHER = """
import io, os, sys
job = sys.stdin.read()
if '"young": 50000.0' in job:
    os.abort()
sys.stdin = io.StringIO(job)
from qlb.studies.worker import main
sys.exit(main())
"""


@pytest.mark.slow
def test_a_case_that_fails_is_a_row_that_says_so(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    missing = tmp_path / "nowhere.msh"
    result = sweep(plan(tmp_path / "a", *FAILING, f"mesh.path=null,{missing}"), processes=2)
    found = {(r["solver_settings.max_iterations"], r["step"], r["mesh.path"]): r for r in result.rows}
    assert not result.converged
    for (iterations, step, path), row in found.items():
        if step == "-1":
            assert (row["status"], row["error"]) == ("refused", "step: -1 is out of range: must be > 0 s")
        elif path != "null":
            assert (row["status"], row["error"]) == ("refused", f"mesh: mesh file {missing} does not exist")
        elif iterations == "1":
            assert (row["status"], row["failed_steps"], row["converged"]) == ("failed", 1, "false")
            assert "step 1 " in row["error"]
        else:
            assert (row["status"], row["steps"], row["error"]) == ("complete", 3, "")
    monkeypatch.setattr(processes, "WORKER", (sys.executable, "-c", CRASHER))
    rows = sweep(plan(tmp_path / "b"), processes=2).rows
    assert [row["status"] for row in rows] == ["complete", "crashed", "complete", "crashed"]
    assert [row["error"] for row in rows] == ["", "killed by SIGABRT"] * 2


@pytest.mark.slow
@pytest.mark.filterwarnings("ignore")  # of dask, about its ports
def test_a_dask_cluster_gives_the_same_rows(tmp_path: Path) -> None:
    from distributed import LocalCluster

    lists = ["mesh.cells=[4,1,1],[6,1,1]", "material.young=6e3,-1,5e4", "solver_settings.max_iterations=1,500"]
    sweep(plan(tmp_path / "a", *lists), processes=2)
    with LocalCluster(n_workers=1, threads_per_worker=2, processes=False, dashboard_address=None) as cluster:
        sweep(plan(tmp_path / "b", *lists), processes=1, scheduler=cluster.scheduler.address)
    assert untimed(tmp_path / "a") == untimed(tmp_path / "b")
    assert {row["status"] for row in untimed(tmp_path / "b")} == {"complete", "failed", "refused"}


@pytest.mark.filterwarnings("ignore")
def test_a_scheduler_that_is_not_there_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr("qlb.studies.cluster._CONNECT", 0.2)
    with pytest.raises(qlb.InputError, match=r"scheduler = 'tcp://127.0.0.1:1' cannot be reached"):
        sweep(plan(tmp_path), processes=1, scheduler="tcp://127.0.0.1:1")
    monkeypatch.setitem(sys.modules, "distributed", None)
    with pytest.raises(MissingExtra, match=r"qlb\[sweep\]"):
        sweep(plan(tmp_path), processes=1, scheduler="tcp://127.0.0.1:1")


@pytest.mark.slow
def test_the_command_prints_the_table_and_its_exit_status(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]
) -> None:
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["qlb", "sweep", "bar", "--set", "mesh.cells=[4,1,1]", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        return int(end.value.code or 0), *capsys.readouterr()

    status, out, err = call("--set", "material.young=6e3,5e4", "--steps", "3", "--processes", "2")
    assert (status, err) == (0, "")
    assert out.count("complete") == 2
    assert len(table(tmp_path / "runs" / "bar-sweep")) == 2
    assert json.loads((tmp_path / "runs" / "bar-sweep" / "sweep.json").read_text())["format"] == "qlb sweep"
    status, out, err = call("--set", "step=1e-2,-1", "--steps", "2", "--out", "other")
    assert (status, out.count("refused"), err.count("out of range")) == (1, 1, 1)
    status, out, err = call("--set", "stepz=1", "--out", "third")
    assert (status, out, len(err.splitlines())) == (2, "", 1)
