"""The exceptions that qlb raises; all derive from `QlbError`."""

from __future__ import annotations

from typing import TYPE_CHECKING

if TYPE_CHECKING:
    from qlb.simulation import StepResult


class QlbError(Exception):
    """Base of every error that qlb raises on purpose."""


class InputError(QlbError, ValueError):
    """The input was wrong: one line that names the thing, its value and the allowed range."""


class StepFailed(QlbError, RuntimeError):
    """A time step did not converge.

    Attributes:
        result: the `StepResult` of the failed step; its state was not taken over by the simulation.
    """

    def __init__(self, message: str, result: StepResult) -> None:
        super().__init__(message)
        self.result = result
