"""The one list of formats, and the door to them."""

from __future__ import annotations

from collections.abc import Callable
from contextlib import suppress
from dataclasses import dataclass
from itertools import count
from pathlib import Path

from qlb.errors import InputError
from qlb.export import glb, obj, ply, usd, video, vtkhdf, vtu
from qlb.export.format import Format
from qlb.export.recording import Recording
from qlb.results import Run, WriteError

FORMATS: dict[str, Format] = {
    format.name: format
    for format in (
        vtkhdf.FORMAT,
        vtu.FORMAT,
        usd.FORMAT,
        glb.FORMAT,
        obj.FORMAT,
        ply.FORMAT,
        video.MP4,
        video.GIF,
    )
}
"""Every format by its name."""

FOLDER = "exports"
"""Where exports go by default, in the run directory."""


@dataclass(frozen=True)
class Exported:
    """What an export left."""

    format: str
    files: list[Path]
    """the one to open first"""
    frames: int
    notes: list[str]
    """what a reader may miss, and why"""

    @property
    def size(self) -> int:
        """Of all files [bytes]."""
        return sum(path.stat().st_size for path in self.files)


def export_run(
    run: Run,
    out: Path | None = None,
    *,
    format: str | None = None,
    steps: str = "",
    overwrite: bool = False,
    on_frame: Callable[[int, int], None] = lambda done, total: None,
    **options: object,
) -> Exported:
    """Write the frames of a run in a format of other tools.

    Every file is written beside its place and then moved there: it is whole or not there.

    Args:
        run: the run.
        out: a file, whose suffix may say the format; or a folder, in which files have the name of the run directory. By
            default the folder `exports` of the run directory.
        format: one of `FORMATS`.
        steps: "A:B:C", every C-th frame of steps A to B, any part left out; or one step "A". By default all.
        overwrite: replace an earlier export to the same place.
        on_frame: called with the frames written and all that are to be.
        options: of the format: `volume`, `turntable`, `fps`, `size`; one that is None counts as not given.

    Raises:
        InputError: an argument is wrong, the run has no such frames or a damaged one, or an earlier export is there.
        MissingExtra: a package that the format needs is not installed.
        RenderingFailed: a video cannot be rendered here.
        WriteError: a file could not be written.
    """
    chosen = _chosen(format, out)
    given = _given(chosen, options)
    done = count(1)
    recording = Recording.of(run, steps, lambda: on_frame(next(done), len(recording.steps)))
    path = _path(run, out, chosen)
    earlier = _earlier(chosen, path, overwrite=overwrite)
    files = chosen.write(recording, path, **given)
    with suppress(OSError):
        for stale in set(earlier) - set(files):
            stale.unlink()
    return Exported(chosen.name, files, len(recording.steps), _notes(recording, chosen))


def remove_exports(directory: Path) -> None:
    """Delete what `export_run` left in the default folder of a run directory, known by its names, and nothing else.

    Raises:
        WriteError: a file could not be deleted.
    """
    folder, name = directory / FOLDER, directory.resolve().name
    if not folder.is_dir():
        return
    paths = [(format, folder / f"{name}{suffix}") for format in FORMATS.values() for suffix in format.suffixes]
    files = {file for format, path in paths for file in format.files(path)}
    try:
        for file in files:
            file.unlink(missing_ok=True)
        for place in ({file.parent for file in files} - {folder}, {folder}):
            for empty in (each for each in place if each.is_dir() and not any(each.iterdir())):
                empty.rmdir()
    except OSError as error:
        raise WriteError(folder, error.strerror or str(error)) from None


def _chosen(name: str | None, out: Path | None) -> Format:
    """The format by its name, or by the suffix of the output."""
    if name is not None:
        if name not in FORMATS:
            raise InputError(f"format {name!r} is not known: must be one of {', '.join(FORMATS)}")
        return FORMATS[name]
    suffix = "" if out is None else out.suffix.lower()
    for format in FORMATS.values():
        if suffix in format.suffixes:
            return format
    raise InputError(
        f"no format is given: must be one of {', '.join(FORMATS)}, or follow from the suffix of the output"
    )


def _given(format: Format, options: dict[str, object]) -> dict[str, object]:
    """The options that are not None. Raises `InputError` for one that the format does not take."""
    given = {name: value for name, value in options.items() if value is not None}
    for name in given:
        if name not in format.options:
            takes = f"only {', '.join(format.options)}" if format.options else "it takes none"
            raise InputError(f"format {format.name} has no option '{name}', {takes}")
    return given


def _path(run: Run, out: Path | None, format: Format) -> Path:
    """The file that stands for the export; its folder is made."""
    out = run.directory / FOLDER if out is None else out
    suffix = out.suffix.lower()
    if out.is_dir() or not any(suffix in other.suffixes for other in FORMATS.values()):
        out = out / f"{run.directory.resolve().name}{format.suffixes[0]}"
    elif suffix not in format.suffixes:
        raise InputError(f"output {out} must end in {' or '.join(format.suffixes)} for format {format.name}")
    try:
        out.parent.mkdir(parents=True, exist_ok=True)
    except FileExistsError:
        raise InputError(f"output folder {out.parent} is a file; choose another") from None
    except OSError as error:
        raise WriteError(out.parent, error.strerror or str(error)) from None
    return out


def _earlier(format: Format, path: Path, *, overwrite: bool) -> list[Path]:
    """Files of an earlier export to `path`. Raises `InputError` where there are any, and they are not to go."""
    earlier = [file for file in format.files(path) if file.exists()]
    if earlier and not overwrite:
        more = f" and {len(earlier) - 1} more" if len(earlier) > 1 else ""
        raise InputError(f"output {earlier[0]}{more} is there already; choose another or use --overwrite")
    return earlier


def _notes(recording: Recording, format: Format) -> list[str]:
    reason = recording.without_stress
    shows_stress = "volume" in format.options or format.name == "ply"
    return [f"without stress: {reason}"] if reason is not None and shows_stress else []
