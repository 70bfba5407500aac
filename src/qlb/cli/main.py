"""`qlb`: the commands and their options."""

from __future__ import annotations

import sys
from collections.abc import Mapping
from pathlib import Path
from typing import TYPE_CHECKING, Annotated

import typer

from qlb.cli.notes import show_notes
from qlb.cli.output import console, errors, print_comparison, print_outcome, print_scenes
from qlb.cli.progress import Interrupt, StepReporter
from qlb.errors import InputError, QlbError
from qlb.integrators import INTEGRATORS
from qlb.scenes import SCENES, load_scene, scene_yaml
from qlb.solvers import SOLVERS

if TYPE_CHECKING:
    from qlb.studies.run import Outcome

CONVERGED, NOT_CONVERGED, WRONG_INPUT, INTERRUPTED = 0, 1, 2, 130


def _show_version(wanted: bool) -> None:
    if wanted:
        import qlb

        console.print(f"qlb {qlb.__version__}", highlight=False)
        raise typer.Exit


app = typer.Typer(
    name="qlb",
    help="Integrate hyperelastic solids through time. Exit status: 0 all steps converged, 1 a step did not,"
    " 2 the input was wrong, 130 interrupted.",
    no_args_is_help=True,
    add_completion=False,
    pretty_exceptions_enable=False,
    context_settings={"help_option_names": ["-h", "--help"]},
    epilog="Start with `qlb run bar`; `qlb scenes` lists the other scenes, `qlb run --help` the options.",
)


@app.callback()
def _qlb(
    version: Annotated[
        bool, typer.Option("--version", callback=_show_version, is_eager=True, help="Print the version and exit")
    ] = False,
) -> None: ...


SceneArgument = Annotated[str, typer.Argument(help="A built-in scene (see `qlb scenes`) or a scene file (YAML, TOML)")]
SetOption = Annotated[
    list[str], typer.Option("--set", "-s", metavar="KEY=VALUE", help="Change a scene key; may be repeated")
]
StepsOption = Annotated[int | None, typer.Option(help="Number of time steps")]
IntegratorOption = Annotated[str | None, typer.Option(help=" | ".join(INTEGRATORS))]
SolverOption = Annotated[str | None, typer.Option(help=" | ".join(SOLVERS))]
ThreadsOption = Annotated[int | None, typer.Option(help="Threads; all that the process may use by default")]
EXPORT_FORMATS = ("vtkhdf", "vtu", "usd", "glb", "obj", "ply", "mp4", "gif")
OutOption = Annotated[Path | None, typer.Option(help="Where to write; by default the next free runs/NAME-001")]
CompareOutOption = Annotated[Path | None, typer.Option(help="Where; by default the next free runs/NAME-compare-001")]
SweepOutOption = Annotated[Path | None, typer.Option(help="Where to write, or to go on; by default runs/NAME-sweep")]
OverwriteOption = Annotated[bool, typer.Option("--overwrite", help="Replace an earlier run in the output folder")]
PictureOption = Annotated[bool, typer.Option(help="Render the picture of chosen frames")]
LiveOption = Annotated[bool, typer.Option("--live", help="Show the run in a browser as it goes; prints where")]
RunArgument = Annotated[Path, typer.Argument(help="A run directory")]
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
    picture: PictureOption = True,
    live: LiveOption = False,
) -> None:
    """Run a scene; leave frames, statistics, a plot, a picture and a report."""
    from qlb.cli.live import shown_live
    from qlb.studies import run_scene

    changes = {"steps": steps, "solver": solver, "integrator": integrator, "threads": threads}
    settings = load_scene(scene, [*set_, *_overrides(changes)])
    directory = out or _free_directory(scene)
    with shown_live(live) as on_start:
        with Interrupt() as interrupt, StepReporter("", settings.steps, verbose=verbose) as reporter:
            outcome = run_scene(
                settings, directory, overwrite=overwrite, on_start=on_start, on_step=reporter, stop=interrupt
            )
        status = _finish(outcome, picture=picture)
    raise typer.Exit(status)


@app.command()
def resume(
    directory: Annotated[Path, typer.Argument(help="A run directory, of a run that was broken off or is to go on")],
    steps: Annotated[int | None, typer.Option(help="Steps in all; by default as many as the scene says")] = None,
    verbose: VerboseOption = False,
    picture: PictureOption = True,
    live: LiveOption = False,
) -> None:
    """Go on from the last finished step of a run, to the same bits as if it had never been broken off."""
    from qlb.cli.live import shown_live
    from qlb.studies import resume_run, scene_of

    settings = scene_of(directory, steps)
    with shown_live(live) as on_start:
        with Interrupt() as interrupt, StepReporter("", settings.steps, verbose=verbose) as reporter:
            outcome = resume_run(directory, steps=steps, on_start=on_start, on_step=reporter, stop=interrupt)
        status = _finish(outcome, picture=picture)
    raise typer.Exit(status)


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
    out: CompareOutOption = None,
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
    edge: Annotated[float | None, typer.Option(help="Length of edges to aim at, in m, after scaling")] = None,
    tets: Annotated[int | None, typer.Option(help="Or: about how many tets; 5000 by default")] = None,
    scale: Annotated[float | None, typer.Option(help="Multiply all lengths")] = None,
    height: Annotated[float | None, typer.Option(help="Or: scale to this height along y, in m")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace OUT")] = False,
) -> None:
    """Look at a mesh, fill a surface with tets, or write tets in another format."""
    from qlb.cli.mesh import mesh_file

    mesh_file(source, target, edge=edge, tets=tets, scale=scale, height=height, overwrite=overwrite)


