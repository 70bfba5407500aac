"""One case in a process of its own: `python -m qlb.studies.worker`, started by `processes`.

Reads {"scene": the resolved scene, "directory": the run directory} from standard input and writes a line "step N" to
standard output after each step. Exit status 0: the run is complete; 1: it is not, 2: its scene cannot be built, and the
last line says why.
"""

from __future__ import annotations

import json
import sys
from pathlib import Path

from qlb.errors import InputError, QlbError
from qlb.scenes import SCENES
from qlb.step_result import StepResult
from qlb.studies.processes import REFUSED
from qlb.studies.run import run_scene


def main() -> int:
    """Run the case; the exit status."""
    job = json.load(sys.stdin)
    scene = SCENES[job["scene"]["scene"]].parse(job["scene"])
    try:
        outcome = run_scene(scene, Path(job["directory"]), overwrite=True, on_step=_tell)
    except QlbError as error:
        sys.stdout.write(f"{error}\n")
        return REFUSED if isinstance(error, InputError) else 1
    if outcome.summary["status"] != "complete":
        sys.stdout.write(f"{outcome.summary['error'] or outcome.summary['status']}\n")
        return 1
    return 0


def _tell(result: StepResult) -> None:
    sys.stdout.write(f"step {result.step}\n")
    sys.stdout.flush()


if __name__ == "__main__":
    sys.exit(main())
