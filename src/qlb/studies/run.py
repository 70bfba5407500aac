"""One scene, run into a directory."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from qlb.results import Run, RunWriter
from qlb.scenes import Scene
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
        overwrite: replace an earlier run there.
        on_start: called with the directory when it holds the first frame.
        on_step: called after each step, the failed one included.
        stop: asked before each step whether to end early.

    Raises:
        InputError: the scene cannot be built, or the directory cannot be used.
    """
    simulation = scene.build()
    plain, stride = scene.model_dump(mode="json"), scene.output.stride
    try:
        with RunWriter(directory, plain, simulation, overwrite=overwrite, stride=stride) as writer:
            on_start(directory)
            for _ in range(scene.steps):
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
    return Outcome(directory, Run(directory).summary)
