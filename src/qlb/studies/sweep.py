"""Every combination of lists of values: its runs in parallel, and one row of a table for each."""

from __future__ import annotations

import csv
import io
import re
from collections.abc import Callable, Iterable, Sequence
from dataclasses import dataclass
from hashlib import sha256
from itertools import product
from pathlib import Path
from typing import Any

from qlb import results
from qlb.errors import InputError
from qlb.results import Run, layout
from qlb.results.files import write_text
from qlb.results.wording import flatten
from qlb.scenes import Scene, load_scene
from qlb.scenes.overrides import split_values
from qlb.studies.cluster import run_on_cluster
from qlb.studies.folder import RUNS, StudyKind, claim_folder, run_of
from qlb.studies.processes import Case, Update, run_cases

TABLE = "sweep.csv"
COUNTS = (
    "steps",
    "converged",
    "iterations_mean",
    "iterations_max",
    "factorizations",
    "minimum_distance",
    "time",
    "nodes",
    "tets",
)
"""Columns that are the same wherever a case runs; keys of its summary."""
TIMINGS = ("wall_seconds", "cpu_seconds")
"""Columns that are not."""

_KIND = StudyKind("qlb sweep", "sweep.json", [TABLE, layout.REPORT])
_FIXED = ("threads=1",)

Row = dict[str, Any]
"""A row of the table: case, the keys that are set, status, error, `COUNTS`, failed_steps, `TIMINGS`."""


@dataclass(frozen=True)
class SweepCase:
    """One combination of values."""

    name: str
    """of its folder, such as young-6e3_step-5e-3"""
    values: dict[str, str]
    """by key, as they were written"""
    case: Case | None
    """what to run; None where the scene refuses the values"""
    error: str = ""
    """why it does"""


@dataclass(frozen=True)
class SweepPlan:
    """The cases of a sweep."""

    directory: Path
    bases: dict[str, dict[str, Any]]
    """by scene, the settings that all cases share"""
    members: Sequence[SweepCase]

    @property
    def cases(self) -> list[Case]:
        """What can be run."""
        return [member.case for member in self.members if member.case is not None]


@dataclass(frozen=True)
class Sweep:
    """What `sweep` left."""

    directory: Path
    rows: list[Row]
    """one for each case, in the order of the product; none where it was interrupted"""
    interrupted: bool = False

    @property
    def table(self) -> Path:
        """The CSV file."""
        return self.directory / TABLE

    @property
    def page(self) -> Path:
        """The report page."""
        return self.directory / layout.REPORT

    @property
    def converged(self) -> bool:
        """Whether every step of every case converged."""
        return all(row["status"] == "complete" and row["converged"] == "true" for row in self.rows)


def plan_sweep(scene: str, lists: Sequence[str], directory: Path, overrides: Sequence[str] = ()) -> SweepPlan:
    """The product of lists of values.

    Args:
        scene: a built-in scene or a scene file.
        lists: each KEY=VALUE,VALUE,...; a value that is itself a list stands in brackets: mesh.cells=[8,2,2],[16,4,4].
        directory: where they will be.
        overrides: KEY=VALUE for all cases.

    Raises:
        InputError: no such scene, a key that it does not have or that is given twice, a key without a value; values
            that are refused in every case.
    """
    values = dict(_parsed(text) for text in lists)
    if len(values) < len(lists):
        raise InputError("a key is given more than once: put all its values into one --set")
    common = [*_FIXED, *overrides]
    _check_lists(scene, common, values)
    names: dict[str, int] = {}
    members = []
    for combination in product(*values.values()):
        chosen = dict(zip(values, combination, strict=True))
        name = _name(chosen)
        names[name] = names.get(name, 0) + 1
        members.append(_member(scene, common, chosen, name if names[name] == 1 else f"{name}_{names[name]}", directory))
    if all(member.case is None for member in members):
        raise InputError(members[0].error)
    shared = next(case for member in members if (case := member.case)).scene
    bases = {str(shared["scene"]): _without(shared, values)}
    return SweepPlan(directory, bases, members)


def sweep(
    plan: SweepPlan,
    *,
    processes: int,
    scheduler: str | None = None,
    overwrite: bool = False,
    on_update: Callable[[Update], None] = lambda update: None,
    stop: Callable[[], bool] = lambda: False,
) -> Sweep:
    """Run the cases that are not there yet, and write sweep.csv and report.html.

    A case whose run lies there with the same settings, from start to end or to a step that failed, is taken as it is.
    One that fails is a row that says so, and the others go on.

    Args:
        plan: from `plan_sweep`.
        processes: how many runs at a time on this machine.
        scheduler: address of a dask.distributed scheduler, such as tcp://host:8786, whose workers run the cases
            instead; they and this machine share the folder.
        overwrite: run everything again, also where the folder holds a sweep of other settings.
        on_update: called when a case is found done, takes a step, or ends.
        stop: asked all the time whether to end early.

    Raises:
        InputError: processes < 1; the folder cannot be used; the scheduler cannot be reached.
        MissingExtra: a scheduler is given, and dask.distributed is not installed.
        WriteError: a file could not be written.
    """
    if processes < 1:
        raise InputError(f"processes = {processes} is out of range: must be >= 1")
    claim_folder(_KIND, plan.directory, plan.bases, [case.directory for case in plan.cases], overwrite=overwrite)
    kept = [] if overwrite else [case for case in plan.cases if _is_done(case)]
    for case in kept:
        on_update(Update(case, "kept", case.steps))
    ends: dict[str, Update] = {}

    def watch(update: Update) -> None:
        if update.state != "step":
            ends[update.case.name] = update
        on_update(update)

    missing = [case for case in plan.cases if case not in kept]
    if scheduler is None:
        run_cases(missing, processes=processes, on_update=watch, stop=stop)
    else:
        run_on_cluster(missing, scheduler=scheduler, on_update=watch, stop=stop)
    if any(case.name not in ends for case in missing):
        return Sweep(plan.directory, [], interrupted=True)
    result = Sweep(plan.directory, [_row(member, ends.get(member.name)) for member in plan.members])
    write_text(result.table, _table(result.rows))
    _write_page(plan, result)
    return result


