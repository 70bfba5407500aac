"""Classes are found by what their modules define: concrete ones, once, under the name that they give."""

from __future__ import annotations

import sys
from abc import ABC, abstractmethod
from pathlib import Path

import pytest

from qlb.registry import found_in

MODULES = {
    "__init__.py": "",
    "base.py": """
from abc import ABC, abstractmethod
class Shape(ABC):
    label = None
    @abstractmethod
    def area(self): ...
class Cornered(Shape):
    def area(self): return 0
""",
    "square.py": """
from found.base import Cornered, Shape
class Square(Cornered):
    label = "square"
class Half(Shape):
    label = "half"
""",
    "circle.py": """
from found.base import Cornered as Known
from found.base import Shape
from found.square import Square
class Circle(Shape):
    label = "circle"
    def area(self): return 3
""",
    "triangle.py": """
from found.base import Cornered
class Triangle(Cornered):
    label = "triangle"
""",
    "broken_one.py": "raise RuntimeError('imported')",
}


@pytest.fixture
def base(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> type:
    (tmp_path / "found").mkdir()
    for name, text in MODULES.items():
        (tmp_path / "found" / name).write_text(text)
    monkeypatch.syspath_prepend(str(tmp_path))
    before = set(sys.modules)
    from found.base import Shape  # type: ignore[import-not-found]

    yield Shape
    for name in set(sys.modules) - before:
        del sys.modules[name]


def test_concrete_classes_are_found_by_name_in_the_order_of_modules(base: type) -> None:
    found = found_in("found", base, lambda kind: kind.label, skip="broken*")
    # No abstract one (Half), none without a name (Cornered), and an imported one (Square) where it is defined.
    assert list(found) == ["circle", "square", "triangle"]
    assert found["square"].__module__ == "found.square"


def test_some_come_first(base: type) -> None:
    assert list(found_in("found", base, lambda kind: kind.label, first=("triangle", "unknown"), skip="broken*")) == [
        "triangle",
        "circle",
        "square",
    ]


def test_other_bases_find_nothing(base: type) -> None:
    class Other(ABC):
        @abstractmethod
        def nothing(self) -> None: ...

    assert found_in("found", Other, lambda kind: "x", skip="broken*") == {}


def test_a_broken_module_is_not_passed_over(base: type) -> None:
    with pytest.raises(RuntimeError, match="imported"):
        found_in("found", base, lambda kind: kind.label)


def test_the_registries_have_their_order() -> None:
    from qlb.integrators import INTEGRATORS
    from qlb.materials import MATERIALS
    from qlb.scenes import SCENES
    from qlb.solvers import SOLVERS

    assert list(MATERIALS) == ["SNH", "StVK", "CNH", "corotational", "ARAP", "MR", "linear"]
    assert list(INTEGRATORS) == ["BDF1", "BDF2", "SDIRK2", "quasistatic"]
    assert list(SOLVERS) == ["ND", "QLF", "QLB", "QLA"]
    assert next(iter(SCENES)) == "bar"
