"""Files that are either whole or not there: written next to their place, then moved to it."""

from __future__ import annotations

import os
import zipfile
from collections.abc import Iterator, Mapping
from contextlib import contextmanager, suppress
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from qlb.errors import InputError
from qlb.results.errors import WriteError

Arrays = dict[str, npt.NDArray[Any]]


@contextmanager
def replacing(path: Path) -> Iterator[Path]:
    """A path to write to; what was written there takes the place of `path` at the end, and goes away on an error.

    Raises:
        WriteError: the system could not write.
    """
    temporary = temporary_name(path)
    try:
        yield temporary
        os.replace(temporary, path)
    except OSError as error:
        _remove(temporary)
        raise WriteError(path, error.strerror or str(error)) from None
    except BaseException:
        _remove(temporary)
        raise


def temporary_name(path: Path) -> Path:
    """Where `replacing` lets `path` be written."""
    return path.with_name(f".{path.stem}.part{path.suffix}")


def write_text(path: Path, text: str) -> None:
    """Write a text file. Raises `WriteError`."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_arrays(path: Path, arrays: Mapping[str, npt.ArrayLike], *, compress: bool = False) -> None:
    """Write named arrays as an npz file, whose members carry a CRC-32. Raises `WriteError`."""
    save = np.savez_compressed if compress else np.savez
    with replacing(path) as temporary, temporary.open("wb") as file:
        save(file, allow_pickle=False, **{name: np.asarray(array) for name, array in arrays.items()})


def append_text(path: Path, text: str) -> None:
    """Add to a text file, all of `text` or, on an error, nothing. Raises `WriteError`."""
    try:
        size = path.stat().st_size if path.exists() else 0
        try:
            with path.open("a", encoding="utf-8", newline="\n") as file:
                file.write(text)
        except BaseException:
            os.truncate(path, size)
            raise
    except OSError as error:
        raise WriteError(path, error.strerror or str(error)) from None


def read_arrays(path: Path, needed: Mapping[str, tuple[int | None, ...]]) -> Arrays:
    """All arrays of an npz file, none of them half read.

    Args:
        path: the file.
        needed: arrays that must be there, and their shapes; None stands for any length.

    Raises:
        InputError: the file is missing or damaged, or one of `needed` is missing or has another shape.
    """
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            arrays = {name: archive[name] for name in archive.files}
    except FileNotFoundError:
        raise InputError(f"{path} does not exist") from None
    except (OSError, ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path} is damaged or not an npz file: {reason}") from None
    require_shapes(path, arrays, needed)
    return arrays


def require_shapes(path: Path, arrays: Arrays, needed: Mapping[str, tuple[int | None, ...]]) -> None:
    """Raise `InputError` where one of `needed` is missing in what was read from `path`, or has another shape."""
    for name, shape in needed.items():
        if name not in arrays:
            raise InputError(f"{path} is not what it should be: it has no array '{name}'")
        found = arrays[name].shape
        if len(found) != len(shape) or any(n is not None and n != m for n, m in zip(shape, found, strict=True)):
            wanted = str(shape).replace("None", "n")
            raise InputError(f"{path} is not what it should be: '{name}' has shape {found}, must be {wanted}")


def _remove(path: Path) -> None:
    with suppress(OSError):
        path.unlink(missing_ok=True)
