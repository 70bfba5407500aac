"""The site: it builds without a warning, and the reference holds all that the code has."""

from __future__ import annotations

import re
import subprocess
import sys
from pathlib import Path

import pytest
import yaml

import qlb
from qlb.cli.main import app
from qlb.integrators import INTEGRATORS
from qlb.materials import MATERIALS
from qlb.scenes import SCENES
from qlb.setting_keys import key_fields
from qlb.solvers import SOLVERS

ROOT = Path(__file__).parents[2]
DOCS = ROOT / "docs"
sys.path.insert(0, str(DOCS / "_ext"))
import generated  # noqa: E402


@pytest.mark.slow
def test_the_site_builds_without_a_warning(tmp_path: Path) -> None:
    command = [sys.executable, "-m", "sphinx", "-W", "--keep-going", "-q", "-b", "html", str(DOCS), str(tmp_path)]
    done = subprocess.run(command, cwd=ROOT, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stdout + done.stderr
    pages = {path.relative_to(DOCS).with_suffix("") for path in DOCS.rglob("*.md")}
    assert pages <= {path.relative_to(tmp_path).with_suffix("") for path in tmp_path.rglob("*.html")}
    # What a page shows comes with it.
    for page in tmp_path.rglob("*.html"):
        assert not re.search(r"<(script|img|link)[^>]*(src|href)=\"https?:", page.read_text()), page


def test_every_key_of_every_scene_is_in_the_reference() -> None:
    pages = ("common", "contact", "material_keys", "alternatives", "scenes")
    keys = set(
        re.findall(r"^\| `(\S+)` \|", "".join(getattr(generated, f"{p}_markdown")() for p in pages), re.MULTILINE)
    )
    for kind in SCENES.values():
        for key in key_fields(kind):
            parts = key.split(".")
            # What may stand in several places is there once: bodies.N.mesh.tets as mesh.tets.
            assert key == "scene" or {".".join(parts[k:]) for k in range(max(1, len(parts) - 1))} & keys, key


def test_every_material_integrator_and_solver_has_a_row() -> None:
    for found, text in (
        (MATERIALS, generated.materials_markdown()),
        (INTEGRATORS, generated.integrators_markdown()),
        (SOLVERS, generated.solvers_markdown()),
    ):
        rows = re.findall(r"^\| `(\S+)` \| (.+) \|$", text.partition("---")[2], re.MULTILINE)
        assert [name for name, _ in rows] == list(found)
        assert all(len(what) > 20 for _, what in rows)


def test_rows_hold_default_unit_range_and_meaning() -> None:
    text = generated.settings_markdown(qlb.Contact, "contact.")
    assert "| `contact.friction` | `0` |  | >= 0 | Coulomb's coefficient mu wherever two things touch |" in text
    assert "| `contact.mode` | `barrier` |  | `barrier`, `penalty` |" in text
    assert "| `contact.dhat` | `null` | m | > 0 |" in text
    assert r"| `tolerance.relative` | `1e-06` |  | >= 0 and < 1 | \|g\| relative to" in generated.common_markdown()
    assert "| `steps` | `200` |" in generated.scene_markdown("bunny")


def test_every_command_and_option_is_in_the_reference() -> None:
    text = generated.commands_markdown()
    names = [command.name or command.callback.__name__ for command in app.registered_commands]
    assert all(f"## qlb {name}\n" in text for name in names)
    assert "| `--set`, `-s` |" in text
    assert "`--picture`, `--no-picture`" in text


def test_every_public_name_is_in_the_reference() -> None:
    pages = "".join(path.read_text() for path in (DOCS / "reference").glob("*.md"))
    listed = {
        name for names in re.findall(r"^```\{generated\} api (.+)$", pages, re.MULTILINE) for name in names.split()
    }
    assert listed | {"shapes", "__version__"} == set(qlb.__all__)


def test_the_citation_names_software_and_paper() -> None:
    citation = yaml.safe_load((ROOT / "CITATION.cff").read_text())
    assert citation["version"] == qlb.__version__
    assert citation["license"] == "Apache-2.0"
    assert citation["references"][0]["doi"] in (DOCS / "theory" / "index.md").read_text()


def test_speeds_in_the_readme_are_those_of_the_benchmarks() -> None:
    readme, page = (ROOT / "README.md").read_text(), (DOCS / "benchmarks.md").read_text()
    measured = [row.split("|") for row in page.splitlines() if re.match(r"\| (1536|5184|12288|53742|192000) \| `", row)]
    times = {(row[1].strip(), row[2].strip(" `")): float(row[10]) for row in reversed(measured) if len(row) == 15}
    best = "ND:projection=on-demand:initial_guess=predictor"
    columns = ["ND:cholesky=cholmod", f"{best}:cholesky=cholmod", best, "QLB:cholesky=cholmod", "QLB", "QLA"]
    sizes = {"1.5k": "1536", "5.2k": "5184", "12k": "12288", "54k": "53742", "192k": "192000"}
    rows = re.findall(r"^\| (\S+k) \|(.*)\|$", readme, re.MULTILINE)
    assert [size for size, _ in rows] == list(sizes)
    for size, cells in rows:
        for solver, cell in zip(columns, cells.split("|"), strict=True):
            shown = cell.strip(" *")
            assert not shown or float(shown) == pytest.approx(times[sizes[size], solver], rel=0.06), (size, solver)


def test_the_readme_is_short() -> None:
    assert len((ROOT / "README.md").read_text().splitlines()) < 120
