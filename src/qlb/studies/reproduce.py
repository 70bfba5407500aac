"""The supplement's figures, redrawn: their runs in parallel, then plots, tables and one page."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from qlb import results
from qlb.errors import InputError
from qlb.results import Run
from qlb.results.figure import FORMATS, PAGE, FigureGrid
from qlb.scenes import load_scene
from qlb.studies.folder import RUNS, StudyKind, claim_folder, is_complete, run_of
from qlb.studies.processes import Case, Update, run_cases
from qlb.studies.reproduce_figures import COLUMNS, FIGURES, Row, SupplementFigure
from qlb.studies.statements import measure

_PRODUCTS = [f"figure-{number}.{suffix}" for number in FIGURES for suffix in (*FORMATS, "csv")]
_KIND = StudyKind("qlb reproduce", "reproduce.json", [*_PRODUCTS, PAGE])
_FIXED = ("on_failure=accept", "threads=1", "output.stride=10")
_OURS = ("solver", "on_failure", "threads")
_WEIGHTS = {"QLF": 20.0, "ND": 3.0}
"""Work of a step, roughly, where that of QLB is 1."""

_NOTES = (
    "The counts are nonlinear iterations a time step, of all its stages. ND, QLF and QLB are our reading of the"
    " supplement, which names the solvers without defining them; a step that does not converge is accepted as it is,"
    " so that each curve is whole, marked in the plot and counted in the table.",
)
_REFERENCE_NOTE = "An independent prototype: other code for the same bar, settings and tolerance, written before this."


@dataclass(frozen=True)
class Plan:
    """The runs that figures need, each once however many figures show it."""

    directory: Path
    figures: Sequence[SupplementFigure]
    bases: dict[str, dict[str, Any]]
    """by scene, its settings before any row changes them"""
    overrides: Sequence[str]
    """KEY=VALUE for all runs"""
    panels: dict[tuple[int, str, str], Case]
    """by number of the figure, label of the row, and solver"""

    @property
    def cases(self) -> list[Case]:
        """Every case once, in the order of the figures."""
        return list({case.name: case for case in self.panels.values()}.values())

    def cases_of(self, figure: SupplementFigure) -> list[Case]:
        """The cases of one figure."""
        return [case for (number, _, _), case in self.panels.items() if number == figure.number]


@dataclass(frozen=True)
class Reproduction:
    """What `reproduce` left."""

    directory: Path
    grids: list[FigureGrid]
    """the figures drawn; none where it was interrupted"""
    problems: dict[str, str]
    """why a case is missing or not whole, by its name"""
    interrupted: bool = False
    page: Path | None = None


def plan_figures(figures: Sequence[SupplementFigure], overrides: Sequence[str], directory: Path) -> Plan:
    """The runs that `figures` need.

    Args:
        figures: see `chosen_figures`.
        overrides: KEY=VALUE for all runs; what a row varies wins.
        directory: where they will be.

    Raises:
        InputError: an override that a scene refuses, or of what the figures set.
    """
    for override in overrides:
        key = override.partition("=")[0].strip()
        if key in _OURS:
            raise InputError(f"--set {override!r}: {key} is set by the figures; leave it out")
    common = {figure.number: [*_FIXED, *figure.settings, *overrides] for figure in figures}
    bases = {figure.scene: _base(figure, common[figure.number]) for figure in figures}
    panels = {
        (figure.number, row.label, solver): _case(figure, row, solver, common[figure.number], directory)
        for figure in figures
        for row in figure.rows
        for solver in COLUMNS
    }
    return Plan(directory, figures, bases, overrides, panels)


def _base(figure: SupplementFigure, overrides: Sequence[str]) -> dict[str, Any]:
    """The settings of a figure's scene. Raises `InputError` for an override that it refuses, with the scene named."""
    try:
        return load_scene(figure.scene, overrides).model_dump(mode="json")
    except InputError as error:
        raise InputError(f"figure {figure.number}, scene {figure.scene}: {error}") from None


