"""What a run needs to go on to the same bits: small files that lean on the frames."""

from __future__ import annotations

import re
from collections.abc import Iterable, Mapping, Sequence
from contextlib import suppress
from dataclasses import dataclass, field
from itertools import chain
from pathlib import Path
from typing import NamedTuple

import numpy as np

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.integrators import State
from qlb.results import layout
from qlb.results.clock import COUNTED
from qlb.results.files import Arrays, read_arrays, read_checked, require_shapes, whole_file, write_arrays
from qlb.simulation import Simulation

_SOLVER = "solver/"
_PREVIOUS = "previous_"
_SMALL = 4096
"""Arrays of up to so many bytes lie in checkpoint.npz itself."""
_FILE = re.compile(rf"({layout.FRAMES}/|{layout.CHECKPOINT_PART})\d{{6,}}\.npz")


@dataclass(frozen=True)
class Checkpoint:
    """A simulation between two steps; `Simulation.restore(state, steps_done, solver)` takes it up again."""

    state: State
    steps_done: int
    """how many steps lie behind `state`"""
    solver: dict[str, FloatArray]
    """what `solver.save()` gave"""
    seconds: dict[str, float] = field(default_factory=dict)
    """what the clock of the run counted so far (`LoopClock.saved`) [s]"""

    @staticmethod
    def of(simulation: Simulation) -> Checkpoint:
        """The simulation as it is now. Arrays are not copied: neither time loop nor solver writes into them."""
        return Checkpoint(simulation.state, simulation.steps_done, simulation.solver.save())

    def arrays(self) -> Arrays:
        """State, previous state and solver as named arrays."""
        arrays = _state_arrays("", self.state)
        if self.state.previous is not None:
            arrays |= _state_arrays(_PREVIOUS, self.state.previous)
        return arrays | {_SOLVER + name: array for name, array in self.solver.items()}

    @staticmethod
    def read(directory: Path, run: str, nodes: int) -> Checkpoint:
        """Read the checkpoint of a run with that id, whose mesh has `nodes` nodes.

        Raises:
            InputError: it, or a file that it leans on, is missing or damaged, or is of another run or mesh.
        """
        path = whole_file(directory / layout.CHECKPOINT)
        own = read_arrays(path, {"run": (), "step": (), "seconds": (len(COUNTED),), "elsewhere": (None, len(_FIELDS))})
        if str(own["run"]) != run:
            raise InputError(f"{path} is the checkpoint of another run: {str(own['run'])!r}, must be {run!r}")
        arrays = own | _read_elsewhere(path, own["elsewhere"].astype(str).tolist())
        require_shapes(path, arrays, _state_shapes("", nodes))
        previous = None
        if f"{_PREVIOUS}time" in arrays:
            require_shapes(path, arrays, _state_shapes(_PREVIOUS, nodes))
            previous = _state(arrays, _PREVIOUS, None)
        solver = {name.removeprefix(_SOLVER): a for name, a in arrays.items() if name.startswith(_SOLVER)}
        seconds = dict(zip(COUNTED, own["seconds"].tolist(), strict=True))
        return Checkpoint(_state(arrays, "", previous), int(own["step"]), solver, seconds)


class Place(NamedTuple):
    """Where an array lies that checkpoint.npz does not hold itself."""

    file: str
    """path from the run directory"""
    member: str
    """its name there"""
    crc: int
    """its CRC-32 there"""


_FIELDS = ("array", *Place._fields)


class CheckpointWriter:
    """Writes checkpoints one after the other, none of which repeats what lies in a frame or did not change.

    Large arrays that are in no file yet go into one of their own, which stays as long as the checkpoint names it.
    checkpoint.npz takes the place of the last one when all that it names is there.

    Args:
        directory: a run directory, which this process has locked.
        run: the id of the run.
    """

    def __init__(self, directory: Path, run: str) -> None:
        self._directory, self._run = directory, run
        self._kept: list[tuple[FloatArray, Place]] = []
        self._parts: set[str] | None = None

    def write(self, checkpoint: Checkpoint, frame: Iterable[tuple[FloatArray, Place]]) -> None:
        """Write a checkpoint, given where the arrays are that its frame holds to all digits. Raises `WriteError`."""
        arrays = checkpoint.arrays()
        known = [*frame, *self._kept]
        places = {name: _find(array, known) for name, array in arrays.items() if array.nbytes > _SMALL}
        new = {name: arrays[name] for name, place in places.items() if place is None}
        if new:
            file = layout.checkpoint_part(self._directory, checkpoint.steps_done)
            crc = write_arrays(file, new)
            places |= {name: Place(file.name, name, crc[name]) for name in new}
        found = {name: place for name, place in places.items() if place is not None}
        own = {name: array for name, array in arrays.items() if name not in found}
        own |= {"run": np.array(self._run), "step": np.array(checkpoint.steps_done)}
        own["seconds"] = np.array([checkpoint.seconds.get(name, 0.0) for name in COUNTED])
        own["elsewhere"] = np.array([(name, *map(str, place)) for name, place in found.items()], str)
        own["elsewhere"] = own["elsewhere"].reshape(-1, len(_FIELDS))
        write_arrays(self._directory / layout.CHECKPOINT, own, aside=True)
        self._kept = [(arrays[name], place) for name, place in found.items()]
        self._remove_all_but({file for file, *_ in found.values() if file.startswith(layout.CHECKPOINT_PART)})

    def _remove_all_but(self, parts: set[str]) -> None:
        """Delete files that the checkpoint does not name any more."""
        if parts != self._parts:
            with suppress(OSError):  # they are in nobody's way
                layout.remove_checkpoint_parts(self._directory, keep=parts)
            self._parts = parts


def _find(array: FloatArray, known: Sequence[tuple[FloatArray, Place]]) -> Place | None:
    """Where an array with the same bits lies."""
    same = (place for other, place in known if array is other)
    equal = (place for other, place in known if array.shape == other.shape and _bits(array) == _bits(other))
    return next(chain(same, equal), None)


def _bits(array: FloatArray) -> memoryview:
    return np.ascontiguousarray(array).data.cast("B")


def _read_elsewhere(checkpoint: Path, rows: list[list[str]]) -> Arrays:
    """The arrays that the table `elsewhere` of a checkpoint.npz names."""
    members: dict[str, dict[str, int]] = {}
    for _, file, member, crc in rows:
        if not _FILE.fullmatch(file) or not crc.isdecimal():
            raise InputError(f"{checkpoint} is not what it should be: it leans on {file!r}, which no run writes")
        members.setdefault(file, {})[member] = int(crc)
    try:
        read = {file: read_checked(checkpoint.parent / file, crc) for file, crc in members.items()}
    except InputError as error:
        raise InputError(f"{checkpoint} leans on a file that is not as it was: {error}") from None
    return {name: read[file][member] for name, file, member, _ in rows}


def _state_arrays(prefix: str, state: State) -> Arrays:
    arrays = {"time": np.array(state.time), "positions": state.positions, "velocities": state.velocities}
    return {prefix + name: array for name, array in arrays.items()}


def _state_shapes(prefix: str, nodes: int) -> Mapping[str, tuple[int | None, ...]]:
    return {f"{prefix}time": (), f"{prefix}positions": (nodes, 3), f"{prefix}velocities": (nodes, 3)}


def _state(arrays: Arrays, prefix: str, previous: State | None) -> State:
    x, v = arrays[f"{prefix}positions"], arrays[f"{prefix}velocities"]
    return State(float(arrays[f"{prefix}time"]), x, v, previous)
