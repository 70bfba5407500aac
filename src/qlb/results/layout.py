"""Where things lie in a run directory, and what tells it from any other folder.

Format version 1::

    run.json            {"format": "qlb run", "version": 1, "id": ..., "created": ISO 8601}: the marker, written first
    scene.yaml          the resolved scene
    mesh.npz            positions [m] (n, 3) at rest, tets (m, 4) of all bodies; where there are several, or obstacles:
                        groups (n + q,), body_names; obstacle_names, obstacle_vertices [m] (q, 3) at rest,
                        obstacle_triangles (t, 3); where bodies are shown by surfaces of their own, surface_triangles,
                        surface_tets, surface_weights (`EmbeddedSurface`); planes (p, 6), a point [m] and the normal
                        of each
    materials.npz       what the tets are made of (`qlb.analysis.Constitution`): kernels (l,), tets (l, 2), the first
                        and the first behind of each, parameters_0, ... of the kernels, density [kg/m^3] (1 or m,), mass
    frames/000000.npz   step, time [s], positions [m] (n + q, 3), velocities [m/s] (n + q, 3), those of obstacles last;
                        plane_points [m] (p, 3) where there are planes; with contact, but for the first frame of a
                        run, contact_forces on each node [N] (n + q, 3) and the total on each plane, plane_forces [N]
                        (p, 3), and contact_energy [J]; gravity [m/s^2] (3,); load_energy [J] where there are loads;
                        named by the step
    stats.csv           one row per nonlinear iteration, columns as in `qlb.results.COLUMNS`
    checkpoint.npz      what a run needs to go on to the same bits, as of the last frame: run (its id), step, seconds,
                        state and solver; elsewhere (k, 4) names what lies in frames and in the next files, instead of
                        repeating it: name, file, name there, CRC-32
    checkpoint-000012.npz  what was new in the checkpoint of that step, large and in no frame; goes when no longer named
    summary.json        the run in numbers; its status is "running" until the end
    run.lock            held by the process that writes; left behind, and empty
    *.png, report.html  made from the above by `finish_run`

Every file but stats.csv is written next to its place and moved to it, so that it is whole or not there. A step is
finished when the checkpoint holds it; rows and frames of later steps are what a kill left behind.
"""

from __future__ import annotations

import json
import os
import re
from collections.abc import Collection, Iterator
from datetime import UTC, datetime
from pathlib import Path
from uuid import uuid4

from filelock import FileLock, Timeout

from qlb.errors import InputError
from qlb.results.files import aside_name, temporary_name

FORMAT = "qlb run"
VERSION = 1

MARKER = "run.json"
SCENE = "scene.yaml"
MESH = "mesh.npz"
MATERIALS = "materials.npz"
FRAMES = "frames"
STATS = "stats.csv"
CHECKPOINT = "checkpoint.npz"
CHECKPOINT_PART = "checkpoint-"
SUMMARY = "summary.json"
LOCK = "run.lock"
REPORT = "report.html"
FIGURES = {name: f"{name}.png" for name in ("picture", "iterations", "residuals", "contact", "seconds")}
"""Images of a run, by the name that `finish_run` gives them, in the order of the report."""

_FRAME = re.compile(r"(\d{6,})\.npz")
_FRAME_LEFT = re.compile(r"\.\d{6,}\.part\.npz")
"""A frame that a kill cut off."""
_PART = re.compile(rf"\.?{CHECKPOINT_PART}\d{{6,}}(\.part)?\.npz")


def frame_path(directory: Path, step: int) -> Path:
    """Where the frame of a step lies."""
    return directory / FRAMES / f"{step:06d}.npz"


def frame_steps(directory: Path) -> list[int]:
    """Steps that have a frame, in order."""
    folder = directory / FRAMES
    names = os.listdir(folder) if folder.is_dir() else []
    return sorted(int(match[1]) for name in names if (match := _FRAME.fullmatch(name)))


def checkpoint_part(directory: Path, step: int) -> Path:
    """Where that of the checkpoint of a step lies which neither it nor a frame holds."""
    return directory / f"{CHECKPOINT_PART}{step:06d}.npz"


def remove_checkpoint_parts(directory: Path, keep: Collection[str]) -> None:
    """Delete those files beside the checkpoint whose names are not in `keep`."""
    for name in os.listdir(directory):
        if _PART.fullmatch(name) and name not in keep:
            (directory / name).unlink(missing_ok=True)