def _case(figure: SupplementFigure, row: Row, solver: str, common: Sequence[str], directory: Path) -> Case:
    """The run of a panel. Where its row changes nothing it is "default", so that figures share it."""
    plain, scene = (
        load_scene(figure.scene, [*common, *changes, f"solver={solver}"]).model_dump(mode="json")
        for changes in ((), row.overrides)
    )
    name = f"{figure.scene}-{'default' if scene == plain else row.name}-{solver}"
    return Case(name, scene, directory / RUNS / name, _WEIGHTS.get(solver, 1.0))


def reproduce(
    plan: Plan,
    *,
    processes: int,
    overwrite: bool = False,
    on_update: Callable[[Update], None] = lambda update: None,
    stop: Callable[[], bool] = lambda: False,
) -> Reproduction:
    """Run what is not there yet, and draw the figures: figure-N.png, .svg, .pdf, .csv and index.html.

    Complete runs of the same settings in the folder are taken as they are, so that the same call goes on where an
    earlier one was stopped. Other figures whose runs are all there stay on the page.

    Args:
        plan: from `plan_figures`.
        processes: how many runs at a time, each on one thread.
        overwrite: run everything again, also where the folder holds figures of other settings.
        on_update: called when a case is found complete, takes a step, or ends.
        stop: asked all the time whether to end early.

    Raises:
        InputError: processes < 1; the folder cannot be used.
        WriteError: a file could not be written.
    """
    if processes < 1:
        raise InputError(f"processes = {processes} is out of range: must be >= 1")
    claim_folder(_KIND, plan.directory, plan.bases, [case.directory for case in plan.cases], overwrite=overwrite)
    kept = [] if overwrite else [case for case in plan.cases if is_complete(case)]
    for case in kept:
        on_update(Update(case, "kept", case.steps))
    missing = [case for case in plan.cases if case not in kept]
    problems = run_cases(missing, processes=processes, on_update=on_update, stop=stop)
    if any(not is_complete(case) and case.name not in problems for case in missing):
        return Reproduction(plan.directory, [], problems, interrupted=True)
    grids = list(_grids(plan))
    for grid in grids:
        results.write_figure(grid, plan.directory)
    notes = _NOTES if plan.overrides else (*_NOTES, _REFERENCE_NOTE)
    page = results.write_figures_page(grids, plan.directory, problems, notes)
    return Reproduction(plan.directory, grids, problems, page=page)


def _grids(plan: Plan) -> Iterator[FigureGrid]:
    """The figures asked for, and others of the supplement whose runs are all there."""
    everything = _with_others(plan)
    runs = {case.name: run_of(case) for case in everything.cases}
    for figure in everything.figures:
        if figure in plan.figures or all(is_complete(case) for case in everything.cases_of(figure)):
            yield _grid(figure, everything, runs)


def _with_others(plan: Plan) -> Plan:
    """The plan for all figures whose scenes take the same settings."""
    figures, panels = list(plan.figures), dict(plan.panels)
    for figure in FIGURES.values():
        if figure not in plan.figures:
            with suppress(InputError):
                panels |= plan_figures([figure], plan.overrides, plan.directory).panels
                figures.append(figure)
    figures.sort(key=lambda figure: figure.number)
    return Plan(plan.directory, figures, plan.bases, plan.overrides, panels)


def _grid(figure: SupplementFigure, plan: Plan, runs: dict[str, Run | None]) -> FigureGrid:
    solvers = list(COLUMNS)
    found = {
        row.label: {s: run for s in solvers if (run := runs[plan.panels[figure.number, row.label, s].name])}
        for row in figure.rows
    }
    reference = {row.label: {s: str(counts) for s, counts in row.prototype.items()} for row in figure.rows}
    return FigureGrid(
        figure.number,
        figure.title,
        figure.parameter,
        solvers,
        found,
        figure.expectation,
        {} if plan.overrides else reference,
        [statement.against(measure(found)) for statement in figure.statements],
    )
