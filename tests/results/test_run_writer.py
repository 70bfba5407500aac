"""What a run directory holds, written and read back."""

from __future__ import annotations

import errno
import json
from collections.abc import Iterable, Iterator
from pathlib import Path
from time import perf_counter, sleep
from typing import Any

import numpy as np
import pytest

import qlb
from qlb.results import COLUMNS, Run, RunWriter, WriteError, files
from qlb.results.npz import Packed, pack
from qlb.timing import PARTS

UNREACHABLE = {"tolerance": qlb.Tolerance(relative=0, absolute=0, scaled=0)}


def _record(writer: RunWriter, steps: Iterable[qlb.StepResult]) -> list[qlb.StepResult]:
    results = []
    for result in steps:
        writer.record(result)
        results.append(result)
    return results


def _run(writer: RunWriter, steps: Iterable[qlb.StepResult]) -> None:
    with writer:
        _record(writer, steps)


def test_frames_mesh_and_scene_come_back(tmp_path, make_simulation):
    simulation = make_simulation()
    scene = {"scene": "bar", "nested": {"list": [1, 2.5, None], "text": "Müller: 100 %"}}
    with RunWriter(tmp_path / "run", scene, simulation) as writer:
        results = _record(writer, simulation.run(3))
    run = Run(tmp_path / "run")
    assert run.scene == scene
    assert np.array_equal(run.mesh.positions, simulation.mesh.positions)
    assert np.array_equal(run.mesh.tets, simulation.mesh.tets)
    assert run.frame_steps == [0, 1, 2, 3]
    first, *later = run.frames()
    assert (first.step, first.time) == (0, 0.0)
    assert np.array_equal(first.positions, simulation.mesh.positions)
    for frame, result in zip(later, results, strict=True):
        assert (frame.step, frame.time) == (result.step, result.time)
        assert np.array_equal(frame.positions, result.positions)
        assert np.array_equal(frame.velocities, result.velocities)


def test_stats_hold_a_row_for_each_iteration(tmp_path, make_simulation):
    simulation = make_simulation()
    with RunWriter(tmp_path / "run", {}, simulation) as writer:
        results = _record(writer, simulation.run(3))
    stats = Run(tmp_path / "run").stats
    assert list(stats) == list(COLUMNS)
    expected = [
        (r.step, stage, row, solve) for r in results for stage, solve in enumerate(r.solves, 1) for row in solve.rows
    ]
    assert [len(column) for column in stats.values()] == [len(expected)] * len(COLUMNS)
    for i, (step, stage, row, solve) in enumerate(expected):
        assert (stats["step"][i], stats["stage"][i], stats["iteration"][i]) == (step, stage, row.iteration)
        assert stats["residual"][i] == row.residual
        assert stats["energy"][i] == row.energy
        assert stats["reference"][i] == solve.reference
        assert stats["step_length"][i] == row.step_length
        assert stats["factorizations"][i] == row.factorizations
        assert stats["reason"][i] == (solve.reason.value if row is solve.rows[-1] else "")
        assert stats["seconds_factor"][i] == pytest.approx(row.seconds["factor"], rel=1e-5)


def test_every_part_of_a_step_has_a_column():
    assert [name.removeprefix("seconds_") for name in COLUMNS if name.startswith("seconds_")] == list(PARTS)
    assert all(COLUMNS.values())


def test_summary_counts(tmp_path, make_simulation):
    simulation = make_simulation(integrator="BDF1", solver="ND", step=2e-2)
    with RunWriter(tmp_path / "run", {}, simulation) as writer:
        results = _record(writer, simulation.run(3))
    summary = Run(tmp_path / "run").summary
    iterations = [result.iterations for result in results]
    assert summary["status"] == "complete"
    assert summary["error"] is None
    assert summary["steps"] == 3
    assert summary["converged"] is True
    assert summary["failed_steps"] == []
    assert summary["iterations_mean"] == pytest.approx(np.mean(iterations))
    assert summary["iterations_max"] == max(iterations)
    assert summary["factorizations"] == sum(result.factorizations for result in results)
    assert (summary["solver"], summary["integrator"]) == ("ND", "BDF1")
    assert (summary["nodes"], summary["tets"], summary["threads"]) == (20, 24, 1)
    assert (summary["step"], summary["time"]) == (2e-2, results[-1].time)
    assert summary["versions"]["qlb"] == qlb.__version__
    assert {"python", "numpy", "METIS", "simd"} <= set(summary["versions"])


