"""Every example scene file runs at a small size, is short, and is in the gallery with a picture."""

from __future__ import annotations

from pathlib import Path

import pytest

from qlb.scenes import BodiesScene, load_scene
from qlb.scenes.meshes import ShapeMesh
from qlb.studies import run_scene

ROOT = Path(__file__).parents[2]
SCENES = sorted((ROOT / "examples" / "scenes").iterdir())
SMALL = {"ball": 200, "box": 100, "duck": 400, "torus": 400}
"""Tets of each shape in the tests."""


def small(path: Path) -> list[str]:
    scene = load_scene(str(path))
    assert isinstance(scene, BodiesScene)
    changes = ["steps=3", "threads=1"]
    for name, entries in (("bodies", scene.bodies), ("obstacles", scene.obstacles)):
        for k, entry in enumerate(entries):
            mesh = getattr(entry, "mesh", None)
            if isinstance(mesh, ShapeMesh):
                changes.append(f"{name}.{k}.mesh.tets={SMALL[mesh.shape]}")  # type: ignore[attr-defined]
    return changes


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.name)
def test_it_runs(path, tmp_path):
    outcome = run_scene(load_scene(str(path), small(path)), tmp_path / "out")
    assert outcome.summary["converged"]
    assert outcome.summary["steps"] == 3


@pytest.mark.parametrize("path", SCENES, ids=lambda path: path.name)
def test_it_is_short_and_says_what_it_shows(path):
    lines = path.read_text().splitlines()
    assert len(lines) <= 45
    assert lines[0].startswith("# ")


def test_the_gallery_shows_them_all():
    page = (ROOT / "docs" / "gallery.md").read_text()
    for path in SCENES:
        assert f"](../examples/scenes/{path.name})" in page
        picture = ROOT / "docs" / "images" / "gallery" / f"{path.stem}.png"
        assert f"](images/gallery/{picture.name})" in page
        assert 5_000 < picture.stat().st_size < 300_000
    assert {path.suffix for path in SCENES} == {".yaml", ".toml"}
