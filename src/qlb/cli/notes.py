"""What the library says on the way, such as that a surface had holes, on the terminal."""

from __future__ import annotations

import logging
from collections.abc import Iterator
from contextlib import contextmanager

from rich.markup import escape

from qlb.cli.output import errors


class _Notes(logging.Handler):
    def emit(self, record: logging.LogRecord) -> None:
        style = "yellow" if record.levelno >= logging.WARNING else "dim"
        errors.print(f"[{style}]note:[/] {escape(record.getMessage())}", soft_wrap=True, highlight=False)


@contextmanager
def show_notes() -> Iterator[None]:
    """Within it, what goes to the logger `qlb` is printed on standard error as "note: ..."."""
    logger, notes = logging.getLogger("qlb"), _Notes()
    level = logger.level
    logger.setLevel(logging.INFO)
    logger.addHandler(notes)
    try:
        yield
    finally:
        logger.removeHandler(notes)
        logger.setLevel(level)
