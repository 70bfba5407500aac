"""One scene, run into a directory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from qlb.errors import InputError
from qlb.results import Run, RunWriter
from qlb.results.layout import SCENE
from qlb.scenes import Scene, load_scene
from qlb.simulation import Simulation
from qlb.step_result import StepFailed, StepResult


@dataclass(frozen=True)
class Outcome:
    """How a run ended."""

    directory: Path
    summary: dict[str, Any]
    """as in summary.json"""

    @property
    def run(self) -> Run:
        """The run, to be read."""
        return Run(self.directory)


def run_scene(
    scene: Scene,
    directory: Path,
    *,
    overwrite: bool = False,
    on_start: Callable[[Path], None] = lambda directory: None,
    on_step: Callable[[StepResult], None] = lambda result: None,
    stop: Callable[[], bool] = lambda: False,
) -> Outcome:
    """Run `scene` into `directory`, keeping every finished step whatever happens.

    Args:
        scene: what to run.
        directory: where; made, and refused if it holds anything.
        overwrite: replace an earlier run there, with its exports.
        on_start: called with the directory when it holds the first frame.
        on_step: called after each step, the failed one included.
        stop: asked before each step whether to end early.

    Raises:
        InputError: the scene cannot be built, or the directory cannot be used.
    """
    simulation = scene.build()
    with scene.located():
        _ = simulation.system  # what only shows when everything is there
    writer = RunWriter(
        directory, scene.model_dump(mode="json"), simulation, overwrite=overwrite, **scene.output.model_dump()
    )
    if overwrite:
        from qlb.export import remove_exports

        remove_exports(directory)
    return _record(writer, simulation, scene.steps, on_start, on_step, stop)


def resume_run(
    directory: Path,
    *,
    steps: int | None = None,
    on_start: Callable[[Path], None] = lambda directory: None,
    on_step: Callable[[StepResult], None] = lambda result: None,
    stop: Callable[[], bool] = lambda: False,
) -> Outcome:
    """Go on with a run from its last finished step, to the same bits as if it had never been broken off.

    Args:
        directory: a run directory that `run_scene` wrote.
        steps: how many steps the run is to have in all; by default as many as its scene says.
        on_start: called with the directory when it is locked and can be read.
        on_step: called after each new step, the failed one included.
        stop: asked before each step whether to end early.

    Raises:
        InputError: no run, or a damaged one; the scene cannot be built, or is not what it was (as with a mesh file that
            has changed); another process writes there; fewer steps than are done.
    """
    run, scene = Run(directory), scene_of(directory, steps)
    done = run.checkpoint.steps_done
    if scene.steps < done:
        raise InputError(f"steps = {scene.steps} is out of range: must be >= {done}, as many as run {directory} has")
    simulation = scene.build()
    run.restore(simulation)
    writer = RunWriter(directory, scene.model_dump(mode="json"), simulation, resume=True, **scene.output.model_dump())
    return _record(writer, simulation, scene.steps, on_start, on_step, stop)


def scene_of(directory: Path, steps: int | None = None) -> Scene:
    """The scene of a run, with another number of steps where given.

    Raises:
        InputError: no run, or its scene is not one of qlb's, such as that of a script.
    """
    return load_scene(str(Run(directory).directory / SCENE), [] if steps is None else [f"steps={steps}"])


def _record(
    writer: RunWriter,
    simulation: Simulation,
    steps: int,
    on_start: Callable[[Path], None],
    on_step: Callable[[StepResult], None],
    stop: Callable[[], bool],
) -> Outcome:
    """Step until `steps` are done, or one fails, or it is to stop."""
    try:
        with writer:
            on_start(writer.directory)
            while simulation.steps_done < steps:
                if stop():
                    writer.finish("interrupted")
                    break
                result = simulation.advance()
                writer.record(result)
                on_step(result)
    except StepFailed as failure:  # the writer has kept it
        on_step(failure.result)
    except KeyboardInterrupt:
        pass
    return Outcome(writer.directory, Run(writer.directory).summary)
