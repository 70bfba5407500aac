"""What a package offers: the classes that its modules define are found, so that a new one is one new file."""

from __future__ import annotations

import inspect
import pkgutil
from collections.abc import Callable, Iterator, Sequence
from fnmatch import fnmatch
from importlib import import_module
from typing import TypeVar

T = TypeVar("T")


def found_in(
    package: str, base: type[T], name: Callable[[type[T]], str | None], *, first: Sequence[str] = (), skip: str = ""
) -> dict[str, type[T]]:
    """Every concrete subclass of `base` that a module of `package` defines, by its name.

    Args:
        package: as in `__name__` of its `__init__.py`, which may call this.
        base: the abstract class.
        name: gives the name of a subclass, by which users know it; None where it is a base for others.
        first: names that come first, in this order; the others follow, modules by their names.
        skip: modules to leave alone, a pattern as of file names.
    """
    kinds = {known: kind for kind in _concrete(package, base, skip) if (known := name(kind)) is not None}
    rank = {known: place for place, known in enumerate(first)}
    return {known: kinds[known] for known in sorted(kinds, key=lambda known: rank.get(known, len(rank)))}


def _concrete(package: str, base: type[T], skip: str) -> Iterator[type[T]]:
    path = import_module(package).__path__
    for module in sorted(info.name for info in pkgutil.iter_modules(path)):
        if fnmatch(module, skip):
            continue
        source = import_module(f"{package}.{module}")
        for kind in vars(source).values():
            own = isinstance(kind, type) and kind.__module__ == source.__name__
            if own and issubclass(kind, base) and not inspect.isabstract(kind):
                yield kind
