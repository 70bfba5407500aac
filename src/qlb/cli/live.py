"""`qlb run --live`: the run in a browser while it goes."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import contextmanager
from pathlib import Path

from qlb.cli.output import errors


@contextmanager
def shown_live(wanted: bool) -> Iterator[Callable[[Path], None]]:
    """A function to call when the folder of the run is there; nothing happens unless `wanted`."""
    if not wanted:
        yield lambda directory: None
        return
    from qlb.results.live import LiveView, require_scripts

    require_scripts()
    views: list[LiveView] = []
    try:
        yield lambda directory: views.append(LiveView(directory, _announce))
    finally:
        for view in views:
            view.close()


def _announce(address: str) -> None:
    errors.print(f"live        {address}", soft_wrap=True, highlight=False)
