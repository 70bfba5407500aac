"""Where the seconds of a run go."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from time import perf_counter

PARTS = ("gradient", "hessian", "factor", "solve", "other")
"""Parts of a step: energy with gradient; Hessian assembly; factorisation; search directions; all the rest."""


class Timer:
    """Adds up wall-clock seconds by part; what no section claims is "other"."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget everything counted so far."""
        self.seconds = dict.fromkeys(PARTS, 0.0)
        self._last = perf_counter()
        self._before = dict(self.seconds)

    @contextmanager
    def section(self, part: str) -> Iterator[None]:
        """Count the time of the block as `part`."""
        start = perf_counter()
        try:
            yield
        finally:
            self.seconds[part] += perf_counter() - start

    def lap(self) -> dict[str, float]:
        """Seconds by part since the last lap (or the start)."""
        now = perf_counter()
        claimed = {part: self.seconds[part] - self._before[part] for part in PARTS if part != "other"}
        claimed["other"] = max(0.0, now - self._last - sum(claimed.values()))
        self.seconds["other"] += claimed["other"]
        self._last, self._before = now, dict(self.seconds)
        return claimed
