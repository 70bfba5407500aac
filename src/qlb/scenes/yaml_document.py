"""YAML as a tree of nodes: the core schema of YAML 1.2, anchors, aliases and merge keys; no tags.

Composed from the parser's events, so that nothing recurses before depth and size are known to be fit.
"""

from __future__ import annotations

import re
from collections.abc import Iterator
from typing import Any

import yaml

from qlb.scenes.document import MOST_LEVELS, MOST_VALUES, Node, Place, SyntaxProblem

_NULL = {"", "~", "null", "Null", "NULL"}
_BOOLEANS = {text: text[0] in "tT" for text in ("true", "True", "TRUE", "false", "False", "FALSE")}
_INTEGER = re.compile(r"[-+]?[0-9]+|0o[0-7]+|0x[0-9a-fA-F]+")
_FLOAT = re.compile(r"[-+]?(\.[0-9]+|[0-9]+(\.[0-9]*)?)([eE][-+]?[0-9]+)?")
_SPECIAL = re.compile(r"([-+]?)\.(inf|Inf|INF)|\.(nan|NaN|NAN)")
_MOST_DIGITS = 400
_MERGE = "<<"


def parse_yaml(text: str) -> Node:
    """The one document of `text`. Raises `SyntaxProblem`."""
    loader: Any = getattr(yaml, "CSafeLoader", yaml.SafeLoader)
    try:
        return _Composer(yaml.parse(text, Loader=loader)).document()
    except yaml.MarkedYAMLError as error:
        mark = error.problem_mark or error.context_mark
        raise SyntaxProblem(error.problem or str(error), _place(mark) if mark else None) from None
    except yaml.YAMLError as error:  # a character that YAML does not know
        raise SyntaxProblem(str(error)) from None


def _place(mark: Any) -> Place:
    return Place(mark.line + 1, mark.column + 1)


class _Composer:
    """Makes nodes of events."""

    def __init__(self, events: Iterator[Any]) -> None:
        self._events = events
        self._anchors: dict[str, Node | None] = {}
        self._values = 0

    def document(self) -> Node:
        """The first document, which must be the only one."""
        next(self._events)
        first = next(self._events)
        if isinstance(first, yaml.StreamEndEvent):
            return Node.of(None)
        root = self._node(next(self._events), MOST_LEVELS)
        next(self._events)
        more = next(self._events)
        if not isinstance(more, yaml.StreamEndEvent):
            raise SyntaxProblem("a second document begins here, must be one", _place(more.start_mark))
        return root

    def _node(self, event: Any, levels: int) -> Node:
        place = _place(event.start_mark)
        self._values += 1
        if levels == 0:
            raise SyntaxProblem(f"nested more than {MOST_LEVELS} levels deep", place)
        if self._values > MOST_VALUES:
            raise SyntaxProblem(f"more than {MOST_VALUES} values", place)
        if isinstance(event, yaml.AliasEvent):
            return self._alias(str(event.anchor), place)
        if event.tag is not None and event.tag != "!":
            raise SyntaxProblem(f"the tag {event.tag} is not allowed: scene files hold plain values", place)
        if event.anchor is not None:
            self._anchors[event.anchor] = None
        try:
            node = self._content(event, levels - 1)
        except SyntaxProblem as problem:
            raise SyntaxProblem(str(problem), problem.place or place) from None
        if event.anchor is not None:
            self._anchors[event.anchor] = node
        return node

    def _content(self, event: Any, levels: int) -> Node:
        if isinstance(event, yaml.ScalarEvent):
            return Node.of(_scalar(event.value) if event.implicit[0] and not event.style else event.value)
        return self._sequence(levels) if isinstance(event, yaml.SequenceStartEvent) else self._mapping(levels)

    def _alias(self, anchor: str, place: Place) -> Node:
        if anchor not in self._anchors:
            raise SyntaxProblem(f"the alias *{anchor} stands for nothing that came before", place)
        node = self._anchors[anchor]
        if node is None:
            raise SyntaxProblem(f"the alias *{anchor} is inside of what it stands for", place)
        return node

    def _sequence(self, levels: int) -> Node:
        nodes: list[Node] = []
        places: dict[Any, Place] = {}
        while not isinstance(event := next(self._events), yaml.SequenceEndEvent):
            places[len(nodes)] = _place(event.start_mark)
            nodes.append(self._node(event, levels))
        return Node.of(nodes, places)

    def _mapping(self, levels: int) -> Node:
        nodes: dict[Any, Node] = {}
        places: dict[Any, Place] = {}
        merged: list[tuple[Node, Place]] = []
        while not isinstance(event := next(self._events), yaml.MappingEndEvent):
            place = _place(event.start_mark)
            key = self._node(event, levels).value
            node = self._node(next(self._events), levels)
            if key == _MERGE:
                merged.append((node, place))
                continue
            if isinstance(key, bool) or not isinstance(key, str | int):
                raise SyntaxProblem(f"a key is {_kind(key)}, must be text", place)
            if key in nodes:
                raise SyntaxProblem(f"the key '{key}' stands here again, first in line {places[key].line}", place)
            nodes[key], places[key] = node, place
        for node, place in merged:
            _merge(node, place, nodes, places)
        return Node.of(nodes, places)


def _merge(source: Node, place: Place, nodes: dict[Any, Node], places: dict[Any, Place]) -> None:
    """Take over what `<<: *other` or `<<: [*one, *two]` has, and `nodes` have not."""
    for node in source.value if isinstance(source.value, list) else [source]:
        if not isinstance(node.value, dict):
            raise SyntaxProblem(f"<< is followed by {_kind(node.value)}, must be an alias of keys and values", place)
        for key, inner in node.value.items():
            if key not in nodes:
                nodes[key], places[key] = inner, node.places[key]


def _kind(value: Any) -> str:
    names = {dict: "keys and values", list: "a list", type(None): "null", bool: "true or false"}
    return names.get(type(value), repr(value))


def _scalar(text: str) -> Any:
    """What a scalar without quotes means."""
    if text in _NULL:
        return None
    if text in _BOOLEANS:
        return _BOOLEANS[text]
    if _INTEGER.fullmatch(text) and len(text) < _MOST_DIGITS:
        return int(text, {"0o": 8, "0x": 16}.get(text[:2], 10))
    if _FLOAT.fullmatch(text):
        return float(text)
    if _SPECIAL.fullmatch(text):
        return float(text.lower().replace(".", ""))
    return text
