"""What a format is."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

_SERIES = "_[0-9]" + 5 * "[0-9]" + "*"


@dataclass(frozen=True)
class Format:
    """A format of `qlb export`; each module of this package that writes one has it as `FORMAT`."""

    name: str
    summary: str
    """what it is for, in a few words"""
    suffixes: tuple[str, ...]
    """of the file that stands for the export, the usual one first"""
    write: Callable[..., list[Path]]
    """write(recording, path, **options) -> the files, `path` or the first of a series first"""
    options: tuple[str, ...] = ()
    """keyword arguments that `write` takes"""
    files: Callable[[Path], list[Path]] = lambda path: [path]
    """what an export to `path` may have left"""


def frame_file(path: Path, step: int) -> Path:
    """The file of one frame in a series: NAME_000012.obj for NAME.obj and step 12."""
    return path.with_name(f"{path.stem}_{step:06d}{path.suffix}")


def frame_files(path: Path) -> list[Path]:
    """Files that `frame_file` may have named."""
    return [f for f in path.parent.glob(f"*{path.suffix}") if f.match(f"{_escaped(path.stem)}{_SERIES}{path.suffix}")]


def _escaped(text: str) -> str:
    return "".join(f"[{c}]" if c in "*?[" else c for c in text)
