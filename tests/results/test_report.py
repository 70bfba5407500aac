"""Report pages: whole, self-contained, escaped, and honest about what is missing."""

from __future__ import annotations

import json
import sys
from html.parser import HTMLParser
from pathlib import Path

import pytest

import qlb
from qlb.mesh import MeshReport, SurfaceReport
from qlb.results import Run, RunWriter, finish_run, plot_residuals, write_comparison, write_report

VOID = {"meta", "img", "br", "link", "hr"}


class Page(HTMLParser):
    """Checks that tags are balanced, and keeps what a test asks about."""

    def __init__(self, path: Path) -> None:
        super().__init__()
        self.open: list[str] = []
        self.tags: list[str] = []
        self.links: list[str] = []
        self.sources: list[str] = []
        self.text = ""
        self.scripts: list[str] = []
        self.feed(path.read_text(encoding="utf-8"))
        self.close()
        assert self.open == []

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.tags.append(tag)
        self.scripts += [""] if tag == "script" else []
        values = dict(attrs)
        self.links += [str(values["href"])] if "href" in values else []
        self.sources += [str(values["src"])] if "src" in values else []
        if tag not in VOID:
            self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        assert self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "script":
            self.scripts[-1] += data
        else:
            self.text += data


@pytest.fixture
def without_scripts(tmp_path, monkeypatch):
    """As where qlb was built without npm."""
    monkeypatch.setattr("qlb.results.page.scripts.STATIC", tmp_path / "static")


def test_finish_run_makes_everything(make_run, monkeypatch):
    run = make_run()
    monkeypatch.setattr("qlb.results.report.render_frames", lambda run, path: path.write_bytes(b"\x89PNG"))
    files = finish_run(run.directory)
    assert list(files) == ["picture", "iterations", "residuals", "seconds", "report"]
    assert all(path.is_file() for path in files.values())
    page = Page(files["report"])
    assert [source.split(",")[0] for source in page.sources] == ["data:image/png;base64"]
    content, *scripts = page.scripts
    assert len(scripts) == 2
    animation = json.loads(content)["animations"][0]
    assert animation["chunks"][0]["steps"] == [0, 1, 2, 3]
    assert all((run.directory / link).exists() for link in page.links if not link.startswith("data:"))
    assert "Converged: all 3 steps." in page.text
    assert "material.young" in page.text
    assert "20000" in page.text
    assert qlb.__version__ in page.text


def test_a_page_shows_values_as_they_are(make_run):
    evil = '<script>alert(1)</script> & "quotes" {{ 7 * 7 }} ünï'
    run = make_run(scene={"scene": evil, evil: [evil]})
    path = finish_run(run.directory, picture=False)["report"]
    assert "<script>alert" not in path.read_text(encoding="utf-8")
    page = Page(path)
    assert page.text.count(evil) >= 4
    assert len(page.scripts) == 3
    assert json.loads(page.scripts[0])["charts"][0]["label"].startswith(evil)
    comparison = Page(write_comparison({evil: run}, [{"solver": evil, "note": evil}], run.directory.parent))
    assert len(comparison.scripts) == 3
    assert comparison.text.count(evil) >= 4


def test_without_pyvista_the_report_says_so(make_run, monkeypatch):
    monkeypatch.setitem(sys.modules, "pyvista", None)
    run = make_run()
    files = finish_run(run.directory)
    assert "picture" not in files
    assert 'The run, left out: a picture needs pyvista: pip install "qlb[view]"' in Page(files["report"]).text


def test_without_scripts_a_report_shows_pictures_and_says_so(make_run, without_scripts, tmp_path):
    run = make_run()
    page = Page(finish_run(run.directory, picture=False)["report"])
    assert "script" not in page.tags
    assert len(page.sources) == 3
    assert "built without the scripts of the page" in page.text
    comparison = Page(write_comparison({"QLA": run}, [{"solver": "QLA"}], tmp_path))
    assert len(comparison.sources) == 1
    assert "built without the scripts of the page" in comparison.text


def test_a_report_holds_the_images_that_are_there(make_run, without_scripts):
    run = make_run()
    assert Page(write_report(run)).sources == []
    plot_residuals(run, run.directory / "residuals.png")
    page = Page(write_report(run, {"picture": "no paint"}))
    assert len(page.sources) == 1
    assert "left out: no paint" in page.text


