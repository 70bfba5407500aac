"""`qlb view`: the report of a run in the browser."""

from __future__ import annotations

import webbrowser
from pathlib import Path

from qlb.cli.output import console
from qlb.errors import InputError
from qlb.results import Run, finish_run, layout
from qlb.results.figure import PAGE

_MADE_FROM = (layout.SUMMARY, layout.STATS)


def view(directory: Path, *, show: bool) -> None:
    """Print where the page of a run or a study lies, and open it; that of a run is made where it is old.

    Raises:
        InputError: there is no page in the folder, and it is not a run.
        WriteError: the page could not be written.
    """
    page = _page(directory)
    console.print(str(page), soft_wrap=True, highlight=False, markup=False)
    if show:
        webbrowser.open(page.resolve().as_uri())


def _page(directory: Path) -> Path:
    pages = [directory / layout.REPORT, directory / PAGE]
    if not (directory / layout.MARKER).exists():
        found = next((page for page in pages if page.is_file()), None)
        if found is None:
            raise InputError(
                f"{directory} is not a run, a comparison, a sweep or figures of qlb: it has no {layout.MARKER} or page"
            )
        return found
    run, page = Run(directory), pages[0]
    sources = [run.directory / name for name in _MADE_FROM]
    newest = max((path.stat().st_mtime_ns for path in sources if path.exists()), default=0)
    if not page.is_file() or page.stat().st_mtime_ns < newest:
        return finish_run(directory)["report"]
    return page
