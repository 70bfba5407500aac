"""`reproduce`: shared cases, going on, refusals, and what the figures and their files say."""

from __future__ import annotations

import csv
import shutil
import sys
from pathlib import Path

import pytest

import qlb
from qlb.results import Run, write_figure
from qlb.results.figure import FORMATS
from qlb.results.figure_drawing import draw_grid
from qlb.scenes import load_scene
from qlb.studies import FIGURES, Plan, Reproduction, Update, chosen_figures, plan_figures, reproduce
from qlb.studies import processes as processes_module

reproduce_module = sys.modules["qlb.studies.reproduce"]
TINY = ("mesh.cells=4,1,1", "steps=3")


def plan(directory: Path, *figures: object, overrides: tuple[str, ...] = TINY) -> Plan:
    return plan_figures(chosen_figures(map(str, figures)), overrides, directory)


def run(planned: Plan, **arguments) -> tuple[Reproduction, list[Update]]:
    updates: list[Update] = []
    result = reproduce(planned, processes=2, on_update=updates.append, **arguments)
    return result, updates


def names(updates: list[Update], state: str) -> set[str]:
    return {update.case.name for update in updates if update.state == state}


@pytest.fixture(autouse=True, scope="module")
def few_solvers():
    """Two columns, so that there is less to run."""
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(reproduce_module, "COLUMNS", ("ND", "QLB"))
        yield


@pytest.fixture(scope="module")
def done(tmp_path_factory, few_solvers) -> Reproduction:
    """Figures 2 and 5 of the tiny bar. Tests that change the folder copy it."""
    return run(plan(tmp_path_factory.mktemp("figures") / "out", 2, 5))[0]


def test_the_figures_are_the_supplements():
    assert list(FIGURES) == list(range(1, 11))
    assert [len(figure.rows) for figure in FIGURES.values()] == [4, 2, 2, 2, 3, 2, 2, 3, 2, 1]
    scene = load_scene("bar")
    assert (scene.steps, scene.tolerance.relative, scene.tolerance.absolute) == (120, 1e-6, 0)


def test_a_case_of_several_figures_runs_once(tmp_path):
    figures = [figure for figure in FIGURES.values() if figure.scene == "bar"]
    planned = plan(tmp_path, *(figure.number for figure in figures))
    by_figure = [{case.name for case in planned.cases_of(figure)} for figure in figures]
    assert set.intersection(*by_figure) == {"bar-default-ND", "bar-default-QLB"}
    assert len(planned.panels) == 2 * sum(len(figure.rows) for figure in figures)
    assert len(planned.cases) == len(set.union(*by_figure)) == 2 * (1 + 3 + 1 + 1 + 1 + 2)
    assert len({case.directory for case in planned.cases}) == len(planned.cases)


@pytest.mark.slow
def test_it_leaves_every_file(done):
    for number in (2, 5):
        for suffix in (*FORMATS, "csv"):
            assert (done.directory / f"figure-{number}.{suffix}").stat().st_size > 100
    page = (done.directory / "index.html").read_text().partition("<script")[0]
    assert page.count('<div class="plot grid" data-figure="') == 2
    assert page.count("<noscript><figure><img src=") == 2
    assert "Figure 5: Integrators" in page
    assert "http://" not in page.replace("http://www.w3.org", "")
    assert "https://" not in page
    assert page.count("not measured") == 6  # of QLF and QLA, which these tests leave out
    assert page.count("<strong>does not hold") + page.count('class="bad">does not hold') + page.count(">holds.") == 0
    assert '<th scope="col">independent prototype' not in page  # its counts are of other settings


@pytest.mark.slow
def test_csv_holds_what_the_runs_do(done):
    planned = plan(done.directory, 2, 5)
    for number in (2, 5):
        with (done.directory / f"figure-{number}.csv").open() as file:
            rows = list(csv.DictReader(file))
        panels = {key[1:]: case for key, case in planned.panels.items() if key[0] == number}
        assert {(row["row"], row["solver"]) for row in rows} == set(panels)
        for (label, solver), case in panels.items():
            of_panel = [row for row in rows if (row["row"], row["solver"]) == (label, solver)]
            curve = Run(case.directory).iterations_per_step()
            sums = dict.fromkeys(curve.steps.tolist(), 0)
            for row in of_panel:
                sums[int(row["step"])] += int(row["iterations"])
            assert list(sums.values()) == curve.iterations.tolist()
            failed = {int(row["step"]) for row in of_panel if row["converged"] == "false"}
            assert failed == set(curve.steps[~curve.converged].tolist())


@pytest.mark.slow
def test_goes_on_where_a_case_is_missing_or_half_done(done, tmp_path):
    out = shutil.copytree(done.directory, tmp_path / "out")
    shutil.rmtree(out / "runs" / "bar-BDF1-ND")
    summary = out / "runs" / "bar-BDF1-QLB" / "summary.json"
    summary.write_text(summary.read_text().replace('"complete"', '"running"'))
    (out / "figure-5.png").unlink()
    planned = plan(out, 5)
    result, updates = run(planned)
    assert names(updates, "finished") == {"bar-BDF1-ND", "bar-BDF1-QLB"}
    assert names(updates, "kept") == {case.name for case in planned.cases} - names(updates, "finished")
    assert (out / "figure-5.png").exists()
    assert [grid.number for grid in result.grids] == [2, 5]  # figure 2 is still there, and stays on the page


