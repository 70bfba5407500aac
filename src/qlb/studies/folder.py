"""The folder of a study: a marker with the settings of its runs, written first, the runs, and what is made of them.

reproduce.json or sweep.json    the marker: the scenes' settings before anything changes them
runs/NAME                       a run directory for each case
"""

from __future__ import annotations

import json
import os
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from datetime import UTC, datetime
from pathlib import Path
from typing import Any

from qlb.errors import InputError
from qlb.results import Run, WriteError, layout
from qlb.results.files import write_text
from qlb.results.wording import flatten
from qlb.studies.processes import Case

VERSION = 1
RUNS = "runs"


@dataclass(frozen=True)
class StudyKind:
    """What tells the folders of a study from others."""

    command: str
    """such as "qlb reproduce", also the format in the marker"""
    marker: str
    """a file name"""
    products: Sequence[str]
    """names of the files that are made of the runs"""


def claim_folder(
    kind: StudyKind,
    directory: Path,
    bases: Mapping[str, Mapping[str, Any]],
    runs: Sequence[Path],
    *,
    overwrite: bool,
) -> None:
    """Make `directory` a folder for runs of these settings, or see that it is one.

    Args:
        kind: of which study.
        directory: the folder.
        bases: the settings of each scene.
        runs: the run directories that will be written.
        overwrite: take over a folder with runs of other settings.

    Raises:
        InputError: it holds anything else, or runs of other settings, or cannot be written.
        WriteError: the marker could not be written.
    """
    if os.path.lexists(directory) and not directory.is_dir():
        raise InputError(f"output folder {directory} is a file; choose another")
    try:
        used = directory.is_dir() and any(directory.iterdir())
        kept = _read_marker(kind, directory) if used else {}
        if not overwrite:
            _check_settings(directory, kept, bases)
        for run in runs:
            layout.check_free(run, overwrite=True)
        directory.mkdir(parents=True, exist_ok=True)
        if overwrite:
            _clear(kind, directory)
        _write_marker(kind, directory, bases if overwrite else {**kept, **bases})
    except WriteError:
        raise
    except OSError as error:
        raise InputError(f"output folder {directory} cannot be written: {error.strerror}; choose another") from None


def _read_marker(kind: StudyKind, directory: Path) -> dict[str, dict[str, Any]]:
    """The settings by scene that the marker holds."""
    try:
        marker = json.loads((directory / kind.marker).read_text(encoding="utf-8"))
        if marker["format"] == kind.command and marker["version"] == VERSION:
            return dict(marker["scenes"])
    except (FileNotFoundError, ValueError, KeyError, TypeError):
        pass
    raise InputError(f"output folder {directory} holds files that are not of {kind.command}; choose another")


def _write_marker(kind: StudyKind, directory: Path, bases: Mapping[str, Mapping[str, Any]]) -> None:
    created = datetime.now(UTC).isoformat(timespec="seconds")
    marker = {"format": kind.command, "version": VERSION, "created": created, "scenes": dict(bases)}
    write_text(directory / kind.marker, json.dumps(marker, indent=2) + "\n")


def _check_settings(
    directory: Path, kept: Mapping[str, Mapping[str, Any]], bases: Mapping[str, Mapping[str, Any]]
) -> None:
    """Raise `InputError` where a key that both have differs; keys that only one has are of another qlb."""
    for scene in kept.keys() & bases.keys():
        old, new = flatten(kept[scene]), flatten(bases[scene])
        for key in new:
            if old.get(key, new[key]) != new[key]:
                raise InputError(
                    f"output folder {directory} holds runs with {key} = {old[key]}, not {new[key]}; choose another"
                    " or use --overwrite"
                )


def _clear(kind: StudyKind, directory: Path) -> None:
    """Delete what was made of the runs; those are replaced when their turn comes."""
    for name in kind.products:
        (directory / name).unlink(missing_ok=True)


def is_complete(case: Case) -> bool:
    """Whether the directory of a case holds its run, with the same settings and from start to end."""
    run = run_of(case)
    return run is not None and run.summary["status"] == "complete"


def run_of(case: Case) -> Run | None:
    """The run of a case as far as it got by itself; None where there is none, or one cut off or of other settings."""
    try:
        run = Run(case.directory)
        same = run.scene == case.scene and run.summary["status"] in ("complete", "failed")
    except (InputError, KeyError):
        return None
    return run if same and len(run.stats["step"]) else None