def test_the_writers_own_time_is_not_counted(tmp_path, make_simulation, monkeypatch):
    simulation = make_simulation()
    writer = RunWriter(tmp_path / "run", {}, simulation)

    def slow(*arguments: Any, **settings: Any) -> Packed:
        sleep(0.05)
        return pack(*arguments, **settings)

    monkeypatch.setattr(files, "pack", slow)
    start = perf_counter()
    for result in simulation.run(3):
        writer.record(result)
    elapsed = perf_counter() - start
    summary = writer.finish("complete")
    assert elapsed > 0.3
    assert summary["wall_seconds"] < elapsed - 0.29
    assert summary["cpu_seconds"] < elapsed - 0.29
    assert sum(summary["seconds"].values()) == pytest.approx(summary["wall_seconds"], abs=5e-2)
    rows = sum(Run(tmp_path / "run").stats[f"seconds_{part}"].sum() for part in PARTS)
    assert 0 < rows < summary["wall_seconds"] + 5e-2  # the writer took 0.3 s


def test_stride_keeps_the_last_step(make_run):
    run = make_run(steps=5, stride=3)
    assert run.frame_steps == [0, 3, 5]
    assert run.checkpoint.steps_done == 5
    assert list(run.iterations_per_step().steps) == [1, 2, 3, 4, 5]


@pytest.mark.parametrize("integrator", ["BDF2", "SDIRK2", "quasistatic"])
@pytest.mark.parametrize("solver", ["ND", "QLF", "QLB", "QLA"])
def test_a_checkpoint_goes_on_to_the_same_bits(tmp_path, make_simulation, integrator, solver):
    settings = {"integrator": integrator, "solver": solver, "gravity": lambda time: (0.0, -5 * time, 0.0)}
    unbroken = list(make_simulation(**settings).run(6))
    simulation = make_simulation(**settings)
    _run(RunWriter(tmp_path / "run", {}, simulation), simulation.run(3))
    resumed = make_simulation(**settings)
    Run(tmp_path / "run").restore(resumed)
    for expected, result in zip(unbroken[3:], resumed.run(3), strict=True):
        assert (result.step, result.time) == (expected.step, expected.time)
        assert np.array_equal(result.positions, expected.positions)
        assert np.array_equal(result.velocities, expected.velocities)


def test_a_failed_step_is_counted_and_gets_no_frame(tmp_path, make_simulation):
    simulation = make_simulation(**UNREACHABLE, solver_settings=qlb.SolverSettings(max_iterations=1))
    with pytest.raises(qlb.StepFailed):
        _run(RunWriter(tmp_path / "run", {}, simulation), simulation.run(3))
    run = Run(tmp_path / "run")
    assert run.frame_steps == [0]
    summary = run.summary
    assert summary["status"] == "failed"
    assert summary["error"].startswith("step 1 (time 0.01 s) did not converge: max_iterations")
    assert (summary["steps"], summary["converged"], summary["failed_steps"]) == (0, False, [1])
    assert summary["iterations_max"] == 1
    assert list(run.iterations_per_step().converged) == [False]
    assert run.checkpoint.steps_done == 0


def test_accepted_failures_are_counted(make_run):
    run = make_run(on_failure="accept", **UNREACHABLE, solver_settings=qlb.SolverSettings(max_iterations=2))
    assert run.frame_steps == [0, 1, 2, 3]
    assert run.summary["status"] == "complete"
    assert run.summary["converged"] is False
    assert run.summary["failed_steps"] == [1, 2, 3]
    assert not run.iterations_per_step().converged.any()