@app.command()
def sweep(
    scene: SceneArgument,
    set_: Annotated[
        list[str],
        typer.Option("--set", "-s", metavar="KEY=VALUE,...", help="Values of a key; [1,2] in brackets is one"),
    ] = [],  # noqa: B006
    steps: StepsOption = None,
    out: SweepOutOption = None,
    processes: Annotated[int | None, typer.Option(help="Runs at a time; by default one for each CPU")] = None,
    scheduler: Annotated[str | None, typer.Option(help="Address of a dask scheduler whose workers run them")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Run everything in the output folder again")] = False,
) -> None:
    """Run a scene with every combination of values; leave one table. The same call again goes on."""
    from qlb.cli.sweep import run_sweep

    directory = out or Path("runs") / f"{Path(scene).stem}-sweep"
    changes = _overrides({"steps": steps})
    raise typer.Exit(run_sweep(scene, set_, changes, directory, processes, scheduler, overwrite=overwrite))


@app.command()
def scenes(
    show: Annotated[str | None, typer.Option(help="Print this scene as a file to start from")] = None,
) -> None:
    """List the built-in scenes, or print one as a scene file."""
    if show is None:
        print_scenes(SCENES)
        return
    if show not in SCENES:
        raise InputError(f"scene {show!r} is not known; built-in scenes: {', '.join(SCENES)}")
    sys.stdout.write(scene_yaml(load_scene(show)))


@app.command()
def schema() -> None:
    """Print the JSON Schema of scene files, for editors."""
    import json

    from qlb.scenes.schema import scene_schema

    sys.stdout.write(json.dumps(scene_schema(), indent=1) + "\n")


@app.command()
def report(
    directory: RunArgument,
    megabytes: Annotated[
        float, typer.Option(help="Size of the page at most, about; frames and vertices are thinned out", min=3.0)
    ] = 15.0,
) -> None:
    """Write plots, picture and report of a run again."""
    from qlb.results import Run, finish_run

    summary = Run(directory).summary
    print_outcome(summary, finish_run(directory, most_bytes=int(1e6 * megabytes)))


@app.command()
def view(
    directory: RunArgument,
    open_: Annotated[bool, typer.Option("--open/--no-open", help="Open the page in a browser")] = True,
) -> None:
    """Open the report of a run, made again where it is older than the run, and print where it lies."""
    from qlb.cli.view import view

    view(directory, show=open_)


@app.command()
def export(
    directory: Annotated[Path, typer.Argument(help="A run directory")],
    format_: Annotated[str | None, typer.Option("--format", help=" | ".join(EXPORT_FORMATS))] = None,
    out: Annotated[Path | None, typer.Option(help="A file or a folder; DIRECTORY/exports by default")] = None,
    steps: Annotated[str, typer.Option(metavar="A:B:C", help="Every C-th frame of steps A to B; or one step")] = "",
    volume: Annotated[bool | None, typer.Option("--volume/--surface", help="vtkhdf, vtu: tets or surface")] = None,
    turntable: Annotated[bool | None, typer.Option("--turntable", help="mp4, gif: go around once")] = None,
    fps: Annotated[float | None, typer.Option(help="mp4, gif: images a second")] = None,
    size: Annotated[str | None, typer.Option(metavar="WxH", help="mp4, gif: pixels, such as 1280x720")] = None,
    overwrite: Annotated[bool, typer.Option("--overwrite", help="Replace an earlier export")] = False,
) -> None:
    """Write a run for ParaView, Blender, Houdini, browsers or as a video."""
    from qlb.cli.export import export_directory

    options = {"volume": volume, "turntable": turntable, "fps": fps, "size": size}
    export_directory(directory, out, format_, steps, overwrite=overwrite, options=options)


@app.command()
def doctor() -> None:
    """Versions, libraries, SIMD level and threads of this installation, and whether it works."""
    from qlb.cli.doctor import examine

    raise typer.Exit(examine())


def _finish(outcome: Outcome, *, picture: bool) -> int:
    """Write the report of a run and say how it ended; returns the exit status."""
    from qlb.results import finish_run

    with console.status("Writing the report") if console.is_terminal else _quiet():
        files = finish_run(outcome.directory, picture=picture)
    print_outcome(outcome.summary, files)
    return _status(outcome.summary)


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
