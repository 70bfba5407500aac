"""The public API as a user has it: a script outside of the package passes mypy --strict, and runs."""

from __future__ import annotations

import os
import re
import shutil
import subprocess
import sys
from importlib.resources import files
from pathlib import Path

import pytest

from tests.api import user_script

ROOT = Path(__file__).parents[2]


def test_the_package_says_that_it_has_types():
    assert (files("qlb") / "py.typed").is_file()


def test_the_script_runs(tmp_path):
    user_script.main(tmp_path)


def mypy(folder: Path, *names: str) -> str:
    """What mypy --strict says of scripts in a folder, where it finds qlb as an installed package."""
    # An editable install has a hook in place of the package, which mypy does not follow.
    environment = os.environ | {"MYPYPATH": str(files("qlb").joinpath("..")), "MYPY_CACHE_DIR": str(folder / "cache")}
    command = [sys.executable, "-m", "mypy", "--strict", "--follow-imports=silent", *names]
    done = subprocess.run(command, cwd=folder, env=environment, capture_output=True, text=True, check=False)
    assert not done.stderr, done.stderr
    return done.stdout


@pytest.mark.slow
def test_scripts_pass_a_strict_type_check_and_wrong_ones_do_not(tmp_path):
    shutil.copy(Path(user_script.__file__), tmp_path / "mine.py")
    readme = (ROOT / "README.md").read_text()
    snippet = re.search(r"^```python\n(.*?)^```", readme, re.DOTALL | re.MULTILINE)
    assert snippet
    (tmp_path / "snippet.py").write_text(snippet[1])
    wrong = (tmp_path / "mine.py").read_text().replace("iterations += result.iterations", "iterations += result.reason")
    (tmp_path / "wrong.py").write_text(wrong)
    assert mypy(tmp_path, "mine.py", "snippet.py").startswith("Success: no issues found in 2 source files")
    assert "Unsupported operand types" in mypy(tmp_path, "wrong.py")
