"""`python -m benchmarks [kernels|step|rivals] ...`: prints Markdown tables."""

from __future__ import annotations

import argparse
import os
import sys

from benchmarks import kernels, step
from benchmarks.rivals import runner


def main() -> None:
    """Parse the command line and print what it asks for."""
    parser = argparse.ArgumentParser(prog="python -m benchmarks", description="Benchmarks of qlb, as Markdown tables")
    parser.add_argument("which", nargs="*", choices=["kernels", "step", "rivals"], help="default: the first two")
    parser.add_argument("--sizes", default="1536,5184,12288", help=f"tets, out of {list(step.CELLS)}")
    parser.add_argument("--solvers", default=",".join(step.CASES))
    parser.add_argument("--variant", default="drop", choices=["drop", "twist"])
    parser.add_argument("--steps", type=int, default=20)
    parser.add_argument("--repeats", type=int, default=3)
    parser.add_argument("--threads", type=int, default=1)
    parser.add_argument("--only", default="", help="rivals: names of packages; default: all that are installed")
    parser.add_argument("--integrator", default="BDF1", choices=["BDF1", "BDF2"], help="rivals")
    parser.add_argument(
        "--python",
        default=os.environ.get("QLB_RIVALS_PYTHON", sys.executable),
        help="rivals: the interpreter that has them; default: $QLB_RIVALS_PYTHON, else this one",
    )
    options = parser.parse_args()
    which = options.which or ["kernels", "step"]
    sizes = [int(size) for size in options.sizes.split(",")]
    if "kernels" in which:
        threads = sorted({1, options.threads})
        print(kernels.element_table(threads), end="\n\n")
        print(kernels.factor_table(threads, [step.CELLS[size] for size in sizes]), end="\n\n")
    if "step" in which:
        print(
            step.table(
                sizes,
                options.solvers.split(","),
                variant=options.variant,
                steps=options.steps,
                threads=options.threads,
                repeats=options.repeats,
            )
        )
    if "rivals" in which:
        settings = runner.Settings(
            python=options.python,
            integrator=options.integrator,
            steps=options.steps,
            repeats=options.repeats,
            threads=options.threads,
        )
        print(runner.table(sizes, [name for name in options.only.split(",") if name], settings))


if __name__ == "__main__":
    main()
