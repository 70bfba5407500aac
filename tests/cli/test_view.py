"""`qlb view`: opens the page of a run, and makes it where it is missing or older than the run."""

from __future__ import annotations

import os
import sys
import webbrowser
from pathlib import Path

import pytest

from qlb.cli.main import main
from qlb.scenes import load_scene
from qlb.studies import run_scene


@pytest.fixture
def view(monkeypatch, capsys):
    """Call `qlb view ARGUMENTS`: (exit status, output, addresses opened)."""
    opened: list[str] = []
    monkeypatch.setattr(webbrowser, "open", opened.append)
    monkeypatch.setattr("qlb.results.report.render_frames", lambda run, path: None)

    def call(*arguments: object) -> tuple[int, str, list[str]]:
        monkeypatch.setattr(sys, "argv", ["qlb", "view", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        streams = capsys.readouterr()
        return int(end.value.code or 0), streams.out + streams.err, opened

    return call


@pytest.fixture
def run(tmp_path: Path) -> Path:
    return run_scene(load_scene("bar", ["mesh.cells=2,1,1", "steps=2", "threads=1"]), tmp_path / "run").directory


def test_makes_and_opens_the_page(view, run):
    status, out, opened = view(run)
    page = run / "report.html"
    assert status == 0
    assert out.splitlines() == [str(page)]
    assert opened == [page.as_uri()]


def test_makes_the_page_again_only_where_it_is_old(view, run):
    view(run, "--no-open")
    page = run / "report.html"
    page.write_text("mine")
    _, _, opened = view(run, "--no-open")
    assert page.read_text() == "mine"
    assert opened == []
    newer = page.stat().st_mtime_ns + 10**9
    os.utime(run / "summary.json", ns=(newer, newer))
    view(run, "--no-open")
    assert page.read_text() != "mine"


def test_opens_pages_of_comparisons_and_figures(view, tmp_path):
    for name in ("report.html", "index.html"):
        folder = tmp_path / name.split(".")[0]
        folder.mkdir()
        (folder / name).write_text("page")
        assert view(folder)[2][-1] == (folder / name).as_uri()


def test_refuses_what_has_no_page(view, tmp_path):
    status, out, opened = view(tmp_path)
    assert status == 2
    assert "not a run, a comparison, a sweep or figures" in out
    assert opened == []
