"""Writes a run directory while a simulation runs."""

from __future__ import annotations

import json
import platform
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, nullcontext, suppress
from dataclasses import replace
from importlib.metadata import version
from pathlib import Path
from types import TracebackType
from typing import Any, Literal, Self

import numpy as np
import yaml

from qlb import _native
from qlb.analysis import Constitution
from qlb.analysis.snapshot import load_energy
from qlb.contact import ContactReport
from qlb.errors import InputError
from qlb.results import layout
from qlb.results.checkpoint import Checkpoint, CheckpointWriter, Place
from qlb.results.clock import LoopClock
from qlb.results.errors import WriteError
from qlb.results.files import Arrays, append_text, write_arrays, write_text
from qlb.results.parts import Parts
from qlb.results.resume import Earlier, take_up
from qlb.results.statistics import HEADER, StepCount, csv_rows, summarise
from qlb.simulation import Simulation
from qlb.step_result import StepFailed, StepResult

Status = Literal["running", "complete", "failed", "interrupted"]


class RunWriter:
    """Keeps every finished step of a simulation in a directory; see `qlb.results.layout` for what lies there.

    Make it when the simulation is set up (nodes pinned and moved): it has system and solver made, so that its clock
    counts the time loop alone. As a context manager it finishes the run by itself::

        with RunWriter(Path("out"), {"scene": "mine"}, simulation) as writer:
            for result in simulation.run(100):
                writer.record(result)

    Args:
        directory: where to write; made where it is missing.
        scene: the resolved scene as plain data, kept as scene.yaml.
        simulation: what will run.
        overwrite: replace an earlier run there. Only files that a run wrote are deleted.
        resume: go on with the run that is there. `simulation` must be set up as it was and at its checkpoint
            (`Run.restore`); what a kill left behind of later steps goes.
        stride: write a frame and a checkpoint every so many steps; the last step gets them in any case.
        precision: of the frames, "float64" or "float32".
        compress: deflate the frames.

    Raises:
        InputError: the directory holds anything else, is a file, is in use by another run, or cannot be written
            (nothing was changed then); the scene is not plain data; stride < 1, another precision; there is no run to
            go on with, or it is another one.
        WriteError: a file could not be written, as with a full disk. So do all methods.
    """

    def __init__(
        self,
        directory: Path,
        scene: Mapping[str, object],
        simulation: Simulation,
        *,
        overwrite: bool = False,
        resume: bool = False,
        stride: int = 1,
        precision: Literal["float64", "float32"] = "float64",
        compress: bool = False,
    ) -> None:
        if stride < 1:
            raise InputError(f"stride = {stride} is out of range: must be >= 1")
        if precision not in ("float64", "float32"):
            raise InputError(f"precision = {precision!r} is out of range: must be 'float64' or 'float32'")
        text = _scene_text(scene)
        self.directory = Path(directory)
        self._simulation = simulation
        self._stride, self._float, self._compress = stride, np.dtype(precision), compress
        self._contact: ContactReport | None = None
        self._finished = False
        if resume:
            layout.check_marker(self.directory)
        else:
            layout.check_free(self.directory, overwrite=overwrite)
        self._now = Checkpoint.of(simulation)
        self._lock = layout.lock(self.directory) if resume else layout.claim(self.directory, overwrite=overwrite)
        try:
            self._checkpoints = CheckpointWriter(self.directory, layout.check_marker(self.directory))
            earlier = take_up(self.directory, simulation) if resume else None
            self._clock = LoopClock(simulation.timer, None if earlier is None else earlier.seconds)
            with self._clock.stopped():
                self._begin(text, earlier)
        except BaseException:
            self._lock.release()
            raise

    def _begin(self, scene: str, earlier: Earlier | None) -> None:
        """Write what there is before the first step."""
        write_text(self.directory / layout.SCENE, scene)
        if earlier is None:
            self._first_step = self._simulation.steps_done
            self._counts: list[StepCount] = []
            write_arrays(self.directory / layout.MESH, Parts.of(self._simulation.assembly).arrays())
            write_arrays(self.directory / layout.MATERIALS, Constitution.of(self._simulation).arrays())
            append_text(self.directory / layout.STATS, HEADER)
            self._write_summary("running", None)
            self._keep()  # last, since a run with a checkpoint is one that can be read and gone on with
        else:
            self._first_step, self._counts = earlier.first_step, earlier.counts
            self._kept = self._now.steps_done
            self._write_summary("running", None)

    def record(self, result: StepResult) -> None:
        """Keep a step that was just taken. Raises `InputError` where the simulation has gone on since."""
        if result.step != self._simulation.steps_done:
            raise InputError(
                f"step {result.step} cannot be recorded: the simulation is at step {self._simulation.steps_done};"
                " record each step before the next"
            )
        with self._writing():
            self._add_rows(result)
            self._now, self._contact = Checkpoint.of(self._simulation), result.contact
            if (result.step - self._first_step) % self._stride == 0:
                self._keep()

    def record_failed(self, result: StepResult) -> None:
        """Keep the statistics of a step that did not converge and was not taken over by the simulation."""
        with self._writing():
            self._add_rows(result)

    def finish(self, status: Literal["complete", "failed", "interrupted"], error: str | None = None) -> dict[str, Any]:
        """Write the last frame, where it is not there yet, and summary.json; returns what that holds."""
        self._finished = True
        with self._writing():
            try:
                if self._kept != self._now.steps_done:
                    self._keep()
            finally:
                summary = self._write_summary(status, error)
        self._lock.release()
        return summary

    def __enter__(self) -> Self:
        """Nothing more to do."""
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        """Finish, unless that was done: complete, interrupted by Ctrl-C, or failed with the error."""
        if self._finished:
            return
        if isinstance(error, StepFailed):
            self.record_failed(error.result)
        if error is None:
            self.finish("complete")
        elif isinstance(error, KeyboardInterrupt):
            self.finish("interrupted")
        else:
            with suppress(WriteError) if isinstance(error, WriteError) else nullcontext():
                self.finish("failed", str(error) or type(error).__name__)

    @contextmanager
    def _writing(self) -> Iterator[None]:
        """Stop the clock, and let errors say what is safe."""
        with self._clock.stopped():
            try:
                yield
            except WriteError as error:
                safe = f"steps up to {self._kept} are safe in {self.directory}"
                raise WriteError(error.path, error.reason, safe) from None

    def _add_rows(self, result: StepResult) -> None:
        append_text(self.directory / layout.STATS, csv_rows(result))
        self._counts.append(StepCount.of(result))

    def _keep(self) -> None:
        """Write the frame, then the checkpoint that makes it count."""
        state, step = self._now.state, self._now.steps_done
        system = self._simulation.system
        frame = {"positions": state.positions, "velocities": state.velocities}
        if self._contact is not None:
            frame["contact_forces"] = self._contact.forces
        arrays: Arrays = {name: values.astype(self._float, copy=False) for name, values in frame.items()}
        arrays["gravity"] = system.gravity.acceleration(state.time)
        if system.added:
            arrays["load_energy"] = np.array(load_energy(system, state, self._simulation.step))
        if planes := self._simulation.assembly.planes:
            arrays["plane_points"] = np.stack([plane.point_at(state.time) for plane in planes])
        if self._contact is not None:
            arrays["contact_energy"] = np.array(self._contact.energy)
            arrays |= {"plane_forces": self._contact.plane_forces} if planes else {}
        arrays |= {"step": np.array(step), "time": np.array(state.time)}
        path = layout.frame_path(self.directory, step)
        crc = write_arrays(path, arrays, compress=self._compress)
        file = path.relative_to(self.directory).as_posix()
        exact = [(frame[name], Place(file, name, crc[name])) for name in frame if arrays[name] is frame[name]]
        self._checkpoints.write(replace(self._now, seconds=self._clock.saved()), exact)
        self._kept = step

    def _write_summary(self, status: Status, error: str | None) -> dict[str, Any]:
        clock, simulation = self._clock, self._simulation
        counted = summarise(self._counts)
        summary: dict[str, Any] = {
            "status": status,
            "error": error,
            "steps": self._now.steps_done - self._first_step,
            **counted,
            "converged": counted["converged"] and status != "failed",
            "wall_seconds": clock.wall,
            "cpu_seconds": clock.cpu,
            "seconds": clock.seconds,
            "time": self._now.state.time,
            **_facts(simulation),
        }
        write_text(self.directory / layout.SUMMARY, json.dumps(summary, indent=2) + "\n")
        return summary


