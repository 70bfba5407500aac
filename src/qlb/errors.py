"""The base of the exceptions that qlb raises, and the one for wrong input."""

from __future__ import annotations


class QlbError(Exception):
    """Base of every error that qlb raises on purpose."""


class InputError(QlbError, ValueError):
    """The input was wrong: one line that names the thing, its value and the allowed range."""


class MissingExtra(QlbError, ImportError):
    """A package that an optional part of qlb needs is not installed; the message says how to get it."""


class QlbWarning(UserWarning):
    """Something that works and is likely not what was meant."""