def _write_page(plan: SweepPlan, result: Sweep) -> None:
    rows = {row["case"]: row for row in result.rows}
    runs = {case.name: run for case in plan.cases if rows[case.name]["steps"] != "" and (run := run_of(case))}
    (settings,) = plan.bases.values()
    keys = list(plan.members[0].values)
    results.write_sweep_page(result.rows, keys, runs, plan.directory, flatten(settings))


def _parsed(text: str) -> tuple[str, list[str]]:
    """A key and its values."""
    key, separator, values = text.partition("=")
    parts = [part.strip() for part in split_values(values)]
    if not separator or not key.strip() or not all(parts):
        raise InputError(f"--set {text!r} must have the form KEY=VALUE,VALUE,...")
    return key.strip(), parts


def _check_lists(scene: str, common: Sequence[str], values: dict[str, list[str]]) -> None:
    """Raise `InputError` for a key that the scene lacks, and for a list without its brackets."""
    load_scene(scene, common)
    for key, parts in values.items():
        refused = [error for part in parts if (error := _refusal(scene, [*common, f"{key}={part}"]))]
        if refused and "unknown key" in refused[0]:
            raise InputError(refused[0])
        if len(refused) == len(parts) > 1 and not _refusal(scene, [*common, f"{key}={','.join(parts)}"]):
            whole = ",".join(parts)
            raise InputError(f"--set {key}={whole}: a value that is a list stands in brackets, as in {key}=[{whole}]")


def _refusal(scene: str, overrides: Sequence[str]) -> str:
    """Why a scene refuses settings, or nothing."""
    try:
        load_scene(scene, overrides)
    except InputError as error:
        return str(error)
    return ""


def _member(scene: str, common: Sequence[str], chosen: dict[str, str], name: str, directory: Path) -> SweepCase:
    try:
        built: Scene = load_scene(scene, [*common, *(f"{key}={value}" for key, value in chosen.items())])
        plain = built.model_dump(mode="json")
    except InputError as error:
        return SweepCase(name, chosen, None, str(error))
    return SweepCase(name, chosen, Case(name, plain, (directory / RUNS / name).resolve()))


def _name(chosen: dict[str, str]) -> str:
    """For the folder of a case: the last parts of its keys with their values, as far as they fit."""
    text = "_".join(f"{key.rpartition('.')[2]}-{value}" for key, value in chosen.items())
    text = re.sub(r"\[([^][]*)\]", lambda values: values[1].replace(",", "x"), text)
    plain = re.sub(r"[^A-Za-z0-9_.+-]+", "-", text).strip("-.") or "case"
    return plain if plain == text and len(plain) <= 100 else f"{plain[:90]}-{sha256(text.encode()).hexdigest()[:8]}"


def _without(scene: dict[str, Any], keys: Iterable[str]) -> dict[str, Any]:
    """The settings but for those that a sweep changes, whole groups where their kind may change."""
    left: dict[str, Any] = {name: dict(value) if isinstance(value, dict) else value for name, value in scene.items()}
    for key in keys:
        group, _, name = key.partition(".")
        if name and "." not in name and isinstance(left.get(group), dict) and name != "model":
            left[group].pop(name, None)
        else:
            left.pop(group, None)
    return left


def _is_done(case: Case) -> bool:
    """Whether its run ended by itself: it is complete, or a step failed for good."""
    run = run_of(case)
    return run is not None and (run.summary["status"] == "complete" or bool(run.summary["failed_steps"]))


def _row(member: SweepCase, end: Update | None) -> Row:
    """The row of a case that is done, was refused, or ended as `end` says."""
    row: Row = {"case": member.name, **member.values}
    blank = dict.fromkeys((*COUNTS, "failed_steps", *TIMINGS), "")
    if member.case is None:
        return row | {"status": "refused", "error": member.error} | blank
    state = "kept" if end is None else end.state
    run = None if state == "refused" else run_of(member.case)
    if run is not None and (state != "crashed" or run.summary["status"] == "failed"):
        return row | {"status": run.summary["status"], "error": run.summary["error"] or ""} | _numbers(run)
    error = (end and end.message) or "it ended well, but its folder is not to be seen from here"
    return row | {"status": "refused" if state == "refused" else "crashed", "error": error} | blank


def _numbers(run: Run) -> Row:
    summary = run.summary
    counts = {name: "" if summary[name] is None else summary[name] for name in COUNTS}
    counts["converged"] = str(summary["converged"]).lower()
    return counts | {"failed_steps": len(summary["failed_steps"])} | {name: summary[name] for name in TIMINGS}


def _table(rows: Sequence[Row]) -> str:
    text = io.StringIO()
    writer = csv.DictWriter(text, list(rows[0]), lineterminator="\n")
    writer.writeheader()
    writer.writerows(rows)
    return text.getvalue()
