"""Meshes that took long to make, kept on disk."""

from __future__ import annotations

import hashlib
import json
import logging
import os
import tempfile
import zipfile
from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

Arrays = dict[str, npt.NDArray[Any]]
_log = logging.getLogger(__name__)


def folder() -> Path | None:
    """Where meshes are kept: the folder QLB_CACHE, else qlb in XDG_CACHE_HOME or ~/.cache; None for QLB_CACHE=0."""
    chosen = os.environ.get("QLB_CACHE", "")
    if chosen:
        return None if chosen == "0" else Path(chosen)
    base = os.environ.get("XDG_CACHE_HOME", "")
    try:
        return (Path(base) if base else Path.home() / ".cache") / "qlb"
    except RuntimeError:  # no home
        return None


def key(settings: Mapping[str, object], arrays: Mapping[str, npt.NDArray[Any]]) -> str:
    """A name that changes with any of the settings and the content of any of the arrays."""
    digest = hashlib.sha256(json.dumps(settings, sort_keys=True).encode())
    for name, array in sorted(arrays.items()):
        digest.update(f"{name} {array.dtype} {array.shape}".encode())
        digest.update(np.ascontiguousarray(array).tobytes())
    return digest.hexdigest()[:32]


def load(name: str) -> Arrays | None:
    """What is kept under a name; None where that is nothing, or damaged (the members of the file carry a CRC-32)."""
    place = folder()
    if place is None:
        return None
    try:
        with (place / f"{name}.npz").open("rb") as file, np.load(file, allow_pickle=False) as members:
            return {member: members[member] for member in members.files}
    except FileNotFoundError:
        return None
    except (OSError, ValueError, EOFError, KeyError, AttributeError, zipfile.BadZipFile) as error:
        _log.info("the cached mesh %s is damaged and made again: %s", name, error)
        return None


def store(name: str, arrays: Arrays) -> None:
    """Keep arrays, or where the folder cannot be written to, do not."""
    place = folder()
    if place is None:
        return
    try:
        place.mkdir(parents=True, exist_ok=True)
        handle, temporary = tempfile.mkstemp(dir=place, prefix=".part-", suffix=".npz")
        try:
            with os.fdopen(handle, "wb") as file:
                np.savez(file, allow_pickle=False, **arrays)
            os.replace(temporary, place / f"{name}.npz")
        except BaseException:
            Path(temporary).unlink(missing_ok=True)
            raise
    except OSError as error:
        _log.info("the mesh is not kept in %s: %s", place, error)
