"""Cases in parallel, each in a process of its own, so that one that crashes takes no other with it."""

from __future__ import annotations

import json
import signal
import subprocess
import sys
from collections import deque
from collections.abc import Callable, Sequence
from dataclasses import dataclass, field
from pathlib import Path
from queue import Empty, Queue
from threading import Thread
from typing import Any, Literal

WORKER = (sys.executable, "-P", "-m", "qlb.studies.worker")
"""The command that runs a case; see there for what it reads and writes."""

REFUSED = 2
"""Exit status of a process whose scene cannot be built."""

_SECONDS_BETWEEN_LOOKS = 0.2


@dataclass(frozen=True)
class Case:
    """One run of a study."""

    name: str
    """of its folder, such as young-6e3-QLF"""
    scene: dict[str, Any]
    """the resolved scene as plain data"""
    directory: Path
    weight: float = 1.0
    """expected work of a step, to start the longest first"""
    cwd: Path = field(default_factory=Path.cwd)
    """what relative paths in the scene start from"""

    @property
    def steps(self) -> int:
        """Time steps that it takes."""
        return int(self.scene["steps"])


@dataclass(frozen=True)
class Update:
    """What became of a case."""

    case: Case
    state: Literal["kept", "step", "finished", "refused", "crashed"]
    """kept: it lay there complete; step: it took one more step; refused: its scene cannot be built"""
    steps: int
    """taken so far"""
    message: str = ""
    """why it was refused or crashed"""


def run_cases(
    cases: Sequence[Case],
    *,
    processes: int,
    on_update: Callable[[Update], None],
    stop: Callable[[], bool],
) -> dict[str, str]:
    """Run cases, at most `processes` at a time and those with most work first.

    Args:
        cases: what to run, each into its directory; an earlier run there is replaced.
        processes: how many at a time.
        on_update: called in this thread after each step and at the end of each case.
        stop: asked all the time whether to end early; cases under way are then ended and stay half done.

    Returns:
        why each case that did not end as it should did not, by its name.
    """
    waiting = deque(sorted(cases, key=lambda case: -case.weight * case.steps))
    running: dict[str, subprocess.Popen[str]] = {}
    updates: Queue[Update] = Queue()
    problems: dict[str, str] = {}
    try:
        while (waiting or running) and not stop():
            while waiting and len(running) < processes:
                case = waiting.popleft()
                running[case.name] = _start(case, updates)
            try:
                update = updates.get(timeout=_SECONDS_BETWEEN_LOOKS)
            except Empty:
                continue
            if update.state != "step":
                del running[update.case.name]
            if update.state in ("refused", "crashed"):
                problems[update.case.name] = update.message
            on_update(update)
    finally:
        for process in running.values():
            process.kill()
        for process in running.values():
            process.wait()
    return problems


def _start(case: Case, updates: Queue[Update]) -> subprocess.Popen[str]:
    """Start a case; a session of its own keeps the terminal's Ctrl-C from it."""
    process = subprocess.Popen(
        WORKER,
        stdin=subprocess.PIPE,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
        errors="replace",
        start_new_session=True,
        cwd=case.cwd,
    )
    Thread(target=_follow, args=(case, process, updates), daemon=True).start()
    return process


def _follow(case: Case, process: subprocess.Popen[str], updates: Queue[Update]) -> None:
    """Hand the case to its process, and on what that says; in a thread, until it ends."""
    assert process.stdin is not None
    assert process.stdout is not None
    steps, last, taken = 0, "", True
    try:
        with process.stdin as pipe:
            json.dump({"scene": case.scene, "directory": str(case.directory)}, pipe)
    except OSError:  # it ended before it read its case: its exit status says why
        taken = False
    with process.stdout as lines:
        for line in map(str.strip, lines):
            word, _, number = line.partition(" ")
            if word == "step" and number.isdigit():
                steps = int(number)
                updates.put(Update(case, "step", steps))
            elif line:
                last = line
    status = process.wait()
    if status == 0 and taken:
        updates.put(Update(case, "finished", steps))
    else:
        state: Literal["refused", "crashed"] = "refused" if status == REFUSED else "crashed"
        updates.put(Update(case, state, steps, last if status > 0 and last else _ending(status)))


def _ending(status: int) -> str:
    """An exit status in words."""
    if status < 0:
        try:
            return f"killed by {signal.Signals(-status).name}"
        except ValueError:
            return f"killed by signal {-status}"
    return f"exit status {status}"
