"""Time of the time loop alone."""

from __future__ import annotations

from collections.abc import Iterator, Mapping
from contextlib import contextmanager
from time import perf_counter, process_time

from qlb.timing import PARTS, Timer

COUNTED = ("wall", "cpu", *PARTS)
"""What a clock counts."""


class LoopClock:
    """Runs from when it is made, except inside `stopped()`, whose time it keeps out of the simulation's timer too.

    Attributes:
        wall: seconds by the wall clock.
        cpu: seconds of all threads of the process.

    Args:
        timer: that of the simulation.
        earlier: what `saved()` gave before a run was resumed.
    """

    def __init__(self, timer: Timer, earlier: Mapping[str, float] | None = None) -> None:
        before = earlier or {}
        self.wall, self.cpu = before.get("wall", 0.0), before.get("cpu", 0.0)
        self._timer = timer
        timer.lap()
        self._before = {part: timer.seconds[part] - before.get(part, 0.0) for part in PARTS}
        self._start = (perf_counter(), process_time())

    @property
    def seconds(self) -> dict[str, float]:
        """Wall-clock seconds by part (`qlb.timing.PARTS`); they add up to `wall`, but for rounding."""
        return {part: self._timer.seconds[part] - self._before[part] for part in PARTS}

    def saved(self) -> dict[str, float]:
        """All seconds by name (`COUNTED`), for a checkpoint."""
        return {"wall": self.wall, "cpu": self.cpu, **self.seconds}

    @contextmanager
    def stopped(self) -> Iterator[None]:
        """Do not count the time of the block."""
        self._timer.lap()
        self.wall += perf_counter() - self._start[0]
        self.cpu += process_time() - self._start[1]
        try:
            yield
        finally:
            lost = self._timer.lap()["other"]
            self._timer.seconds["other"] -= lost
            self._start = (perf_counter(), process_time())
