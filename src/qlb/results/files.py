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
from numpy.lib.npyio import NpzFile

from qlb.errors import InputError
from qlb.results.errors import WriteError
from qlb.results.npz import SUFFIX, pack

Arrays = dict[str, npt.NDArray[Any]]


@contextmanager
def replacing(path: Path, *, aside: bool = False) -> Iterator[Path]:
    """A path to write to; what was written there takes the place of `path` at the end, and goes away on an error.

    Args:
        path: the file.
        aside: let the old file step aside (`aside_name`) until the new one is in its place. Some file systems (ext4)
            wait for the disk where a file that was just written takes the place of another; this way they do not.
            A kill may leave the old one there: read `whole_file(path)`.

    Raises:
        WriteError: the system could not write.
    """
    temporary = temporary_name(path)
    try:
        yield temporary
        if aside:
            _replace_stepping_aside(temporary, path)
        else:
            os.replace(temporary, path)
    except OSError as error:
        _remove(temporary)
        raise WriteError(path, error.strerror or str(error)) from None
    except BaseException:
        _remove(temporary)
        raise


def _replace_stepping_aside(new: Path, path: Path) -> None:
    old = aside_name(path)
    with suppress(FileNotFoundError):
        os.replace(path, old)
    try:
        os.replace(new, path)
    except BaseException:
        with suppress(FileNotFoundError):
            os.replace(old, path)
        raise
    _remove(old)


def aside_name(path: Path) -> Path:
    """Where `path` may lie while another takes its place."""
    return path.with_name(f".{path.stem}.old{path.suffix}")


def whole_file(path: Path) -> Path:
    """Where to read `path`, which `replacing` writes: stepped aside, where a kill came just then."""
    old = aside_name(path)
    return old if not path.exists() and old.exists() else path


def temporary_name(path: Path) -> Path:
    """Where `replacing` lets `path` be written."""
    return path.with_name(f".{path.stem}.part{path.suffix}")


def write_text(path: Path, text: str) -> None:
    """Write a text file. Raises `WriteError`."""
    with replacing(path) as temporary:
        temporary.write_text(text, encoding="utf-8", newline="\n")


def write_arrays(
    path: Path, arrays: Mapping[str, npt.ArrayLike], *, compress: bool = False, aside: bool = False
) -> dict[str, int]:
    """Write named arrays as an npz file; returns the CRC-32 that each has in it.

    Args:
        path: the file.
        arrays: what to write.
        compress: deflate them.
        aside: as of `replacing`.

    Raises:
        WriteError: the system could not write.
    """
    packed = pack(arrays, compress=compress)
    with replacing(path, aside=aside) as temporary, temporary.open("wb") as file:
        file.writelines(packed.chunks)
    return packed.crc


def append_text(path: Path, text: str) -> None:
    """Add to a text file, all of `text` or, on an error, nothing. Raises `WriteError`."""
    left = text.encode()
    try:
        with path.open("ab", buffering=0) as file:
            size = file.tell()
            try:
                while left:
                    left = left[file.write(left) :]
            except BaseException:
                file.truncate(size)
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
    with _reading(path) as archive:
        arrays = {name: archive[name] for name in archive.files}
    require_shapes(path, arrays, needed)
    return arrays


def read_checked(path: Path, crc: Mapping[str, int]) -> Arrays:
    """Those arrays of an npz file that `crc` names, if each is the one with that CRC-32 (`write_arrays`).

    Raises:
        InputError: the file is missing or damaged, or one of the arrays is missing or another one.
    """
    with _reading(path) as archive:
        assert archive.zip is not None
        found = {name.removesuffix(SUFFIX): archive.zip.getinfo(name).CRC for name in archive.zip.namelist()}
        other = [name for name in crc if found.get(name) != crc[name]]
        arrays = {} if other else {name: archive[name] for name in crc}
    if other:
        raise InputError(f"{path} is not what it should be: its '{other[0]}' is missing or another one")
    return arrays


@contextmanager
def _reading(path: Path) -> Iterator[NpzFile]:
    """An open npz file. What goes wrong with it in the block becomes an `InputError`."""
    try:
        with path.open("rb") as file, np.load(file, allow_pickle=False) as archive:
            yield archive
    except FileNotFoundError:
        raise InputError(f"{path} does not exist") from None
    except (OSError, ValueError, TypeError, KeyError, EOFError, zipfile.BadZipFile) as error:
        reason = " ".join(str(error).split()) or type(error).__name__
        raise InputError(f"{path} is damaged or not an npz file: {reason}") from None


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