def test_a_step_that_was_halved_counts_as_converged(tmp_path, make_simulation):
    few = qlb.SolverSettings(max_iterations=6)
    simulation = make_simulation(on_failure="halve", step=0.1, solver="ND", solver_settings=few)
    with RunWriter(tmp_path / "run", {}, simulation) as writer:
        results = _record(writer, simulation.run(6))
    assert any(result.parts > 1 for result in results)
    run = Run(tmp_path / "run")
    assert run.summary["converged"] is True
    steps = run.iterations_per_step()
    assert steps.converged.all()
    assert list(steps.iterations) == [result.iterations for result in results]


def test_iterations_by_stage(make_run):
    run = make_run(integrator="SDIRK2")
    assert run.stages == 2
    both = run.iterations_per_step()
    first, second = run.iterations_per_step(1), run.iterations_per_step(2)
    assert np.array_equal(first.iterations + second.iterations, both.iterations)
    assert make_run("other", integrator="BDF2").stages == 1


def test_a_run_that_was_killed_is_readable(tmp_path, make_simulation):
    simulation = make_simulation()
    writer = RunWriter(tmp_path / "run", {}, simulation)
    results = _record(writer, simulation.run(3))
    with (tmp_path / "run" / "stats.csv").open("a") as file:
        file.write("4,1,1,0,0.0001")
    (tmp_path / "run" / "frames" / ".000004.part.npz").write_bytes(b"half")
    run = Run(tmp_path / "run")
    assert run.summary["status"] == "running"
    assert run.summary["steps"] == 3
    assert run.summary["factorizations"] == sum(result.factorizations for result in results)
    assert run.frame_steps == [0, 1, 2, 3]
    assert run.checkpoint.steps_done == 3


def test_an_interrupted_run_keeps_what_was_computed(tmp_path, make_simulation):
    simulation = make_simulation()

    def two_steps() -> Iterator[qlb.StepResult]:
        yield from simulation.run(2)
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        _run(RunWriter(tmp_path / "run", {}, simulation, stride=10), two_steps())
    run = Run(tmp_path / "run")
    assert run.summary["status"] == "interrupted"
    assert run.summary["converged"] is True
    assert run.frame_steps == [0, 2]


def test_a_step_is_recorded_before_the_next(tmp_path, make_simulation):
    simulation = make_simulation()
    writer = RunWriter(tmp_path / "run", {}, simulation)
    first, _ = simulation.run(2)
    with pytest.raises(qlb.InputError, match="step 1 cannot be recorded: the simulation is at step 2"):
        writer.record(first)


def test_a_full_disk_says_what_is_safe(tmp_path, make_simulation, monkeypatch):
    simulation = make_simulation()
    writer = RunWriter(tmp_path / "run", {}, simulation)
    writer.record(simulation.advance())

    def some_of_it() -> Iterator[bytes]:
        yield b"some of it"
        raise OSError(errno.ENOSPC, "No space left on device")

    monkeypatch.setattr(files, "pack", lambda *arguments, **settings: Packed(some_of_it(), {}))
    with pytest.raises(WriteError) as caught:
        writer.record(simulation.advance())
    message = str(caught.value)
    assert "000002.npz: No space left on device" in message
    assert "steps up to 1 are safe" in message
    assert "\n" not in message
    assert Run(tmp_path / "run").frame_steps == [0, 1]
    assert not list(tmp_path.rglob(".*"))
    monkeypatch.setattr(files, "pack", pack)
    assert writer.finish("failed", message)["steps"] == 2
    assert Run(tmp_path / "run").frame_steps == [0, 1, 2]


def test_the_summary_is_strict_json(make_run):
    run = make_run()

    def refuse(constant: str) -> None:
        raise AssertionError(constant)

    json.loads((run.directory / "summary.json").read_text(), parse_constant=refuse)


def test_nothing_else_lies_in_a_run_directory(make_run):
    run = make_run(steps=1)
    found = {path.relative_to(run.directory) for path in run.directory.rglob("*") if path.is_file()}
    names = ["run.json", "scene.yaml", "mesh.npz", "materials.npz", "stats.csv", "checkpoint.npz", "summary.json"]
    names += ["run.lock"]
    assert found == {*map(Path, names), Path("frames/000000.npz"), Path("frames/000001.npz")}
