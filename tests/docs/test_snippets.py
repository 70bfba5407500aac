"""Every Python snippet and every `qlb` command in the README and the guides runs as written."""

from __future__ import annotations

import re
import shlex
import sys
from pathlib import Path

import pytest

from qlb.cli.main import main
from qlb.results import COLUMNS
from qlb.scenes import load_scene

ROOT = Path(__file__).parents[2]
PAGES = [ROOT / "README.md", *sorted((ROOT / "docs").rglob("*.md"))]


def blocks(language: str) -> list:
    found = []
    for page in PAGES:
        for k, text in enumerate(re.findall(rf"^```{language}\n(.*?)^```", page.read_text(), re.DOTALL | re.MULTILINE)):
            found.append(pytest.param(text, id=f"{page.relative_to(ROOT)}-{k}"))
    return found


@pytest.mark.slow
@pytest.mark.parametrize("snippet", blocks("python"))
def test_python_snippet(snippet, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    exec(compile(snippet, "snippet", "exec"), {"__name__": "__main__"})


@pytest.mark.slow
@pytest.mark.parametrize("snippet", blocks("console"))
def test_commands(snippet, tmp_path, monkeypatch, capsys):
    monkeypatch.chdir(tmp_path)
    commands = [line[2:] for line in snippet.splitlines() if line.startswith("$ qlb ")]
    assert commands
    for command in commands:
        words, _, target = command.partition(" > ")
        monkeypatch.setattr(sys, "argv", shlex.split(words, comments=True))
        with pytest.raises(SystemExit) as end:
            main()
        assert not end.value.code, command
        output = capsys.readouterr().out
        if target:
            Path(target.strip()).write_text(output)


@pytest.mark.parametrize("snippet", blocks("yaml"))
def test_parts_of_scene_files(snippet, tmp_path):
    (tmp_path / "scene.yaml").write_text(snippet if "bodies:" in snippet else f"scene: bar\n{snippet}")
    load_scene(str(tmp_path / "scene.yaml")).build()


def test_local_links_lead_somewhere():
    for page in PAGES:
        text = re.sub(r"^```.*?^```", "", page.read_text(), flags=re.DOTALL | re.MULTILINE)
        for target in re.findall(r"\]\(([^)#:\s]+)\)", text):
            assert (page.parent / target).exists(), f"{page.name}: {target}"


def test_every_column_of_the_statistics_is_explained():
    page = (ROOT / "docs" / "run-directory.md").read_text()
    assert all(f"| `{name}` |" in page for name in COLUMNS)
