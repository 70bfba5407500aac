"""Reads a run directory."""

from __future__ import annotations

import json
from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
import yaml

from qlb.analysis import Constitution, Snapshot
from qlb.arrays import BoolArray, FloatArray, LongArray
from qlb.errors import InputError
from qlb.mesh import TetMesh
from qlb.results import layout
from qlb.results.checkpoint import Checkpoint
from qlb.results.files import read_arrays, require_shapes
from qlb.results.parts import Parts
from qlb.results.statistics import Statistics, count_steps, read_statistics, summarise
from qlb.simulation import Simulation


@dataclass(frozen=True)
class Frame:
    """The state after a step; step 0 is the initial one."""

    step: int
    time: float
    """[s]"""
    positions: FloatArray
    """[m], shape (n, 3); with obstacles (n + q, 3), those of their vertices behind those of the bodies"""
    velocities: FloatArray
    """[m/s], of the same shape"""
    plane_points: FloatArray
    """a point on each plane [m], shape (p, 3)"""
    contact_forces: FloatArray | None = None
    """of contact and friction on each node [N], shape (n + q, 3), where there is contact and a step has been taken"""
    plane_forces: FloatArray | None = None
    """their total on each plane [N], shape (p, 3)"""
    gravity: FloatArray | None = None
    """acceleration [m/s^2], shape (3,); None in a run of an earlier version of qlb"""
    contact_energy: float = 0.0
    """of the barrier or penalty [J]"""
    load_energy: float = 0.0
    """of loads and energies that were added [J]"""


class StepIterations(NamedTuple):
    """Nonlinear iterations by step, each of shape (steps,)."""

    steps: LongArray
    iterations: LongArray
    converged: BoolArray


