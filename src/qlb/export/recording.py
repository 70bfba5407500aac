"""The frames of a run that are exported."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from dataclasses import dataclass
from functools import cached_property

from qlb.errors import InputError
from qlb.results import Frame, Run, layout


@dataclass(frozen=True)
class Recording:
    """Chosen frames of a run, read one by one.

    Args:
        run: the run.
        steps: of the frames, in order.
        on_frame: called after each frame that is written.
    """

    run: Run
    steps: list[int]
    on_frame: Callable[[], None] = lambda: None

    @staticmethod
    def of(run: Run, steps: str = "", on_frame: Callable[[], None] = lambda: None) -> Recording:
        """Those that `steps` chooses: "A:B:C", every C-th frame of steps A to B, any part left out; or one step "A".

        Raises:
            InputError: `steps` is something else, or no frame is chosen.
        """
        have = run.frame_steps
        if not have:
            raise InputError(f"run {run.directory} has no frames to export")
        first, last, every = _parsed(steps)
        chosen = [s for s in have if (first is None or s >= first) and (last is None or s <= last)][::every]
        if not chosen:
            raise InputError(
                f"steps {steps!r} choose no frame of run {run.directory}: it has {have[0]} to {have[-1]}"
                f" ({len(have)} frames)"
            )
        return Recording(run, chosen, on_frame)

    @cached_property
    def without_stress(self) -> str | None:
        """Why stress cannot be had; None where it can."""
        if not (self.run.directory / layout.MATERIALS).exists():
            return "the run was written by an earlier version of qlb, which kept no materials"
        return None if self.run.constitution.is_known else "a material is a density of the user's own"

    @cached_property
    def has_contact(self) -> bool:
        """Whether anything can touch."""
        return self.run.summary.get("contact") is not None

    def frames(self) -> Iterator[Frame]:
        """Each frame; it counts as written when the next is asked for."""
        for frame in self.read():
            yield frame
            self.on_frame()

    def read(self) -> Iterator[Frame]:
        """Each frame, without a word to `on_frame`."""
        return map(self.run.frame, self.steps)


def _parsed(text: str) -> tuple[int | None, int | None, int]:
    """First and last step, and which of the frames between."""
    parts = text.split(":")
    try:
        numbers = [int(part) if part.strip() else None for part in parts]
    except ValueError:
        numbers = []
    if not 1 <= len(numbers) <= 3 or any(number is not None and number < 0 for number in numbers):
        raise InputError(f"steps = {text!r} must be A:B:C, every C-th frame of steps A to B, or one step A >= 0")
    if len(numbers) == 1:
        return numbers[0], numbers[0], 1
    every = numbers[2] if len(numbers) == 3 else None
    if every == 0:
        raise InputError(f"steps = {text!r} are out of range: every 0-th frame, must be >= 1")
    return numbers[0], numbers[1], every or 1