def test_failed_steps_are_named_with_reasons(make_run):
    settings = qlb.SolverSettings(max_iterations=2)
    never = qlb.Tolerance(relative=0, absolute=0, scaled=0)
    run = make_run(steps=4, on_failure="accept", tolerance=never, solver_settings=settings)
    text = Page(write_report(run)).text
    assert "4 steps of 4 did not converge: 1 to 4 (max iterations)." in text
    stats = run.directory / "stats.csv"
    lines = stats.read_text().splitlines()
    good = [line.replace("max_iterations", "converged_relative") if line.startswith("2,") else line for line in lines]
    stats.write_text("\n".join(good) + "\n")
    assert "1 (max iterations), 2 (unknown), 3 to 4 (max iterations)." in Page(write_report(Run(run.directory))).text


def test_notes_of_meshing_stand_on_the_page_of_a_run(tmp_path):
    """Also where the mesh was placed, and once where several bodies have it."""
    found = SurfaceReport(8, 11, 1, 3, 1, 0, 2, 0, 5, 0)
    mesh = qlb.TetMesh.box(cells=(2, 1, 1))
    mesh.report = MeshReport("a<b.obj", found, None, 12, 1, edge=0.1, envelope=1e-3, deviation=2e-2)
    placed = qlb.Placement(scale=2.0, translation=(5, 0, 0)).of(mesh)
    bodies = [qlb.Body(m, material=qlb.StableNeoHookean()) for m in (placed, mesh, qlb.TetMesh.box(cells=(1, 1, 1)))]
    simulation = qlb.Simulation(bodies=bodies[::2], threads=1)
    RunWriter(tmp_path / "run", {}, simulation).finish("complete")
    run = Run(tmp_path / "run")
    (entry,) = run.summary["meshing"]
    assert entry["facts"]["target edge"] == "0.2 m"  # of the body, twice as large
    page = Page(write_report(run))
    assert "Mesh from a<b.obj" in page.text
    assert "a<b.obj: the surface is open: 3 boundary edges around 1 hole; filling closes them" in page.text
    assert "at most 2 % of the diagonal" in page.text
    places = (qlb.Placement(), qlb.Placement(translation=(9, 0, 0)))
    twice = [qlb.Body(mesh, material=qlb.StableNeoHookean(), placement=place) for place in places]
    with RunWriter(tmp_path / "two", {}, qlb.Simulation(bodies=twice, threads=1)) as writer:
        assert len(Run(writer.directory).summary["meshing"]) == 1
    plain = RunWriter(tmp_path / "plain", {}, qlb.Simulation(bodies=bodies[2:], threads=1)).finish("complete")
    assert plain["meshing"] == []
    assert "Mesh from" not in Page(write_report(Run(tmp_path / "plain"))).text


def test_a_stopped_run_says_why(tmp_path, make_simulation):
    never = qlb.Tolerance(relative=0, absolute=0, scaled=0)
    simulation = make_simulation(tolerance=never, solver_settings=qlb.SolverSettings(max_iterations=2))
    with pytest.raises(qlb.StepFailed), RunWriter(tmp_path / "run", {}, simulation) as writer:
        writer.record(simulation.advance())
    text = Page(finish_run(tmp_path / "run", picture=False)["report"]).text
    assert "Stopped after 0 steps." in text
    assert "Step 1 (time 0.01 s) did not converge: max_iterations after 2 iterations of QLA" in text


def test_other_endings(tmp_path, make_simulation):
    simulation = make_simulation()
    writer = RunWriter(tmp_path / "run", {}, simulation)
    writer.record(simulation.advance())
    text = Page(finish_run(tmp_path / "run", picture=False)["report"]).text
    assert "Not finished: 1 step so far." in text
    writer.finish("interrupted")
    text = Page(finish_run(tmp_path / "run", picture=False)["report"]).text
    assert "Interrupted after 1 step." in text


def test_a_comparison_links_to_its_reports(make_run, tmp_path):
    runs = {name: make_run(name, solver=name.split()[0]) for name in ("ND", "QLB 100%")}
    for run in runs.values():
        finish_run(run.directory, picture=False)
    rows = [{"solver": name, "iterations_mean": 7.25, "difference": None} for name in runs]
    page = Page(write_comparison(runs, rows, tmp_path))
    assert page.links[1:] == ["ND/report.html", "QLB%20100%25/report.html"]
    assert "iterations, mean" in page.text
    assert "7.25" in page.text
    assert "Converged: all steps of all runs." in page.text
    assert [animation["label"] for animation in json.loads(page.scripts[0])["animations"]] == list(runs)


def test_a_comparison_needs_runs(tmp_path):
    with pytest.raises(qlb.InputError, match="no runs"):
        write_comparison({}, [], tmp_path)