class Run:
    """A run directory, read as needed. Everything raises `InputError` where a file is missing or damaged.

    Raises:
        InputError: the directory is not a qlb run, or of a format version that this qlb does not know.
    """

    def __init__(self, directory: Path) -> None:
        self.directory = Path(directory)
        self.id = layout.check_marker(self.directory)

    @cached_property
    def scene(self) -> dict[str, Any]:
        """The resolved scene as plain data."""
        return _parsed(self.directory / layout.SCENE, yaml.safe_load)

    @cached_property
    def summary(self) -> dict[str, Any]:
        """summary.json; of a run that was not finished, with what its statistics say."""
        summary = _parsed(self.directory / layout.SUMMARY, json.loads)
        if summary.get("status") == "running":
            steps = self.iterations_per_step().steps
            seconds = {part: float(self.stats[f"seconds_{part}"].sum()) for part in summary["seconds"]}
            summary |= summarise(count_steps(self.stats)) | {"steps": len(steps), "seconds": seconds}
            summary |= {"wall_seconds": sum(seconds.values()), "time": float(steps.max(initial=0) * summary["step"])}
        return summary

    @cached_property
    def mesh(self) -> TetMesh:
        """The bodies at rest."""
        return self.parts.mesh

    @cached_property
    def parts(self) -> Parts:
        """Bodies, obstacles and planes at rest, and which nodes belong to what."""
        return Parts.read(self.directory / layout.MESH)

    @cached_property
    def stats(self) -> Statistics:
        """The columns of stats.csv (`qlb.results.COLUMNS`) by name, each of shape (rows,)."""
        return read_statistics(self.directory / layout.STATS)

    @property
    def frame_steps(self) -> list[int]:
        """Steps that have a frame, in order."""
        return layout.frame_steps(self.directory)

    def frame(self, step: int) -> Frame:
        """The frame of a step. Raises `InputError` where there is none."""
        path = layout.frame_path(self.directory, step)
        if not path.is_file():
            have = self.frame_steps
            raise InputError(f"run {self.directory} has no frame of step {step}, only {_some(have)}")
        nodes, planes = self.parts.nodes, len(self.parts.planes)
        shapes: dict[str, tuple[int | None, ...]] = {"step": (), "time": ()}
        shapes |= {"positions": (nodes, 3), "velocities": (nodes, 3)}
        shapes |= {"plane_points": (planes, 3)} if planes else {}
        arrays = read_arrays(path, shapes)
        forces = arrays.get("contact_forces")
        given = {"contact_forces": (nodes, 3), "gravity": (3,), "contact_energy": (), "load_energy": ()}
        needed = {name: shape for name, shape in given.items() if name in arrays}
        needed |= {"plane_forces": (planes, 3)} if planes and forces is not None else {}
        require_shapes(path, arrays, needed)
        nothing = np.empty((0, 3))
        return Frame(
            int(arrays["step"]),
            float(arrays["time"]),
            arrays["positions"].astype(np.float64, copy=False),
            arrays["velocities"].astype(np.float64, copy=False),
            arrays.get("plane_points", nothing),
            None if forces is None else forces.astype(np.float64, copy=False),
            None if forces is None else arrays.get("plane_forces", nothing),
            arrays.get("gravity"),
            float(arrays.get("contact_energy", 0.0)),
            float(arrays.get("load_energy", 0.0)),
        )

    def frames(self) -> Iterator[Frame]:
        """Every frame in order, read one by one."""
        return map(self.frame, self.frame_steps)

    @cached_property
    def constitution(self) -> Constitution:
        """Materials, density and mass of the bodies."""
        path = self.directory / layout.MATERIALS
        if not path.exists():
            raise InputError(f"{path} does not exist: the run was written by an earlier version of qlb; run it again")
        arrays = read_arrays(path, {"kernels": (None,), "tets": (None, 2), "density": (None,), "mass": ()})
        try:
            return Constitution.from_arrays(self.mesh, arrays)
        except InputError as error:
            raise InputError(f"{path} is not what it should be: {error}") from None

    def snapshot(self, which: int | Frame) -> Snapshot:
        """Strain, stress, energies and momentum in a frame, given itself or its step."""
        frame = which if isinstance(which, Frame) else self.frame(which)
        return Snapshot(
            self.constitution,
            frame.time,
            frame.positions,
            frame.velocities,
            np.zeros_like(frame.positions) if frame.contact_forces is None else frame.contact_forces,
            frame.gravity,
            frame.contact_energy,
            frame.load_energy,
        )

    @cached_property
    def stages(self) -> int:
        """Solves that most steps have: the stages of the integrator."""
        whole = self.stats["parts"] == 1
        steps, stages = self.stats["step"][whole], self.stats["stage"][whole]
        if len(steps) == 0:
            return 1
        each = np.zeros(int(steps.max()) + 1, np.int64)
        np.maximum.at(each, steps, stages)
        return int(np.bincount(each[each > 0]).argmax())

    def iterations_per_step(self, stage: int | None = None) -> StepIterations:
        """Nonlinear iterations of each step that was tried, or of one stage of each step that has it."""
        counts = count_steps(self.stats, stage)
        return StepIterations(
            np.array([c.step for c in counts], np.int64),
            np.array([c.iterations for c in counts], np.int64),
            np.array([c.converged for c in counts], bool),
        )

    @cached_property
    def checkpoint(self) -> Checkpoint:
        """What the run needs to go on from its last finished step."""
        return Checkpoint.read(self.directory, self.id, self.parts.nodes)

    def restore(self, simulation: Simulation) -> None:
        """Set a simulation, set up as that of the run was, to where the checkpoint is.

        Raises:
            InputError: it is another simulation; the message says in what they differ.
        """
        self.require_same(simulation)
        checkpoint = self.checkpoint
        simulation.restore(checkpoint.state, checkpoint.steps_done, checkpoint.solver)

    def require_same(self, simulation: Simulation) -> None:
        """Raise `InputError` unless `simulation` has the mesh, integrator, solver and time step of the run."""
        kept, now = self.parts.arrays(), Parts.of(simulation.assembly).arrays()
        differ = [name for name in kept.keys() | now.keys() if not np.array_equal(kept.get(name, 0), now.get(name, 0))]
        if differ:
            raise InputError(
                f"run {self.directory} cannot go on: its {', '.join(sorted(differ))} differ from those of the"
                " simulation; has the scene or a mesh file changed?"
            )
        is_now = {"integrator": simulation.integrator.name, "solver": simulation.solver.name, "step": simulation.step}
        for name, value in is_now.items():
            if self.summary.get(name) != value:
                raise InputError(
                    f"run {self.directory} cannot go on: its {name} is {self.summary.get(name)!r}, that of the"
                    f" simulation is {value!r}"
                )


def _parsed(path: Path, parse: Callable[[str], object]) -> dict[str, Any]:
    try:
        data = parse(path.read_text(encoding="utf-8"))
    except OSError as error:
        raise InputError(f"{path} cannot be read: {error.strerror}") from None
    except (ValueError, yaml.YAMLError, RecursionError) as error:
        raise InputError(f"{path} is damaged: {' '.join(str(error).split())}") from None
    if not isinstance(data, dict):
        raise InputError(f"{path} is damaged: it holds {type(data).__name__}, must hold keys and values")
    return data


def _some(steps: list[int]) -> str:
    return f"{steps[0]} to {steps[-1]} ({len(steps)} frames)" if steps else "none"
