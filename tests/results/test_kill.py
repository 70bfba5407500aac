"""A run that is killed at any moment keeps every finished step, and goes on to the bits of an unbroken one."""

from __future__ import annotations

import errno
import multiprocessing
import os
import shlex
import shutil
import signal
import subprocess
import sys
from contextlib import suppress
from itertools import count
from multiprocessing.context import ForkServerContext
from multiprocessing.synchronize import Event
from pathlib import Path
from typing import Any

import meshio
import numpy as np
import pytest

from qlb import shapes
from qlb.results import Run, WriteError, layout
from qlb.results.files import whole_file
from qlb.scenes import load_scene
from qlb.studies import resume_run, run_scene

STEPS = 12
BAR = ["mesh.cells=12,4,4", "steps=4", "threads=1"]  # whose states are too large for checkpoint.npz
CONTACT = ["drop.height=0.005", "contact.friction=0.3", f"steps={STEPS}", "threads=1", "solver=QLA"]


def _run(directory: Path, mesh: Path, started: Event | None = None) -> None:
    """Begin, or go on where there is something to go on from; `started` when the first file is to be written."""
    if started is not None:
        lock = layout.lock
        layout.lock = lambda directory: started.set() or lock(directory)
    if _goes_on(directory):
        resume_run(directory)
    else:
        run_scene(load_scene("bunny", [*CONTACT, f"mesh.path={mesh}"]), directory, overwrite=directory.exists())


def _goes_on(directory: Path) -> bool:
    return whole_file(directory / "checkpoint.npz").exists()


def _bar(directory: Path, output: list[str], kill_at: int = -1) -> None:
    """Begin or go on with a bar; the process is killed before it moves a file for that time (`os.replace`)."""
    moves, move = count(), os.replace

    def replace(*arguments: Any) -> None:
        if next(moves) == kill_at:
            os.kill(os.getpid(), signal.SIGKILL)
        move(*arguments)

    os.replace = replace
    if _goes_on(directory):
        resume_run(directory)
    else:
        run_scene(load_scene("bar", [*BAR, *output]), directory, overwrite=directory.exists())


@pytest.fixture(scope="module")
def processes() -> ForkServerContext:
    """Starts processes that have everything imported, so that a kill falls within the run and not before it."""
    context = multiprocessing.get_context("forkserver")
    context.set_forkserver_preload(["qlb.studies", "meshio", "scipy.spatial.transform"])
    return context


@pytest.fixture(scope="module")
def mesh(tmp_path_factory: pytest.TempPathFactory) -> Path:
    shape = shapes.bunny(tets=700)
    path = tmp_path_factory.mktemp("mesh") / "bunny.vtu"
    meshio.write_points_cells(path, shape.positions, {"tetra": shape.tets})
    return path


@pytest.fixture(scope="module")
def unbroken(tmp_path_factory: pytest.TempPathFactory, mesh: Path) -> Run:
    directory = tmp_path_factory.mktemp("unbroken") / "run"
    _run(directory, mesh)
    run = Run(directory)
    assert max(run.stats["contacts"]) > 5
    return run


def _assert_finished_steps_are_whole(run: Run, unbroken: Run) -> None:
    """Every step up to the checkpoint is there, and is that of the unbroken run."""
    done = run.checkpoint.steps_done
    assert run.frame_steps[: done + 1] == list(range(done + 1))
    for step in range(done + 1):
        frame, expected = run.frame(step), unbroken.frame(step)
        assert np.array_equal(frame.positions, expected.positions)
        assert np.array_equal(frame.velocities, expected.velocities)
    assert set(range(1, done + 1)) <= set(run.stats["step"].tolist())
    assert run.summary["steps"] >= done


def _assert_same(run: Run, unbroken: Run) -> None:
    assert run.summary["status"] == "complete"
    assert run.frame_steps == unbroken.frame_steps
    _assert_finished_steps_are_whole(run, unbroken)
    counted = ["step", "stage", "iteration", "residual", "energy", "step_length", "factorizations", "contacts"]
    for name in [*counted, "minimum_distance", "reason"]:
        assert np.array_equal(run.stats[name], unbroken.stats[name]), name
    for name in ("steps", "iterations_mean", "iterations_max", "factorizations", "minimum_distance", "failed_steps"):
        assert run.summary[name] == unbroken.summary[name], name


