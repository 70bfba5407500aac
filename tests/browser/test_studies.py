"""Pages of sweeps and figures in a browser: they open from disk, plot what the runs did, sort, and name what failed."""

from __future__ import annotations

import csv
from pathlib import Path

import pytest

from qlb.results import Run, finish_run
from qlb.studies import Sweep, chosen_figures, plan_figures, plan_sweep, reproduce, sweep
from tests.browser.conftest import Open

pytestmark = pytest.mark.slow

# What plotly was given: of each trace its name, x, y and whether it is drawn as crosses.
TRACES = "(box) => box.data.map(({ name, x, y, marker }) => [name, x, y, marker?.symbol ?? ''])"


@pytest.fixture(scope="module")
def swept(tmp_path_factory: pytest.TempPathFactory) -> Sweep:
    """Two stiffnesses that run and one that is refused, two solvers of which one fails at the second stiffness."""
    folder = tmp_path_factory.mktemp("studies") / "sweep"
    lists = ["material.young=1e6,6e3,-1", "solver=QLA,QLF"]
    common = ["mesh.cells=6,2,2", "steps=6", "step=4e-2", "solver_settings.max_iterations=12", "on_failure=accept"]
    plan = plan_sweep("bar", lists, folder, common)
    sweep(plan, processes=1)
    finish_run(folder / "runs" / "young-1e6_solver-QLA", picture=False)
    return sweep(plan, processes=1)  # which finds that report


def test_a_sweep_is_plotted_over_its_keys(open_page: Open, swept: Sweep) -> None:
    page = open_page(swept.page, ready=["#plots-root"])
    assert page.requests == [swept.page.resolve().as_uri()]
    rows = {row["case"]: row for row in csv.DictReader(swept.table.read_text().splitlines())}
    ids = page.page.eval_on_selector_all("#plots-root section", "(all) => all.map((one) => one.id)")
    assert ids == ["iterations", "factorizations", "seconds"]
    for id_, column in (("iterations", "iterations_mean"), ("factorizations", "factorizations")):
        lines = page.page.eval_on_selector(f"#{id_} .plot", TRACES)
        assert [(name, x) for name, x, _, symbol in lines if not symbol] == [
            ("solver = QLA", [6e3, 1e6]),  # sorted, and without the one that was refused
            ("solver = QLF", [6e3, 1e6]),
        ]
        for name, _, y, _ in lines[:2]:
            expected = [float(rows[f"young-{young}_solver-{name[-3:]}"][column]) for young in ("6e3", "1e6")]
            assert y == pytest.approx(expected)
    page.page.select_option("#over", label="solver")
    page.wait_for("() => document.querySelector('#iterations .plot').data[0].name === 'young = 1e6'")
    lines = page.page.eval_on_selector("#seconds .plot", TRACES)
    assert lines[0][1] == ["QLA", "QLF"]


def test_what_failed_is_named_and_crossed_out(open_page: Open, swept: Sweep) -> None:
    page = open_page(swept.page, ready=["#plots-root"], scheme="dark", width=390)
    assert page.page.evaluate("document.documentElement.scrollWidth") <= 390
    bad = [row["case"] for row in swept.rows if row["status"] != "complete" or row["converged"] != "true"]
    assert 2 < len(bad) < 6
    assert page.page.locator("#trouble th").all_inner_texts() == bad
    text = page.page.inner_text("#trouble")
    assert "refused: material.young: -1 is out of range" in text
    assert "did not converge" in text
    assert page.page.inner_text(".verdict").startswith(f"{len(bad)} of 6 cases")
    crosses = [line for line in page.page.eval_on_selector("#iterations .plot", TRACES) if line[3] == "x-thin"]
    assert sum(len(x) for _, x, _, _ in crosses) == len(bad) - 2


def test_its_table_is_sorted_by_a_click(open_page: Open, swept: Sweep) -> None:
    page = open_page(swept.page, ready=["#plots-root"])
    means = {row["case"]: row["iterations_mean"] for row in swept.rows}
    cases = page.page.locator("#table tbody th")
    assert cases.all_inner_texts() == list(means)
    known = sorted((case for case in means if means[case] != ""), key=lambda case: round(means[case], 2))
    refused = [case for case in means if means[case] == ""]
    button = page.page.locator("#table thead button", has_text="iterations, mean")
    for order, direction in ((known, "ascending"), (known[::-1], "descending")):
        button.click()
        assert cases.all_inner_texts() == order + refused
        assert page.page.locator(f"th[aria-sort={direction}]").inner_text() == "iterations, mean"
    links = page.page.eval_on_selector_all("#table tbody a", "(all) => all.map((one) => one.href)")
    assert links == [(swept.directory / "runs" / "young-1e6_solver-QLA" / "report.html").resolve().as_uri()]


@pytest.fixture(scope="module")
def figures(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """Figure 5, whose quasistatic row fails with QLF in most steps; two stages are in none of it."""
    folder = tmp_path_factory.mktemp("studies") / "figures"
    settings = ["mesh.cells=6,2,2", "steps=30", "solver_settings.max_iterations=60"]
    result = reproduce(plan_figures(chosen_figures(["5"]), settings, folder), processes=1)
    assert result.page is not None
    return result.page


def test_a_figure_is_a_plot_with_the_numbers_of_its_runs(open_page: Open, figures: Path) -> None:
    page = open_page(figures, ready=["[data-figure='5']"])
    assert page.requests == [figures.resolve().as_uri()]  # the image is for those without scripts
    assert (figures.parent / "figure-5.png").exists()
    lines = page.page.eval_on_selector("[data-figure='5']", TRACES)
    panels = [line for line in lines if line[0] == "iterations"]
    assert len(panels) == 3 * 4
    run = Run(figures.parent / "runs" / "bar-BDF1-QLB")
    counts = run.iterations_per_step()
    assert panels[4 + 2][1:3] == [counts.steps.tolist(), counts.iterations.tolist()]
    failing = Run(figures.parent / "runs" / "bar-quasistatic-QLF")
    assert len(failing.summary["failed_steps"]) > 20
    crosses = [line for line in lines if line[0] == "did not converge"]
    assert failing.summary["failed_steps"] in [x for _, x, _, _ in crosses]
    assert page.page.locator("[data-figure='5'] .annotation").count() >= 4 + 12
    assert page.page.evaluate("document.documentElement.scrollWidth") <= 800
