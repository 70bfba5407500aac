"""The same scene under several solvers."""

from __future__ import annotations

from collections.abc import Callable, Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np

from qlb.errors import InputError
from qlb.results import Run
from qlb.scenes import Scene, load_scene
from qlb.studies.run import Outcome, run_scene


@dataclass(frozen=True)
class SolverCase:
    """A solver, with settings of its own where it has some: "ND", "ND:projection=on-demand"."""

    label: str
    overrides: tuple[str, ...]

    @staticmethod
    def parse(text: str) -> SolverCase:
        """From NAME or NAME:KEY=VALUE:..., KEY one of the solver settings."""
        name, *settings = [part.strip() for part in text.split(":")]
        if not name or not all("=" in setting for setting in settings):
            raise InputError(f"solver {text!r} must have the form NAME or NAME:KEY=VALUE")
        return SolverCase(text.strip(), (f"solver={name}", *(f"solver_settings.{setting}" for setting in settings)))

    @property
    def folder(self) -> str:
        """Its name as a folder."""
        return self.label.replace(":", "-").replace("=", "-")


@dataclass(frozen=True)
class Comparison:
    """Runs of one scene under several solvers, in the order asked for."""

    outcomes: dict[str, Outcome]

    @property
    def runs(self) -> dict[str, Run]:
        """Each run by its label."""
        return {label: outcome.run for label, outcome in self.outcomes.items()}

    def rows(self) -> list[dict[str, Any]]:
        """One row a solver: iterations, factorisations, times and how far its final state is from the first's.

        The difference is the largest distance of any node [m] over the longest side of the body at rest.
        """
        first = next(iter(self.outcomes.values())).run
        extent = float(np.ptp(first.mesh.positions, axis=0).max())
        reference = first.frame(first.frame_steps[-1])
        rows = []
        for label, outcome in self.outcomes.items():
            run, s = outcome.run, outcome.summary
            last = run.frame(run.frame_steps[-1])
            same_time = last.step == reference.step
            distance = float(np.linalg.norm(last.positions - reference.positions, axis=1).max()) / extent
            rows.append(
                {
                    "solver": label,
                    "steps": s["steps"],
                    "failed": len(s["failed_steps"]),
                    "iterations_mean": s["iterations_mean"],
                    "iterations_max": s["iterations_max"],
                    "factorizations": s["factorizations"],
                    "wall_seconds": s["wall_seconds"],
                    "cpu_seconds": s["cpu_seconds"],
                    "difference": distance if same_time else None,
                }
            )
        return rows

    @property
    def converged(self) -> bool:
        """Whether every step of every run converged."""
        return all(outcome.summary["converged"] for outcome in self.outcomes.values())


def compare(
    scene: str,
    overrides: Sequence[str],
    cases: Sequence[SolverCase],
    directory: Path,
    *,
    overwrite: bool = False,
    watch: Callable[[SolverCase, Scene], dict[str, Any]] = lambda case, scene: {},
) -> Comparison:
    """Run `scene` under each case into a folder of its own below `directory`.

    A step that fails is accepted and marked unless the overrides say otherwise, so that every curve is whole.
    `watch` gives further keyword arguments of `run_scene` for each case, such as its listeners.

    Raises:
        InputError: a case named twice, or anything that `load_scene` and `run_scene` refuse; before the first run.
    """
    labels = [case.label for case in cases]
    if len(set(labels)) != len(labels):
        raise InputError(f"solvers {', '.join(labels)}: each must be named once")
    scenes = [load_scene(scene, ["on_failure=accept", *overrides, *case.overrides]) for case in cases]
    return Comparison(dict(_run_all(cases, scenes, directory, overwrite, watch)))


def _run_all(
    cases: Sequence[SolverCase],
    scenes: Sequence[Scene],
    directory: Path,
    overwrite: bool,
    watch: Callable[[SolverCase, Scene], dict[str, Any]],
) -> Iterator[tuple[str, Outcome]]:
    for case, scene in zip(cases, scenes, strict=True):
        outcome = run_scene(scene, directory / case.folder, overwrite=overwrite, **watch(case, scene))
        yield case.label, outcome
        if outcome.summary["status"] == "interrupted":
            return
