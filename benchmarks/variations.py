"""Every solver on every variation of the bar: which is the fastest where."""

from __future__ import annotations

from benchmarks.machine import machine_line, markdown
from benchmarks.step import BEST_ND, Measurement, measure
from qlb.studies.reproduce_figures import FIGURES

CASES = ("ND", BEST_ND, "QLF", "QLB", "QLA")

OTHERS = {
    "twist": ("variant=twist",),
    "damping.mass = 100 1/s": ("damping.mass=100",),
    "damping.viscosity = 100 Pa s": ("damping.viscosity=100",),
    "SDIRK2": ("integrator=SDIRK2",),
    "StVK": ("material.model=StVK",),
    "h = 5 ms": ("step=5e-3",),
    "h = 20 ms": ("step=2e-2",),
}


def variations() -> dict[str, tuple[str, ...]]:
    """Settings of each variation: the rows of the supplement's figures of the bar, each once, and more of our own."""
    figures = [figure for figure in FIGURES.values() if figure.scene == "bar"]
    rows = {row.overrides: row.label for figure in figures for row in figure.rows}
    defaults = {("material.poisson=0.49",), ("heterogeneous=false",), ("anisotropic=false",), ("integrator=BDF2",)}
    return {label: overrides for overrides, label in rows.items() if overrides not in defaults} | OTHERS


def table(*, steps: int, threads: int, repeats: int) -> str:
    """CPU milliseconds a step, iterations and failed steps, as Markdown."""
    rows = []
    for label, overrides in variations().items():
        found = measure(CASES, [*overrides, f"threads={threads}"], steps=steps, repeats=repeats)
        ours = found["QLA"].cpu
        fastest = min(m.cpu for name, m in found.items() if name != "QLA")
        rows.append([label, *(_cell(m, steps) for m in found.values()), f"{fastest / ours:.1f}"])
    title = f"Bar, 3000 tets, {steps} steps, tolerance 1e-6 relative, best of {repeats}. {machine_line(threads)}."
    header = ["variation", *(f"`{case}`" for case in CASES), "fastest of the others over QLA"]
    return f"### Variations of the bar\n\n{title} CPU ms a step (iterations).\n\n{markdown(header, rows)}"


def _cell(m: Measurement, steps: int) -> str:
    return f"{1e3 * m.cpu / steps:.2f} ({m.iterations:.1f})" + (f", {m.failed} failed" if m.failed else "")
