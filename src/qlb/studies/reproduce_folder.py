"""The folder that `reproduce` writes: a marker with the settings of its runs, the runs, the figures.

reproduce.json      the marker, written first: the scenes' settings before any row changes them
runs/NAME           a run directory for each case
figure-N.*          png, svg, pdf and csv
index.html          all figures on one page
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from qlb.errors import InputError
from qlb.results import WriteError, layout
from qlb.results.figure import FORMATS
from qlb.results.figure_page import PAGE
from qlb.results.files import write_text
from qlb.results.report import flatten
from qlb.studies.reproduce_figures import FIGURES

FORMAT = "qlb reproduce"
VERSION = 1
MARKER = "reproduce.json"
RUNS = "runs"


def claim_folder(
    directory: Path, bases: Mapping[str, Mapping[str, Any]], runs: Sequence[Path], *, overwrite: bool
) -> None:
    """Make `directory` a folder for figures of these settings, or see that it is one.

    Args:
        directory: the folder.
        bases: the settings of each scene.
        runs: the run directories that will be written.
        overwrite: take over a folder with figures of other settings.

    Raises:
        InputError: it holds anything else, or figures of other settings, or cannot be written.
        WriteError: the marker could not be written.
    """
    if os.path.lexists(directory) and not directory.is_dir():
        raise InputError(f"output folder {directory} is a file; choose another")
    try:
        used = directory.is_dir() and any(directory.iterdir())
        kept = _read_marker(directory) if used else {}
        if not overwrite:
            _check_settings(directory, kept, bases)
        for run in runs:
            layout.check_free(run, overwrite=True)
        directory.mkdir(parents=True, exist_ok=True)
        if overwrite:
            _clear(directory)
        _write_marker(directory, bases if overwrite else {**kept, **bases})
    except WriteError:
        raise
    except OSError as error:
        raise InputError(f"output folder {directory} cannot be written: {error.strerror}; choose another") from None


def _read_marker(directory: Path) -> dict[str, dict[str, Any]]:
    """The settings by scene that the marker holds."""
    try:
        marker = json.loads((directory / MARKER).read_text(encoding="utf-8"))
        if marker["format"] == FORMAT and marker["version"] == VERSION:
            return dict(marker["scenes"])
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        pass
    raise InputError(f"output folder {directory} holds files that are not of qlb reproduce; choose another")


def _write_marker(directory: Path, bases: Mapping[str, Mapping[str, Any]]) -> None:
    created = datetime.now(UTC).isoformat(timespec="seconds")
    marker = {"format": FORMAT, "version": VERSION, "created": created, "scenes": dict(bases)}
    write_text(directory / MARKER, json.dumps(marker, indent=2) + "\n")


def _check_settings(
    directory: Path, kept: Mapping[str, Mapping[str, Any]], bases: Mapping[str, Mapping[str, Any]]
) -> None:
    """Raise `InputError` where a key that both have differs; keys that only one has are of another qlb."""
    for scene in kept.keys() & bases.keys():
        old, new = flatten(kept[scene]), flatten(bases[scene])
        for key in new:
            if old.get(key, new[key]) != new[key]:
                raise InputError(
                    f"output folder {directory} holds figures with {key} = {old[key]}, not {new[key]}; choose another"
                    " or use --overwrite"
                )


def _clear(directory: Path) -> None:
    """Delete figures and page; runs are replaced when their turn comes."""
    names = [f"figure-{number}.{suffix}" for number in FIGURES for suffix in (*FORMATS, "csv")]
    for name in (*names, PAGE):
        (directory / name).unlink(missing_ok=True)