def check_marker(directory: Path) -> str:
    """The id of the run in `directory`. Raises `InputError` unless it holds one of this format version."""
    path = directory / MARKER
    try:
        marker = json.loads(path.read_text(encoding="utf-8"))
    except (FileNotFoundError, NotADirectoryError):
        missing = "it has no run.json" if directory.is_dir() else "there is no such folder"
        raise InputError(f"{directory} is not a qlb run: {missing}") from None
    except (ValueError, RecursionError, OSError) as error:
        raise InputError(f"{directory} is not a qlb run: run.json cannot be read ({_line(error)})") from None
    if not isinstance(marker, dict) or marker.get("format") != FORMAT:
        raise InputError(f"{directory} is not a qlb run: run.json does not have format = {FORMAT!r}")
    if marker.get("version") != VERSION:
        raise InputError(
            f"run {directory} has format version {marker.get('version')!r}, this qlb reads {VERSION}; it was written"
            " by another version of qlb"
        )
    return str(marker.get("id"))


def check_free(directory: Path, *, overwrite: bool) -> None:
    """Raise `InputError` unless `directory` can become a run directory: there is nothing in it, or a run to replace."""
    if os.path.lexists(directory) and not directory.is_dir():
        raise InputError(f"output folder {directory} is a file; choose another")
    if not directory.is_dir():
        return
    for folder in (directory, directory / FRAMES):
        if folder.is_dir() and not os.access(folder, os.R_OK | os.W_OK | os.X_OK):
            raise InputError(f"output folder {directory} cannot be written: no permission; choose another")
    if _is_empty(directory):
        return
    try:
        check_marker(directory)
    except InputError:
        raise InputError(f"output folder {directory} holds files that are not a qlb run; choose another") from None
    if not overwrite:
        raise InputError(f"output folder {directory} holds another run; choose another or use --overwrite")


def _is_empty(directory: Path) -> bool:
    """Whether there is nothing in it but what `claim` leaves when it is killed before the marker is written."""
    names = {path.name for path in directory.iterdir()} - {LOCK}
    return not names or (names == {FRAMES} and not any((directory / FRAMES).iterdir()))


def lock(directory: Path) -> FileLock:
    """Keep other processes from writing into a run directory until the lock is released, or this process ends.

    Raises:
        InputError: another run holds it, or the lock file cannot be written.
    """
    held = FileLock(directory / LOCK, blocking=False)
    try:
        held.acquire()
    except Timeout:
        raise InputError(f"output folder {directory} is in use by another run; choose another") from None
    except OSError as error:
        raise InputError(f"output folder {directory} cannot be written: {_line(error)}; choose another") from None
    return held


def claim(directory: Path, *, overwrite: bool) -> FileLock:
    """Make `directory` a run directory with nothing but its marker; returns the lock on it.

    Raises:
        InputError: it is not free (see `check_free`), in use by another run, or cannot be written.
    """
    check_free(directory, overwrite=overwrite)
    try:
        directory.mkdir(parents=True, exist_ok=True)
        held = lock(directory)
        if (directory / MARKER).exists():
            _clear(directory)
        (directory / FRAMES).mkdir(exist_ok=True)
        created = datetime.now(UTC).isoformat(timespec="seconds")
        marker = json.dumps({"format": FORMAT, "version": VERSION, "id": uuid4().hex, "created": created})
        with (directory / MARKER).open("x", encoding="utf-8") as file:
            file.write(marker + "\n")
    except OSError as error:
        raise InputError(f"output folder {directory} cannot be written: {_line(error)}; choose another") from None
    return held


def remove_frames_after(directory: Path, step: int) -> None:
    """Delete the frames of later steps, which a kill left behind."""
    for later in frame_steps(directory):
        if later > step:
            frame_path(directory, later).unlink(missing_ok=True)


def _clear(directory: Path) -> None:
    """Delete what a run wrote and nothing else; the marker last, so that what is left stays known as a run."""
    remove_checkpoint_parts(directory, keep=())
    for path in _files(directory):
        path.unlink(missing_ok=True)
        for left in (temporary_name(path), aside_name(path)):
            left.unlink(missing_ok=True)
    frames = directory / FRAMES
    if frames.is_dir():
        for path in frames.iterdir():
            if _FRAME_LEFT.fullmatch(path.name):
                path.unlink()
        if not any(frames.iterdir()):
            frames.rmdir()
    (directory / MARKER).unlink()


def _files(directory: Path) -> Iterator[Path]:
    yield from (frame_path(directory, step) for step in frame_steps(directory))
    names = (SCENE, MESH, MATERIALS, STATS, CHECKPOINT, SUMMARY, REPORT, *FIGURES.values())
    yield from (directory / name for name in names)


def _line(error: Exception) -> str:
    text = error.strerror if isinstance(error, OSError) and error.strerror else str(error)
    return " ".join(text.split())
