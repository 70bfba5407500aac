"""What a run needs to go on to the same bits."""

from __future__ import annotations

from dataclasses import dataclass, field
from pathlib import Path

import numpy as np

from qlb.arrays import FloatArray
from qlb.errors import InputError
from qlb.integrators import State
from qlb.results.clock import COUNTED
from qlb.results.files import Arrays, read_arrays, write_arrays
from qlb.simulation import Simulation

_SOLVER = "solver/"


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
    run: str = ""
    """id of the run that it belongs to"""

    @staticmethod
    def of(simulation: Simulation) -> Checkpoint:
        """The simulation as it is now. Arrays are not copied: neither time loop nor solver writes into them."""
        return Checkpoint(simulation.state, simulation.steps_done, simulation.solver.save())

    def write(self, path: Path) -> None:
        """Write a checkpoint.npz. Raises `WriteError`."""
        arrays: Arrays = {"run": np.array(self.run), "step": np.array(self.steps_done), **_state_arrays(self.state)}
        arrays["seconds"] = np.array([self.seconds.get(name, 0.0) for name in COUNTED])
        if self.state.previous is not None:
            arrays |= {f"previous_{name}": array for name, array in _state_arrays(self.state.previous).items()}
        write_arrays(path, arrays | {_SOLVER + name: array for name, array in self.solver.items()})

    @staticmethod
    def read(path: Path, nodes: int) -> Checkpoint:
        """Read a checkpoint.npz of a mesh with `nodes` nodes.

        Raises:
            InputError: it is missing, damaged, or of another mesh.
        """
        arrays = read_arrays(path, {"run": (), "step": (), "seconds": (len(COUNTED),), **_state_shapes("", nodes)})
        previous = None
        if "previous_time" in arrays:
            if set(_state_shapes("previous_", nodes)) - set(arrays):
                raise InputError(f"{path} is not what it should be: its previous state is not whole")
            previous = _state(arrays, "previous_", None)
        solver = {name.removeprefix(_SOLVER): a for name, a in arrays.items() if name.startswith(_SOLVER)}
        seconds = dict(zip(COUNTED, arrays["seconds"].tolist(), strict=True))
        return Checkpoint(_state(arrays, "", previous), int(arrays["step"]), solver, seconds, str(arrays["run"]))


def _state_arrays(state: State) -> Arrays:
    return {"time": np.array(state.time), "positions": state.positions, "velocities": state.velocities}


def _state_shapes(prefix: str, nodes: int) -> dict[str, tuple[int | None, ...]]:
    return {f"{prefix}time": (), f"{prefix}positions": (nodes, 3), f"{prefix}velocities": (nodes, 3)}


def _state(arrays: Arrays, prefix: str, previous: State | None) -> State:
    x, v = arrays[f"{prefix}positions"], arrays[f"{prefix}velocities"]
    return State(float(arrays[f"{prefix}time"]), x, v, previous)