@pytest.mark.slow
@pytest.mark.parametrize("seed", range(10))
def test_five_kills_at_random_moments(tmp_path, processes, mesh, unbroken, seed):
    """Fifty kills in all: of a run, then of what goes on with it; the moment is drawn anew where it came too late."""
    random = np.random.default_rng(seed)
    directory, kills, longest = tmp_path / "run", 0, 1.5 * unbroken.summary["wall_seconds"]
    while kills < 5:
        started = processes.Event()
        process = processes.Process(target=_run, args=(directory, mesh, started))
        process.start()
        assert started.wait(60)
        process.join(random.uniform(0.0, longest))
        killed = process.exitcode is None
        process.kill()
        process.join()
        if not killed:
            assert process.exitcode == 0
            _assert_same(Run(directory), unbroken)
            shutil.rmtree(directory)
            longest *= 0.7
            continue
        kills += 1
        if _goes_on(directory):
            _assert_finished_steps_are_whole(Run(directory), unbroken)
    _run(directory, mesh)
    _assert_same(Run(directory), unbroken)


@pytest.mark.slow
@pytest.mark.parametrize("output", [[], ["output.precision=float32"]], ids=["float64", "float32"])
def test_a_kill_before_each_move_of_a_file(tmp_path, processes, output):
    """Files take their places one by one; a run that ends between any two goes on."""
    run_scene(load_scene("bar", [*BAR, *output]), tmp_path / "unbroken")
    unbroken = Run(tmp_path / "unbroken")
    for kill_at in count():
        directory = tmp_path / str(kill_at)
        process = processes.Process(target=_bar, args=(directory, output, kill_at))
        process.start()
        process.join()
        if process.exitcode == 0:
            break
        assert process.exitcode == -signal.SIGKILL
        if _goes_on(directory):
            _assert_finished_steps_are_whole(Run(directory), unbroken)
        process = processes.Process(target=_bar, args=(directory, output))
        process.start()
        process.join()
        assert process.exitcode == 0
        _assert_same(Run(directory), unbroken)
    assert kill_at > 4 * 4  # a frame, and a checkpoint that steps aside, for each step at least


@pytest.mark.slow
def test_a_disk_that_is_full_from_some_move_on(tmp_path, monkeypatch):
    """Also in the midst of a checkpoint's step aside: what was whole stays so, and goes on when there is room."""
    scene, move, left = load_scene("bar", BAR), os.replace, count()
    unbroken = run_scene(scene, tmp_path / "unbroken").run

    def replace(*arguments: Any) -> None:
        if next(left) >= 0:
            raise OSError(errno.ENOSPC, "No space left on device")
        move(*arguments)

    for moves in count():
        directory, left = tmp_path / str(moves), count(-moves)
        monkeypatch.setattr(os, "replace", replace)
        with suppress(WriteError):
            run_scene(scene, directory)
            break
        monkeypatch.undo()
        if _goes_on(directory):
            _assert_finished_steps_are_whole(Run(directory), unbroken)
            resume_run(directory)
        else:
            run_scene(scene, directory, overwrite=True)
        _assert_same(Run(directory), unbroken)
    assert moves > 4 * 4


@pytest.mark.slow
def test_a_full_disk(tmp_path, mesh, unbroken):
    """On a file system of its own with room for some frames; what was written goes on elsewhere."""
    disk, kept = tmp_path / "disk", tmp_path / "kept"
    disk.mkdir()
    arguments = ["run", "bunny", *(word for key in CONTACT for word in ("--set", key)), "--set", f"mesh.path={mesh}"]
    command = [sys.executable, "-c", "from qlb.cli.main import main; main()", *arguments, "--out", str(disk / "run")]
    small = f"mount -t tmpfs -o size=200k tmpfs {disk}"
    if subprocess.run(["unshare", "-rm", "sh", "-c", small], capture_output=True, check=False).returncode != 0:
        pytest.skip("no file system can be mounted here")
    script = f"{small} && {shlex.join(command)}; status=$?; cp -r {disk}/run {kept}; exit $status"
    done = subprocess.run(["unshare", "-rm", "sh", "-c", script], capture_output=True, text=True, check=False)
    assert done.returncode == 1
    assert "No space left on device; steps up to " in done.stderr
    assert "Traceback" not in done.stderr
    assert 0 < Run(kept).checkpoint.steps_done < STEPS
    _assert_finished_steps_are_whole(Run(kept), unbroken)
    resume_run(kept)
    _assert_same(Run(kept), unbroken)
