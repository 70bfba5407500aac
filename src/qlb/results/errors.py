"""What can go wrong when results are written or shown, other than wrong input."""

from __future__ import annotations

from pathlib import Path

from qlb.errors import MissingExtra as MissingExtra
from qlb.errors import QlbError


class WriteError(QlbError, OSError):
    """A file could not be written: the disk is full, the folder is gone, a permission is missing.

    Attributes:
        path: the file.
        reason: what the system said.
    """

    def __init__(self, path: Path, reason: str, safe: str = "files written earlier are whole") -> None:
        super().__init__(f"cannot write {path}: {reason}; {safe}")
        self.path = path
        self.reason = reason


class RenderingFailed(QlbError, RuntimeError):
    """No picture can be rendered here, mostly because there is no OpenGL driver."""
