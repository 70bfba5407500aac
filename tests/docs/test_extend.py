"""The pages on how to extend qlb, followed word for word in a copy of the tree: what they promise is there.

Blocks with a caption are files, and are written; lines `$ ...` are commands, and are run. `make setup` stands for a
build of the compiled module alone, unoptimised and for the lowest SIMD level, which is what a test can wait for.
"""

from __future__ import annotations

import os
import re
import shlex
import shutil
import subprocess
import sys
from dataclasses import dataclass
from pathlib import Path

import pytest

from qlb import _native

ROOT = Path(__file__).parents[2]
EXTEND = ROOT / "docs" / "extend"
BLOCK = re.compile(r"^```\{code-block\} \w+\n(?::caption: (\S+)\n)?(.*?)^```", re.DOTALL | re.MULTILINE)
TREE = ["src", "native", "tests", "docs", "examples", "CMakeLists.txt", "pyproject.toml"]


@dataclass
class Copy:
    """A copy of the tree, in which commands find the copy's package and no installed one."""

    folder: Path

    def run(self, *command: str, check: bool = True) -> str:
        packages = [path for path in sys.path if path.endswith("-packages")]
        path = os.pathsep.join([str(self.folder / "src"), str(self.folder), str(self.folder / "docs/_ext"), *packages])
        # -S: an editable install would put the original in front.
        full = [sys.executable, "-S", *command]
        environment = os.environ | {"PYTHONPATH": path, "OMP_NUM_THREADS": "1"}
        done = subprocess.run(full, cwd=self.folder, env=environment, capture_output=True, text=True, check=False)
        assert done.returncode == 0 or not check, f"{command}\n{done.stdout}\n{done.stderr}"
        return done.stdout

    def build(self) -> None:
        """The compiled module of the copy, into its package."""
        cmake_dir = self.run("-m", "nanobind", "--cmake_dir").strip()
        options = [
            "-DCMAKE_BUILD_TYPE=Debug",
            "-DCMAKE_CXX_FLAGS_DEBUG=-O0",
            "-DQLB_ONE_SIMD_LEVEL=ON",
            "-DCMAKE_UNITY_BUILD=ON",
            f"-Dnanobind_DIR={cmake_dir}",
            f"-DPython_EXECUTABLE={sys.executable}",
        ]
        for command in (
            ["cmake", "-S", ".", "-B", "build", "-G", "Ninja", *options],
            ["ninja", "-C", "build", "_native"],
        ):
            done = subprocess.run(command, cwd=self.folder, capture_output=True, text=True, check=False)
            assert done.returncode == 0, done.stdout[-4000:] + done.stderr
        (module,) = (self.folder / "build").glob("_native*.so")
        shutil.copy(module, self.folder / "src" / "qlb" / module.name)

    def follow(self, page: str) -> dict[str, str]:
        """Do what a page says; gives what its commands print."""
        outputs = {}
        for target, text in BLOCK.findall((EXTEND / f"{page}.md").read_text()):
            if target:
                (self.folder / target).write_text(text)
                continue
            for line in re.findall(r"^\$ (.*)$", text, re.MULTILINE):
                outputs[line] = self._command(*shlex.split(line))
        return outputs

    def _command(self, name: str, *arguments: str) -> str:
        if name == "make":
            assert arguments == ("setup",)
            self.build()
            return ""
        if name == "qlb":
            return self.run("-c", "from qlb.cli.main import main; main()", *arguments)
        if name == "pytest":
            output = self.run("-m", "pytest", "-q", "-p", "no:cacheprovider", *arguments)
            assert re.search(r"^[1-9]\d* passed", output, re.MULTILINE), output
            return output
        assert name == "python"
        return self.run(*arguments)


@pytest.fixture
def copy(tmp_path: Path) -> Copy:
    unwanted = shutil.ignore_patterns("__pycache__", "*.so", "node_modules")
    for name in TREE:
        source = ROOT / name
        if source.is_dir():
            shutil.copytree(source, tmp_path / name, ignore=unwanted)
        else:
            shutil.copy(source, tmp_path / name)
    shutil.copy(str(_native.__file__), tmp_path / "src" / "qlb" / Path(str(_native.__file__)).name)
    return Copy(tmp_path)


def passed(output: str) -> int:
    found = re.search(r"(\d+) passed", output)
    return int(found[1]) if found else 0


def reference(copy: Copy, name: str) -> str:
    """What the reference pages of the copy say."""
    return copy.run("-c", f"import generated; print(generated.{name}_markdown())")


def test_pages_are_those_of_the_index() -> None:
    linked = set(re.findall(r"\]\((\w+)\.md\)", (EXTEND / "index.md").read_text()))
    assert linked == {path.stem for path in EXTEND.glob("*.md")} - {"index"}


@pytest.mark.slow
def test_a_material(copy: Copy) -> None:
    Path(str(next((copy.folder / "src" / "qlb").glob("_native*.so")))).unlink()
    outputs = copy.follow("material")
    assert passed(outputs["pytest tests/materials -k INH"]) > 50
    assert "| `INH` | `IsochoricNeoHookean` |" in reference(copy, "materials")
    assert "### `INH`: IsochoricNeoHookean" in reference(copy, "material_keys")
    derivatives = copy.run(
        "-m", "pytest", "-q", "-p", "no:cacheprovider", "tests/materials/test_derivatives.py", "-k", "INH"
    )
    assert passed(derivatives) >= 36  # two ratios, six kinds of F, three tests


@pytest.mark.slow
def test_an_energy(copy: Copy) -> None:
    outputs = copy.follow("energy")
    heights = [float(line.split()[2]) for line in outputs["python drawn_bar.py"].splitlines()]
    assert len(heights) == 20
    assert heights[-1] > heights[0] > 0.125


@pytest.mark.slow
def test_an_integrator(copy: Copy) -> None:
    outputs = copy.follow("integrator")
    assert passed(outputs["pytest tests/integrators -k SDIRK3"]) >= 6
    assert "| `SDIRK3` | Three stages of order 3" in reference(copy, "integrators")
    assert "SDIRK3" in reference(copy, "commands")


@pytest.mark.slow
def test_a_solver(copy: Copy) -> None:
    outputs = copy.follow("solver")
    assert passed(outputs["pytest tests/solvers/test_reasons.py -k chord"]) >= 6
    assert "| `chord` | Newton with the factor" in reference(copy, "solvers")
    assert "chord" in reference(copy, "commands")


@pytest.mark.slow
def test_a_scene(copy: Copy) -> None:
    outputs = copy.follow("scene")
    assert "Height; > 0 m" in outputs["qlb scenes --show pillar"]
    assert passed(outputs["pytest tests/scenes -k pillar"]) >= 3
    text = reference(copy, "scenes")
    assert "### Scene `pillar`" in text
    assert "| `press.depth` | `0.2` | m | >= 0 | How far the top goes down |" in text
    assert "pillar" in copy.run("-c", "from qlb.cli.main import main; main()", "scenes")