def _facts(simulation: Simulation) -> dict[str, Any]:
    """What is known of a run before its first step."""
    contact = simulation.system.contact
    return {
        "solver": simulation.solver.name,
        "integrator": simulation.integrator.name,
        "step": simulation.step,
        "nodes": len(simulation.mesh.positions),
        "tets": len(simulation.mesh.tets),
        "threads": simulation.threads,
        "tolerance": simulation.tolerance.model_dump(mode="json"),
        "contact": None if contact is None else contact.resolved(),
        "meshing": _meshing(simulation),
        "versions": {
            "qlb": version("qlb"),
            "python": platform.python_version(),
            "numpy": np.__version__,
            **{name: str(value) for name, value in _native.libraries().items()},
            "simd": _native.simd_levels()[-1],
        },
    }


def _meshing(simulation: Simulation) -> list[dict[str, Any]]:
    """How meshes were made from surfaces, each once however many bodies have it."""
    reports = [body.mesh.report for body in simulation.assembly.bodies if body.mesh.report is not None]
    by_name = {report.name: report for report in reports}
    return [{"name": name, "facts": dict(r.rows()), "notes": r.notes()} for name, r in by_name.items()]


def _scene_text(scene: Mapping[str, object]) -> str:
    try:
        return yaml.safe_dump(dict(scene), sort_keys=False, allow_unicode=True)
    except yaml.YAMLError as error:
        raise InputError(
            f"scene must be plain data (numbers, text, lists, mappings): {str(error).splitlines()[0]}"
        ) from None
