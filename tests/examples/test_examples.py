"""Every example runs as a user would run it, says something, and is short."""

from __future__ import annotations

import subprocess
import sys
from pathlib import Path

import pytest

ROOT = Path(__file__).parents[2]
EXAMPLES = sorted((ROOT / "examples").glob("*.py"))


@pytest.mark.slow
@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_runs(example: Path, tmp_path: Path) -> None:
    command = [sys.executable, "-W", "error", str(example), str(tmp_path / "out")]
    done = subprocess.run(command, cwd=tmp_path, capture_output=True, text=True, timeout=120, check=False)
    assert done.returncode == 0, done.stderr
    assert done.stdout.strip()
    assert not done.stderr
    # What it writes is where it was told to.
    assert {path.name for path in tmp_path.iterdir()} <= {"out"}


@pytest.mark.parametrize("example", EXAMPLES, ids=lambda path: path.stem)
def test_example_is_short_and_has_a_main(example: Path) -> None:
    text = example.read_text()
    assert len(text.splitlines()) <= 60
    assert text.startswith('"""')
    assert "def main(" in text
    assert 'if __name__ == "__main__":' in text


def test_examples_are_in_the_guide() -> None:
    guide = (ROOT / "docs" / "guide.md").read_text()
    assert EXAMPLES
    assert all(f"examples/{example.name})" in guide for example in EXAMPLES)
