"""TOML as a tree of nodes. The standard parser keeps no places; a light search finds tables and keys at line starts."""

from __future__ import annotations

import re
import tomllib
from typing import Any

from qlb.scenes.document import MOST_LEVELS, Node, Place, SyntaxProblem

_PART = r"""(?:[A-Za-z0-9_-]+|"[^"\n]*"|'[^'\n]*')"""
_KEY = rf"{_PART}(?:[ \t]*\.[ \t]*{_PART})*"
_TABLE = re.compile(rf"[ \t]*(\[\[?)[ \t]*({_KEY})[ \t]*\]")
_PAIR = re.compile(rf"[ \t]*({_KEY})[ \t]*=")
_LONG_KEY = re.compile(rf"(?:^|[\[{{,])[ \t]*{_PART}(?:[ \t]*\.[ \t]*{_PART}){{{MOST_LEVELS},}}", re.MULTILINE)
_WHERE = re.compile(r" \(at (?:line (\d+), column (\d+)|end of document)\)$")

Path = tuple[str | int, ...]


def parse_toml(text: str) -> Node:
    """The document. Raises `SyntaxProblem`."""
    if long := _LONG_KEY.search(text):  # the parser would take quadratic time
        raise SyntaxProblem(f"a key of more than {MOST_LEVELS} parts", Place(text.count("\n", 0, long.end()) + 1, 1))
    try:
        return _node(tomllib.loads(text), (), _places(text))
    except tomllib.TOMLDecodeError as error:
        found = _WHERE.search(str(error))
        end = text.rstrip("\n")
        place = Place(end.count("\n") + 1, len(end) - end.rfind("\n"))
        if found and found[1]:
            place = Place(int(found[1]), int(found[2]))
        raise SyntaxProblem(_WHERE.sub("", str(error)), place) from None
    except RecursionError:
        raise SyntaxProblem("is nested too deep") from None
    except ValueError as error:  # a number of too many digits
        raise SyntaxProblem(str(error)) from None


def _node(value: Any, path: Path, places: dict[Path, Place]) -> Node:
    """The node of `value` at `path`."""
    if not isinstance(value, dict | list):
        return Node.of(value)
    inner = value.items() if isinstance(value, dict) else enumerate(value)
    nodes = {key: _node(part, (*path, key), places) for key, part in inner}
    known = {key: places[*path, key] for key in nodes if (*path, key) in places}
    return Node.of(nodes if isinstance(value, dict) else list(nodes.values()), known)


def _places(text: str) -> dict[Path, Place]:
    """Where tables and keys stand that begin a line; the first place counts."""
    places: dict[Path, Place] = {}
    counts: dict[Path, int] = {}
    table: Path = ()
    for number, line in enumerate(text.split("\n"), start=1):
        place = Place(number, len(line) - len(line.lstrip()) + 1)
        if header := _TABLE.match(line):
            table = _entered(_parts(header[2]), counts)
            if header[1] == "[[":
                counts[table] = counts.get(table, -1) + 1
                places.setdefault(table, place)
                table = (*table, counts[table])
            places.setdefault(table, place)
        elif pair := _PAIR.match(line):
            parts = _parts(pair[1])
            for end in range(1, len(parts) + 1):
                places.setdefault((*table, *parts[:end]), place)
    return places


def _entered(parts: list[str], counts: dict[Path, int]) -> Path:
    """The path that a header means: within lists of tables, the last entry so far."""
    path: Path = ()
    for depth, part in enumerate(parts, start=1):
        path = (*path, part)
        if path in counts and depth < len(parts):
            path = (*path, counts[path])
    return path


def _parts(key: str) -> list[str]:
    return [part.strip("\"'") for part in re.findall(_PART, key)]
