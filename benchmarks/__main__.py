"""`python -m benchmarks [NAME ...]`, the names below: prints Markdown tables."""

from __future__ import annotations

import argparse
import os
import sys
from collections.abc import Callable
from pathlib import Path

from benchmarks import armadillo, contact, kernels, step, variations, writing
from benchmarks.rivals import runner

ARMADILLO = Path("armadillo13K.msh")
NAMES = ("kernels", "factor", "step", "ablation", "variations", "armadillo", "contact", "writing", "rivals")


def main() -> None:
    """Parse the command line and print what it asks for."""
    options = _parser().parse_args()
    sizes = [int(size) for size in options.sizes.split(",")]
    threads = sorted({1, options.threads})
    solvers = options.solvers.split(",") if options.solvers else []
    runs = {"steps": options.steps or 40, "threads": options.threads, "repeats": options.repeats}
    rivals = runner.Settings(python=options.python, integrator=options.integrator, **runs)
    of_scenes = contact.Amount(options.tets, options.steps, options.mesh, options.repeats, options.limit)
    tables: dict[str, Callable[[], str]] = {
        "kernels": lambda: kernels.element_table(threads),
        "factor": lambda: kernels.factor_table(threads, [step.CELLS[size] for size in sizes]),
        "step": lambda: step.table(sizes, solvers or step.CASES, variant=options.variant, **runs),
        "ablation": lambda: step.table(sizes, step.ABLATION, variant=options.variant, **runs),
        "variations": lambda: variations.table(**runs),
        "armadillo": lambda: armadillo.table(options.mesh or ARMADILLO, solvers or step.CASES, **runs),
        "contact": lambda: contact.table(options.scenes.split(","), solvers or contact.CASES, of_scenes),
        "writing": lambda: writing.table(sizes, **runs),
        "rivals": lambda: runner.table(sizes, [name for name in options.only.split(",") if name], rivals),
    }
    for name in options.which or ["kernels", "factor", "step"]:
        print(tables[name](), end="\n\n", flush=True)


def _parser() -> argparse.ArgumentParser:
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Benchmarks of qlb, as Markdown tables")
    parser.add_argument("which", nargs="*", choices=NAMES, help="default: kernels, factor, step")
    parser.add_argument("--sizes", default="1536,5184,12288", help=f"tets, out of {list(step.CELLS)}")
    parser.add_argument("--solvers", default="", help="NAME:KEY=VALUE, ... for step, armadillo, contact")
    parser.add_argument("--variant", default="drop", choices=["drop", "twist"])
    parser.add_argument("--mesh", type=Path, help=f"file of armadillo ({ARMADILLO}) or bunny (a shape)")
    parser.add_argument("--steps", type=int, help="default: 40; with contact, what the scene asks for")
    parser.add_argument("--scenes", default=",".join(contact.SCENES), help="contact: which scenes")
    parser.add_argument("--tets", type=int, help="contact: about how many in each scene")
    parser.add_argument(
        "--limit", type=float, default=float("inf"), help="contact: CPU seconds after which a run stops"
    )
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--only", default="", help="rivals: names of packages; default: all that are installed")
    parser.add_argument("--integrator", default="BDF1", choices=["BDF1", "BDF2"], help="rivals")
    parser.add_argument(
        "--python",
        default=os.environ.get("QLB_RIVALS_PYTHON", sys.executable),
        help="rivals: the interpreter that has them; default: $QLB_RIVALS_PYTHON, else this one",
    )
    return parser


if __name__ == "__main__":
    main()
