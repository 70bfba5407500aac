"""A headless Chromium that draws in software, and runs to look at."""

from __future__ import annotations

import shutil
from collections.abc import Callable, Iterator, Sequence
from pathlib import Path

import pytest
from playwright.sync_api import Browser, sync_playwright

from qlb.results import finish_run, write_comparison
from qlb.scenes import load_scene
from qlb.studies import SolverCase, compare, run_scene
from tests.browser.pages import OpenPage

Open = Callable[..., OpenPage]

SMALL_BAR = ["mesh.cells=6,2,2", "steps=12", "threads=1"]


@pytest.fixture(scope="session")
def browser() -> Iterator[Browser]:
    path = shutil.which("chromium") or shutil.which("google-chrome")
    assert path is not None, "these tests need Chromium: scripts/install-system.sh installs it"
    switches = ["--use-angle=swiftshader", "--enable-unsafe-swiftshader", "--no-sandbox"]
    with sync_playwright() as playwright:
        chromium = playwright.chromium.launch(executable_path=path, args=switches)
        yield chromium
        chromium.close()


@pytest.fixture
def open_page(browser: Browser) -> Iterator[Open]:
    """Open a file or an address in a window of its own; at the end no page may have complained."""
    opened: list[OpenPage] = []

    def make(
        where: Path | str,
        *,
        width: int = 800,
        scheme: str = "light",
        ready: Sequence[str] = ("#viewer-root", "#plots-root"),
    ) -> OpenPage:
        opened.append(OpenPage(browser, where, width, scheme, ready))
        return opened[-1]

    yield make
    for page in opened:
        page.close()
        assert page.complaints == []


def run(scene: str, overrides: list[str], directory: Path) -> Path:
    """The folder of a run with its report."""
    outcome = run_scene(load_scene(scene, overrides), directory)
    finish_run(outcome.directory, picture=False)
    return outcome.directory


@pytest.fixture(scope="session")
def bar(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Of 12 steps."""
    return run("bar", SMALL_BAR, tmp_path_factory.mktemp("page") / "bar")


@pytest.fixture(scope="session")
def bunny(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A few steps on the ground."""
    small = ["mesh.tets=500", "drop.height=0.01", "steps=8", "threads=1", "contact.friction=0.5"]
    return run("bunny", small, tmp_path_factory.mktemp("page") / "bunny")


@pytest.fixture(scope="session")
def comparison(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The page of three solvers."""
    folder = tmp_path_factory.mktemp("page") / "compare"
    cases = [SolverCase.parse(name) for name in ("ND", "QLB", "QLA")]
    result = compare("bar", SMALL_BAR, cases, folder)
    for outcome in result.outcomes.values():
        finish_run(outcome.directory, picture=False)
    return write_comparison(result.runs, result.rows(), folder)
