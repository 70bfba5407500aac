"""`qlb`: the commands and their options."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import Annotated

import typer

from qlb.cli.notes import show_notes
from qlb.cli.output import console, errors, print_comparison, print_outcome
from qlb.cli.progress import Interrupt, StepReporter
from qlb.errors import InputError, QlbError
from qlb.integrators import INTEGRATORS
from qlb.scenes import SCENES, load_scene, scene_yaml
from qlb.solvers import SOLVERS

CONVERGED, NOT_CONVERGED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130

app = typer.Typer(
    name="qlb",
    help="Integrate hyperelastic solids through time. Exit status: 0 all steps converged, 1 a step did not,"
    " 2 the input was wrong, 130 interrupted.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
)

SceneArgument = Annotated[str, typer.Argument(help="A built-in scene (see `qlb scenes`) or a scene file")]
SetOption = Annotated[
    list[str], typer.Option("--set", "-s", metavar="KEY=VALUE", help="Change a scene key; may be repeated")
]
StepsOption = Annotated[int | None, typer.Option(help="Number of time steps")]
IntegratorOption = Annotated[str | None, typer.Option(help=" | ".join(INTEGRATORS))]
SolverOption = Annotated[str | None, typer.Option(help=" | ".join(SOLVERS))]
ThreadsOption = Annotated[int | None, typer.Option(help="Threads; all that the process may use by default")]
OutOption = Annotated[Path | None, typer.Option(help="Where to write; by default the next free runs/NAME-001")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace an earlier run in the output folder")]
VerboseOption = Annotated[bool, typer.Option("--verbose", "-v", help="One line per step")]


@app.command()
def run(
    scene: SceneArgument,
    set_: SetOption = [],  # noqa: B006  (typer copies it)
    steps: StepsOption = None,
    solver: SolverOption = None,
    integrator: IntegratorOption = None,
    threads: ThreadsOption = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    verbose: VerboseOption = False,
    picture: Annotated[bool, typer.Option(help="Render the picture of chosen frames")] = True,
) -> None:
    """Run a scene; leave frames, statistics, a plot, a picture and a report."""
    from qlb.results import finish_run
    from qlb.studies import run_scene

    changes = {"steps": steps, "solver": solver, "integrator": integrator, "threads": threads}
    settings = load_scene(scene, [*set_, *_overrides(changes)])
    directory = out or _free_directory(scene)
    with Interrupt() as interrupt, StepReporter("", settings.steps, verbose=verbose) as reporter:
        outcome = run_scene(settings, directory, overwrite=overwrite, on_step=reporter, stop=interrupt)
    with console.status("Writing the report") if console.is_terminal else _quiet():
        files = finish_run(directory, picture=picture)
    print_outcome(outcome.summary, files)
    raise typer.Exit(_status(outcome.summary))


@app.command()
def compare(
    scene: SceneArgument,
    solvers: Annotated[
        str,
        typer.Option(help="Separated by commas, each NAME or NAME:KEY=VALUE, such as ND:projection=on-demand"),
    ] = ",".join(SOLVERS),
    set_: SetOption = [],  # noqa: B006
    steps: StepsOption = None,
    integrator: IntegratorOption = None,
    threads: ThreadsOption = None,
    out: OutOption = None,
    overwrite: OverwriteOption = False,
    verbose: VerboseOption = False,
) -> None:
    """Run a scene under several solvers; leave one table and one plot."""
    from qlb.results import finish_run, write_comparison
    from qlb.studies import SolverCase
    from qlb.studies import compare as run_comparison

    cases = [SolverCase.parse(text) for text in solvers.split(",")]
    changes = {"steps": steps, "integrator": integrator, "threads": threads}
    directory = out or _free_directory(f"{Path(scene).stem}-compare")
    reporters: list[StepReporter] = []
    with Interrupt() as interrupt:

        def watch(case: SolverCase, settings: object) -> dict[str, object]:
            for finished in reporters:
                finished.close()
            reporters.append(StepReporter(case.label, getattr(settings, "steps"), verbose=verbose))  # noqa: B009
            return {"on_step": reporters[-1], "stop": interrupt}

        try:
            overrides = [*set_, *_overrides(changes)]
            result = run_comparison(scene, overrides, cases, directory, overwrite=overwrite, watch=watch)
        finally:
            for reporter in reporters:
                reporter.close()
    for label in result.outcomes:
        finish_run(result.outcomes[label].directory, picture=False)
    rows = result.rows()
    print_comparison(rows, write_comparison(result.runs, rows, directory))
    statuses = [_status(outcome.summary) for outcome in result.outcomes.values()]
    raise typer.Exit(max(statuses))


@app.command()
def reproduce(
    figures: Annotated[list[str] | None, typer.Argument(metavar="[FIGURE]...", help="Numbers; by default all")] = None,
    set_: SetOption = [],  # noqa: B006
    steps: StepsOption = None,
    out: Annotated[Path, typer.Option(help="Where to write, or to go on")] = Path("runs/reproduce"),
    processes: Annotated[int | None, typer.Option(help="Runs at a time; by default one for each CPU")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Run everything in the output folder again")] = False,
) -> None:
    """Redraw figures of the paper's supplement: plots, their data and one page. The same call again goes on."""
    from qlb.cli.reproduce import reproduce_figures

    overrides = [*set_, *_overrides({"steps": steps})]
    raise typer.Exit(reproduce_figures(figures or [], overrides, out, processes, overwrite=overwrite))


