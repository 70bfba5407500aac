"""What going on with a run needs, and how it refuses what does not fit."""

from __future__ import annotations

import numpy as np
import pytest

import qlb
from qlb.results import Run, RunWriter
from qlb.scenes import load_scene
from qlb.studies import resume_run, run_scene

BAR = ["mesh.cells=4,1,1", "threads=1", "steps=3"]


@pytest.fixture
def bar(tmp_path):
    run_scene(load_scene("bar", BAR), tmp_path / "bar")
    return tmp_path / "bar"


def test_a_finished_run_can_have_more_steps(bar, tmp_path):
    outcome = resume_run(bar, steps=6)
    run_scene(load_scene("bar", [*BAR, "steps=6"]), tmp_path / "whole")
    whole = Run(tmp_path / "whole")
    assert np.array_equal(outcome.run.frame(6).positions, whole.frame(6).positions)
    assert outcome.run.scene == whole.scene
    assert {**outcome.summary, "wall_seconds": 0, "cpu_seconds": 0, "seconds": 0} == {
        **whole.summary,
        "wall_seconds": 0,
        "cpu_seconds": 0,
        "seconds": 0,
    }


def test_seconds_go_on(bar):
    before = Run(bar).summary
    after = resume_run(bar, steps=4).summary
    assert after["wall_seconds"] > before["wall_seconds"]
    assert all(after["seconds"][part] >= before["seconds"][part] - 1e-9 for part in before["seconds"])


def test_nothing_to_do_changes_nothing(bar):
    frames = [frame.positions for frame in Run(bar).frames()]
    summary = resume_run(bar).summary
    assert summary["status"] == "complete"
    assert all(np.array_equal(a, b.positions) for a, b in zip(frames, Run(bar).frames(), strict=True))


def test_fewer_steps_than_are_done_are_refused(bar):
    with pytest.raises(qlb.InputError, match="steps = 2 is out of range: must be >= 3"):
        resume_run(bar, steps=2)


@pytest.mark.parametrize(
    ("old", "new", "says"),
    [
        ("solver: QLA", "solver: QLB", "its solver is 'QLA', that of the simulation is 'QLB'"),
        ("step: 0.01", "step: 0.02", "its step is 0.01, that of the simulation is 0.02"),
        ("integrator: BDF2", "integrator: BDF1", "its integrator is 'BDF2'"),
        ("cells:\n  - 4", "cells:\n  - 5", "positions, tets differ"),
    ],
)
def test_a_scene_that_was_edited_is_refused(bar, old, new, says):
    text = (bar / "scene.yaml").read_text()
    assert old in text
    (bar / "scene.yaml").write_text(text.replace(old, new))
    before = (bar / "stats.csv").read_bytes()
    with pytest.raises(qlb.InputError, match=says):
        resume_run(bar)
    assert (bar / "stats.csv").read_bytes() == before


def test_the_run_of_a_script_is_gone_on_with_by_a_script(tmp_path, make_simulation):
    whole, first, second = (make_simulation() for _ in range(3))
    expected = list(whole.run(4))[-1]
    with RunWriter(tmp_path / "run", {"scene": "mine"}, first) as writer:
        for result in first.run(2):
            writer.record(result)
    with pytest.raises(qlb.InputError, match="'mine' is not known"):
        resume_run(tmp_path / "run")
    with pytest.raises(qlb.InputError, match=r"checkpoint is of step 2, the simulation is at step 0; restore it first"):
        RunWriter(tmp_path / "run", {"scene": "mine"}, second, resume=True)
    Run(tmp_path / "run").restore(second)
    with RunWriter(tmp_path / "run", {"scene": "mine"}, second, resume=True) as writer:
        for result in second.run(2):
            writer.record(result)
    run = Run(tmp_path / "run")
    assert run.frame_steps == [0, 1, 2, 3, 4]
    assert np.array_equal(run.frame(4).positions, expected.positions)
    assert list(run.iterations_per_step().steps) == [1, 2, 3, 4]


def test_two_processes_do_not_write_into_one_run(bar):
    simulation = load_scene("bar", BAR).build()
    Run(bar).restore(simulation)
    writer = RunWriter(bar, Run(bar).scene, simulation, resume=True)
    with pytest.raises(qlb.InputError, match="is in use by another run"):
        resume_run(bar, steps=5)
    with pytest.raises(qlb.InputError, match="is in use by another run"):
        run_scene(load_scene("bar", BAR), bar, overwrite=True)
    writer.finish("complete")
    run_scene(load_scene("bar", BAR), bar, overwrite=True)


def test_the_checkpoint_of_another_run_is_refused_by_name(bar, tmp_path):
    run_scene(load_scene("bar", [*BAR, "material.young=1e5"]), tmp_path / "other")
    (tmp_path / "other" / "checkpoint.npz").replace(bar / "checkpoint.npz")
    with pytest.raises(qlb.InputError, match=r"checkpoint\.npz is the checkpoint of another run"):
        resume_run(bar)


def test_frames_in_single_precision_and_deflated(bar, tmp_path, make_simulation):
    scene = load_scene("bar", [*BAR, "output.precision=float32", "output.compress=true", "steps=3"])
    run = run_scene(scene, tmp_path / "small").run
    exact, frame = Run(bar).frame(3), run.frame(3)
    assert frame.positions.dtype == np.float64
    np.testing.assert_array_equal(frame.positions, exact.positions.astype(np.float32))
    size = [(d / "frames" / "000003.npz").stat().st_size for d in (bar, tmp_path / "small")]
    assert size[1] < 0.75 * size[0]
    resume_run(bar, steps=5)
    np.testing.assert_array_equal(
        resume_run(tmp_path / "small", steps=5).run.frame(5).positions,
        Run(bar).frame(5).positions.astype(np.float32),
    )
    with pytest.raises(qlb.InputError, match="precision = 'half' is out of range"):
        RunWriter(tmp_path / "no", {}, make_simulation(), precision="half")
