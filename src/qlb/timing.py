"""Where the seconds of a run go."""

from __future__ import annotations

from time import perf_counter

PARTS = ("gradient", "hessian", "factor", "solve", "contact", "candidates", "other")
"""Parts of a step: energy with gradient; Hessian assembly; factorisation; search directions; energy, forces and Hessian
of contact; candidates and step bounds; all the rest."""


CLAIMED = PARTS[:-1]
"""What sections claim."""


class Section:
    """A `with` block whose seconds are added to a part, also where it raises."""

    def __init__(self, seconds: dict[str, float], part: str) -> None:
        self._seconds, self._part = seconds, part

    def __enter__(self) -> None:
        self._start = perf_counter()

    def __exit__(self, *error: object) -> None:
        self._seconds[self._part] += perf_counter() - self._start


class Timer:
    """Adds up wall-clock seconds by part; what no section claims is "other"."""

    def __init__(self) -> None:
        self.restart()

    def restart(self) -> None:
        """Forget everything counted so far."""
        self.seconds = dict.fromkeys(PARTS, 0.0)
        self._last = perf_counter()
        self._before = dict(self.seconds)

    def section(self, part: str) -> Section:
        """Count the time of a `with` block as `part`."""
        return Section(self.seconds, part)

    def lap(self) -> dict[str, float]:
        """Seconds by part since the last lap (or the start)."""
        now, seconds, before = perf_counter(), self.seconds, self._before
        claimed = {part: seconds[part] - before[part] for part in CLAIMED}
        claimed["other"] = max(0.0, now - self._last - sum(claimed.values()))
        seconds["other"] += claimed["other"]
        self._last, self._before = now, seconds.copy()
        return claimed