@pytest.mark.slow
def test_stopping_keeps_what_is_done_and_the_same_call_goes_on(tmp_path):
    planned = plan(tmp_path / "out", 2)
    ended: list[Update] = []

    def watch(update: Update) -> None:
        if update.state == "finished":
            ended.append(update)

    result = reproduce(planned, processes=1, on_update=watch, stop=lambda: len(ended) == 2)
    assert result.interrupted
    assert not (tmp_path / "out" / "index.html").exists()
    result, updates = run(planned)
    assert not result.interrupted
    assert names(updates, "kept") == {update.case.name for update in ended}


@pytest.mark.parametrize("figure", ["11", "0", "one", "-1"])
def test_unknown_figures_are_refused_with_those_there_are(figure):
    with pytest.raises(qlb.InputError, match=r"figure.*not known.*there are 1, 2, 3, 4, 5, 6, 7, 8, 9, 10"):
        chosen_figures([figure])


@pytest.mark.slow
def test_other_settings_in_the_same_folder_are_refused(done, tmp_path):
    out = shutil.copytree(done.directory, tmp_path / "out")
    changed = plan(out, 2, overrides=("mesh.cells=4,1,1", "steps=2"))
    with pytest.raises(qlb.InputError, match=r"steps = 3, not 2.*--overwrite"):
        run(changed)
    assert (out / "figure-5.png").exists()
    result, updates = run(changed, overwrite=True)
    assert names(updates, "finished") == {case.name for case in changed.cases}
    assert [grid.number for grid in result.grids] == [2]
    assert not (out / "figure-5.png").exists()


@pytest.mark.slow
@pytest.mark.parametrize("place", ["notes.txt", "runs/bar-default-ND/notes.txt"])
def test_foreign_files_are_refused_and_left(tmp_path, place):
    out = tmp_path / "out"
    if "/" in place:
        run(plan(out, 2))
        shutil.rmtree(out / "runs" / "bar-default-ND")
    (out / place).parent.mkdir(parents=True)
    (out / place).write_text("mine")
    with pytest.raises(qlb.InputError, match="choose another"):
        run(plan(out, 2), overwrite=True)
    assert (out / place).read_text() == "mine"


@pytest.mark.parametrize("override", ["solver=ND", "threads=2", "on_failure=stop", "stepz=3", "steps=0"])
def test_wrong_overrides_are_refused_before_anything_is_written(tmp_path, override):
    with pytest.raises(qlb.InputError, match=override.partition("=")[0]):
        plan(tmp_path / "out", 1, overrides=(override,))
    with pytest.raises(qlb.InputError, match="processes"):
        reproduce(plan(tmp_path / "out", 1), processes=0)
    assert not (tmp_path / "out").exists()


@pytest.mark.slow
@pytest.mark.parametrize(("steps", "marker"), [(3, "x"), (25, "|")])
def test_failed_steps_are_marked_and_counted(tmp_path, steps, marker):
    overrides = ("mesh.cells=2,1,1", f"steps={steps}", "solver_settings.max_iterations=1")
    result, _ = run(plan(tmp_path / "out", 2, overrides=overrides))
    assert not result.problems
    (grid,) = result.grids
    figure = draw_grid(grid)
    for ax, (_, _, case) in zip(figure.axes, grid.cells(), strict=True):
        failed = case.summary["failed_steps"]
        (marks,) = (line for line in ax.lines if line.get_gid() == "failed")
        assert (marks.get_xdata().tolist(), marks.get_marker()) == (failed, marker)
        assert f"{len(failed)} of {steps} failed" in [text.get_text() for text in ax.texts]
    page = (tmp_path / "out" / "index.html").read_text()
    assert "did not converge" in page
    assert page.count('class="bad"') == len(grid.solvers) * 2


@pytest.mark.slow
def test_two_stages_are_blue_and_red(tmp_path):
    result, _ = run(plan(tmp_path / "out", 2, overrides=(*TINY, "integrator=SDIRK2")))
    figure = draw_grid(result.grids[0])
    assert all(len(ax.lines) == 2 for ax in figure.axes)
    assert [text.get_text() for text in figure.legends[0].get_texts()] == ["first stage", "second stage"]


CRASHER = """
import io, json, os, sys
job = sys.stdin.read()
if "default-ND" in job:
    os.abort()
if "default-QLB" in job:
    raise RuntimeError("out of luck")
sys.stdin = io.StringIO(job)
from qlb.studies.worker import main
sys.exit(main())
"""


@pytest.mark.slow
def test_a_crash_is_reported_and_the_others_go_on(tmp_path, monkeypatch):
    monkeypatch.setattr(processes_module, "WORKER", (sys.executable, "-c", CRASHER))
    planned = plan(tmp_path / "out", 2)
    result, updates = run(planned)
    assert set(result.problems) == {"bar-default-ND", "bar-default-QLB"}
    assert "SIGABRT" in result.problems["bar-default-ND"]
    assert "out of luck" in result.problems["bar-default-QLB"]
    assert names(updates, "finished") == {case.name for case in planned.cases} - set(result.problems)
    page = (tmp_path / "out" / "index.html").read_text()
    assert page.count(">no run<") == 2
    assert "out of luck" in page
    monkeypatch.undo()
    result, updates = run(planned)
    assert not result.problems
    assert names(updates, "finished") == {"bar-default-ND", "bar-default-QLB"}


@pytest.mark.slow
def test_a_figure_without_any_run_can_be_drawn(done, tmp_path):
    grid = done.grids[0]
    empty = type(grid)(1, "Nothing", "nothing", ["ND"], {"row": {}})
    paths = write_figure(empty, tmp_path)
    assert paths["csv"].read_text().count("\n") == 1
    assert all(path.exists() for path in paths.values())