@app.command()
def mesh(
    source: Annotated[Path, typer.Argument(metavar="IN", help="A file of tets, or of a surface to fill with them")],
    target: Annotated[
        Path | None, typer.Argument(metavar="[OUT]", help="Where to write tets; the suffix says how")
    ] = None,
    edge: Annotated[float | None, typer.Option(help="Target edge length [m], after scaling")] = None,
    tets: Annotated[int | None, typer.Option(help="Or: about how many tets [default: 5000]")] = None,
    scale: Annotated[float | None, typer.Option(help="Multiply all lengths")] = None,
    height: Annotated[float | None, typer.Option(help="Or: scale to this height along y [m]")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT")] = False,
) -> None:
    """Look at a mesh, fill a surface with tets, or write tets in another format."""
    from qlb.cli.mesh import mesh_file

    mesh_file(source, target, edge=edge, tets=tets, scale=scale, height=height, overwrite=overwrite)


@app.command()
def scenes(
    show: Annotated[str | None, typer.Option(help="Print this scene as a file to start from")] = None,
) -> None:
    """List the built-in scenes, or print one as a scene file."""
    if show is None:
        for name, kind in SCENES.items():
            console.print(f"[bold]{name}[/]  {(kind.__doc__ or '').splitlines()[0]}")
        return
    if show not in SCENES:
        raise InputError(f"scene {show!r} is not known; built-in scenes: {', '.join(SCENES)}")
    sys.stdout.write(scene_yaml(load_scene(show)))


@app.command()
def report(directory: Annotated[Path, typer.Argument(help="A run directory")]) -> None:
    """Write plots, picture and report of a run again."""
    from qlb.results import Run, finish_run

    summary = Run(directory).summary
    print_outcome(summary, finish_run(directory))


@app.command()
def doctor() -> None:
    """Versions, libraries, SIMD level and threads of this installation, and whether it works."""
    from qlb.cli.doctor import examine

    raise typer.Exit(examine())


def _overrides(options: Mapping[str, object]) -> list[str]:
    return [f"{key}={value}" for key, value in options.items() if value is not None]


def _free_directory(scene: str) -> Path:
    name = Path(scene).stem
    return next(path for i in range(1, 10**6) if not (path := Path("runs") / f"{name}-{i:03d}").exists())


def _status(summary: dict[str, object]) -> int:
    if summary["status"] == "interrupted":
        return INTERRUPTED
    return CONVERGED if summary["converged"] else NOT_CONVERGED


class _quiet:  # noqa: N801
    def __enter__(self) -> None: ...
    def __exit__(self, *error: object) -> None: ...


def main() -> None:
    """Entry point of the `qlb` command."""
    try:
        with show_notes():
            app()
    except InputError as error:
        errors.print(f"[bold red]error:[/] {_escaped(error)}", soft_wrap=True)
        sys.exit(WRONG_INPUT)
    except QlbError as error:
        errors.print(f"[bold red]error:[/] {_escaped(error)}", soft_wrap=True)
        sys.exit(NOT_CONVERGED)


def _escaped(error: Exception) -> str:
    from rich.markup import escape

    return escape(str(error))
