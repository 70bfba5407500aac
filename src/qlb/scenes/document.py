"""A scene file as a tree of values that know where they stand."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any, NamedTuple

from qlb.errors import InputError

MOST_BYTES = 8 * 2**20
MOST_VALUES = 1_000_000
MOST_LEVELS = 50
"""What is read of a file: more is a mistake, or meant to stop the reader."""


class Place(NamedTuple):
    """A line and a column, both from 1."""

    line: int
    column: int


class SyntaxProblem(Exception):
    """Text that is no document, and where that shows."""

    def __init__(self, problem: str, place: Place | None = None) -> None:
        super().__init__(problem)
        self.place = place


@dataclass(slots=True)
class Node:
    """A value of a document; an alias is the node that it stands for.

    Attributes:
        value: a dict of nodes by key, a list of nodes, or a scalar.
        size: how many values it holds when every alias is written out, itself included.
        levels: how deep it is nested, 1 for a scalar.
        places: of the keys of a dict or the entries of a list, as far as they are known.
    """

    value: Any
    size: int
    levels: int
    places: dict[Any, Place]

    @staticmethod
    def of(value: Any, places: dict[Any, Place] | None = None) -> Node:
        """A node of a scalar, or of nodes. Raises `SyntaxProblem` where they are too many, or nested too deep."""
        inner = list(value.values()) if isinstance(value, dict) else value if isinstance(value, list) else []
        node = Node(value, 1 + sum(i.size for i in inner), 1 + max((i.levels for i in inner), default=0), places or {})
        if node.size > MOST_VALUES:
            raise SyntaxProblem(f"holds more than {MOST_VALUES} values, those of its aliases included")
        if node.levels > MOST_LEVELS:
            raise SyntaxProblem(f"is nested more than {MOST_LEVELS} levels deep")
        return node

    def plain(self) -> Any:
        """Dicts, lists and scalars, with a copy of its own for each alias."""
        if isinstance(self.value, dict):
            return {key: node.plain() for key, node in self.value.items()}
        if isinstance(self.value, list):
            return [node.plain() for node in self.value]
        return self.value


@dataclass(frozen=True)
class Document:
    """A scene file.

    Attributes:
        path: as it was given.
        root: its keys and values.
    """

    path: Path
    root: Node

    def place(self, key: str) -> Place | None:
        """Where a dotted key stands, or else the nearest key above it that the file has."""
        place: Place | None = None
        for node, step in self._steps(key):
            place = node.places.get(step, place)
        return place

    def _steps(self, key: str) -> Iterator[tuple[Node, Any]]:
        """The nodes on the way to a key, each with what leads on from it."""
        node = self.root
        for part in key.split("."):
            inner = node.value
            step: Any = next((k for k in inner if str(k) == part), part) if isinstance(inner, dict) else part
            if isinstance(inner, list) and part.isdecimal():
                step = int(part)
            yield node, step
            has = step in inner if isinstance(inner, dict) else isinstance(step, int) and step < len(inner)
            if not isinstance(inner, dict | list) or not has:
                return
            node = inner[step]

    def at(self, place: Place | None) -> str:
        """The file, and the place in it, as editors and terminals link it."""
        return str(self.path) if place is None else f"{self.path}:{place.line}:{place.column}"


def read_document(path: Path, parsers: Mapping[str, Callable[[str], Node]]) -> Document:
    """Read a file with the parser of its ending, or the first.

    Raises:
        InputError: it is missing, too large, not text, or not what its ending says; the line and column are named.
    """
    try:
        if path.stat().st_size > MOST_BYTES:
            raise InputError(f"scene file {path} has {path.stat().st_size} bytes, at most {MOST_BYTES} are read")
        text = path.read_bytes().decode("utf-8-sig")
    except UnicodeDecodeError as error:
        byte = f"byte {error.start} is {error.object[error.start]:#x}"
        raise InputError(f"scene file {path} is not UTF-8 text: {byte}") from None
    except OSError as error:
        raise InputError(f"scene file {path} cannot be read: {error.strerror}") from None
    kind = path.suffix.lower()
    kind = kind if kind in parsers else next(iter(parsers))
    name = kind.removeprefix(".").upper()
    try:
        root = parsers[kind](text)
    except SyntaxProblem as problem:
        at = Document(path, Node.of(None)).at(problem.place)
        raise InputError(f"{at}: not valid {name} for a scene: {' '.join(str(problem).split())}") from None
    if not isinstance(root.value, dict):
        what = "is empty" if root.value is None else f"holds {type(root.value).__name__}"
        raise InputError(f"scene file {path} {what}, must hold keys and values")
    return Document(path, root)
