"""The base of the exceptions that qlb raises, and the one for wrong input."""

from __future__ import annotations


class QlbError(Exception):
    """Base of every error that qlb raises on purpose."""


class InputError(QlbError, ValueError):
    """The input was wrong: one line that names the thing, its value and the allowed range."""
