"""What the library says on the way, such as that a surface had holes, on the terminal."""

from __future__ import annotations

import logging

from rich.markup import escape

from qlb.cli.output import errors


class _Notes(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        style = "yellow" if record.levelno >= logging.WARNING else "dim"
        errors.print(f"[{style}]note:[/] {escape(record.getMessage())}", soft_wrap=True, highlight=False)


def show_notes() -> None:
    """Print what goes to the logger `qlb` as "note: ..." on standard error, once for each call of the program."""
    logger = logging.getLogger("qlb")
    logger.setLevel(logging.INFO)
    if not any(isinstance(handler, _Notes) for handler in logger.handlers):
        logger.addHandler(_Notes())
