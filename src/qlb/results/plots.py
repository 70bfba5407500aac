"""Plots of runs: iterations, residuals, and where the time went."""

from __future__ import annotations

from collections.abc import Mapping
from pathlib import Path
from typing import Any

import numpy as np
from matplotlib.axes import Axes
from matplotlib.collections import LineCollection
from matplotlib.colors import Normalize
from matplotlib.ticker import FuncFormatter, MaxNLocator

from qlb.arrays import FloatArray, LongArray
from qlb.results import style
from qlb.results.run import Run, StepIterations
from qlb.results.statistics import Statistics
from qlb.timing import PARTS

LOGARITHMIC = 12.0
"""Iterations are drawn on a logarithmic axis when the means of two curves are this far apart."""
_NAMES = {"hessian": "Hessian"}


def plot_iterations(runs: Mapping[str, Run], path: Path) -> None:
    """Nonlinear iterations over time steps, one curve per run; failed steps are marked.

    Runs with two stages a step get a panel each, the first stage blue and the second red, as in the paper.
    Writes PNG or SVG, as the suffix of `path` says. Raises `WriteError`.
    """
    with style.look():
        if max((run.stages for run in runs.values()), default=1) > 1:
            figure = style.figure(max(8.0, 4.2 * len(runs)), 4.0)
            axes = style.panels(figure, len(runs))
            curves = [_draw_stages(ax, label, run) for ax, (label, run) in zip(axes, runs.items(), strict=True)]
        else:
            figure = style.figure(8.0, 4.0)
            axes = style.panels(figure, 1)
            curves = [[_draw_run(axes[0], i, label, run) for i, (label, run) in enumerate(runs.items())]]
            axes[0].set_title("Nonlinear iterations per time step")
        everything = [curve for panel in curves for curve in panel]
        for ax, panel in zip(axes, curves, strict=True):
            _mark_failures(ax, panel)
            _iteration_axes(ax, everything)
            columns = 2 if len(axes) == 1 and len(ax.get_lines()) > 2 else 1
            ax.legend(loc="upper left", ncols=columns, fontsize=9 if len(axes) == 1 else 8)
        axes[0].set_ylabel("nonlinear iterations")
        style.save(figure, path)


def _draw_run(ax: Axes, index: int, label: str, run: Run) -> StepIterations:
    curve = run.iterations_per_step()
    _draw_curve(ax, curve, label, style.LINES[index % len(style.LINES)])
    return curve


def _draw_stages(ax: Axes, label: str, run: Run) -> list[StepIterations]:
    ax.set_title(_plain(label))
    curves = [run.iterations_per_step(stage) for stage in range(1, run.stages + 1)]
    names = ("first stage", "second stage")[: len(curves)] if len(curves) > 1 else (label,)
    for curve, name, colour in zip(curves, names, (style.BLUE, style.RED), strict=False):
        _draw_curve(ax, curve, name, colour, width=3.0 if colour == style.BLUE else 1.5)
    return curves


def _draw_curve(ax: Axes, curve: StepIterations, label: str, colour: str, width: float = 1.6) -> None:
    n = curve.iterations
    text = _plain(label) + (f": mean {n.mean():.3g}, max {n.max()}" if len(n) else ": no steps")
    failed = int(np.count_nonzero(~curve.converged))
    if failed:
        text += f", {failed} failed"
    marker = "o" if len(n) < 3 else ""
    ax.step(curve.steps, n, where="mid", color=colour, label=text, linewidth=width, marker=marker, markersize=4)


def _mark_failures(ax: Axes, curves: list[StepIterations]) -> None:
    steps = np.concatenate([curve.steps[~curve.converged] for curve in curves])
    values = np.concatenate([curve.iterations[~curve.converged] for curve in curves])
    if len(steps):
        ax.plot(
            steps, values, "x", color=style.RED, markersize=6, markeredgewidth=1.6, label="did not converge", zorder=4
        )


def _iteration_axes(ax: Axes, curves: list[StepIterations]) -> None:
    means = [max(1.0, float(curve.iterations.mean())) for curve in curves if len(curve.iterations)]
    highest = max((int(curve.iterations.max()) for curve in curves if len(curve.iterations)), default=1)
    if means and max(means) > LOGARITHMIC * min(means):
        zero = any((curve.iterations == 0).any() for curve in curves)
        ax.set_yscale("symlog", linthresh=1, linscale=0.3)
        ax.set_ylim(0 if zero else 1, 3 * highest)
        ax.yaxis.set_major_formatter(FuncFormatter(lambda value, _: f"{value:g}"))
    else:
        ax.set_ylim(0, 1.3 * max(1, highest))
        ax.yaxis.set_major_locator(_whole_numbers())
    ax.xaxis.set_major_locator(_whole_numbers())
    ax.margins(x=0.02)
    ax.set_xlabel("time step")


def plot_residuals(run: Run, path: Path) -> None:
    """|g| over |g(x_k)| in the course of every solve, one thin line each, coloured by time step.

    Writes PNG or SVG, as the suffix of `path` says. Raises `WriteError`.
    """
    lines, steps, failed = residual_lines(run.stats)
    with style.look():
        figure = style.figure(8.0, 4.0)
        (ax,) = style.panels(figure, 1)
        colours = Normalize(1, max(2, int(steps.max(initial=2))))
        drawn = LineCollection(lines, cmap="viridis_r", norm=colours, linewidths=0.8, alpha=0.75)
        drawn.set_array(steps)
        ax.add_collection(drawn)
        if any(failed):
            ends = np.array([line[-1] for line, bad in zip(lines, failed, strict=True) if bad])
            ax.plot(*ends.T, "x", color=style.RED, markeredgewidth=1.6, label="did not converge")
        tolerance = run.summary.get("tolerance", {}).get("relative")
        if tolerance:
            label = f"relative tolerance {tolerance:g}"
            ax.axhline(tolerance, color=style.INK, linewidth=1, linestyle="--", label=label)
        ax.set_yscale("log")
        ax.autoscale_view()
        ax.set_xlim(0, max([1.0, *(float(line[-1, 0]) for line in lines)]) * 1.02)
        ax.xaxis.set_major_locator(_whole_numbers())
        ax.set_title("Residual over the iterations of each solve")
        ax.set_xlabel("nonlinear iteration")
        ax.set_ylabel("$|g|\\;/\\;|g(x_k)|$")
        if ax.get_legend_handles_labels()[0]:
            ax.legend(loc="upper right", fontsize=9)
        figure.colorbar(drawn, ax=ax, label="time step", pad=0.02, ticks=_whole_numbers())
        style.save(figure, path)


def residual_lines(stats: Statistics) -> tuple[list[FloatArray], LongArray, list[bool]]:
    """(iteration, residual) of each solve, its step, and whether it failed; what is not finite or zero is left out."""
    lines, steps, failed = [], [], []
    begin = np.flatnonzero(stats["iteration"] == 0)
    for rows in map(slice, begin, [*begin[1:], len(stats["step"])]):
        with np.errstate(divide="ignore", invalid="ignore"):
            ratio = stats["residual"][rows] / stats["reference"][rows]
        good = np.isfinite(ratio) & (ratio > 0)
        if good.any():
            lines.append(np.column_stack([stats["iteration"][rows][good], ratio[good]]))
            steps.append(stats["step"][rows][0])
            failed.append(not str(stats["reason"][rows][-1]).startswith("converged"))
    return lines, np.array(steps, np.int64), failed


def plot_contact(run: Run, path: Path) -> None:
    """Contacts at the end of each step, and the smallest distance between what touches.

    Writes PNG or SVG, as the suffix of `path` says. Raises `WriteError`.
    """
    stats = run.stats
    last = np.flatnonzero(np.diff(stats["step"], append=-1))
    steps, nearest = stats["step"][last], stats["minimum_distance"][last]
    with style.look():
        figure = style.figure(8.0, 4.4)
        count, distance = figure.subplots(2, 1, sharex=True)
        count.step(steps, stats["contacts"][last], where="mid", color=style.BLUE)
        count.set_title("Contact at the end of each step")
        count.set_ylabel("contacts")
        count.set_ylim(bottom=0)
        count.yaxis.set_major_locator(_whole_numbers())
        touches = np.isfinite(nearest) & (nearest > 0)
        distance.plot(steps[touches], nearest[touches], ".", color=style.BLUE, markersize=4)
        dhat = (run.summary.get("contact") or {}).get("dhat")
        if dhat:
            distance.axhline(dhat, color=style.INK, linewidth=1, linestyle="--", label=f"dhat = {dhat:.3g} m")
            distance.legend(loc="lower right", fontsize=9)
        if touches.any() or dhat:
            distance.set_yscale("log")
        distance.set_ylabel("smallest distance [m]")
        distance.set_xlabel("time step")
        distance.xaxis.set_major_locator(_whole_numbers())
        distance.margins(x=0.02)
        style.save(figure, path)


def plot_seconds(run: Run, path: Path) -> None:
    """Where the time went: parts of the whole time loop as one bar, and of each step over the steps.

    Writes PNG or SVG, as the suffix of `path` says. Raises `WriteError`.
    """
    with style.look():
        figure = style.figure(8.0, 4.4)
        total, each = figure.subplots(2, 1, height_ratios=[1, 4])
        _draw_total(total, run.summary["seconds"])
        _draw_steps(each, run.stats)
        handles, labels = each.get_legend_handles_labels()
        figure.legend(handles, labels, loc="outside lower center", ncols=max(1, len(labels)), fontsize=9)
        style.save(figure, path)


def _draw_total(ax: Axes, seconds: Mapping[str, float]) -> None:
    whole = sum(seconds.values())
    ax.set_title(f"Where the time went: {_seconds_text(whole)} in the time loop")
    left = 0.0
    for part in PARTS:
        share = seconds[part] / whole if whole > 0 else 0.0
        ax.barh(0, share, left=left, color=style.PARTS[part], height=1, edgecolor="white", linewidth=1)
        if share > 0.06:
            dark = part == "hessian"
            colour: Any = "white" if dark else style.INK
            ax.text(left + share / 2, 0, f"{100 * share:.0f} %", ha="center", va="center", color=colour)
        left += share
    ax.set_xlim(0, 1)
    ax.set_axis_off()


def _draw_steps(ax: Axes, stats: Statistics) -> None:
    steps, inverse = np.unique(stats["step"], return_inverse=True)
    parts = {part: 1e3 * np.bincount(inverse, stats[f"seconds_{part}"], len(steps)) for part in PARTS}
    width = 1.0 if len(steps) > 60 else 0.9
    bottom = np.zeros(len(steps))
    for part, height in parts.items():
        if not height.any() and part in ("contact", "candidates"):
            continue
        ax.bar(steps, height, width, bottom=bottom, color=style.PARTS[part], label=_NAMES.get(part, part), linewidth=0)
        bottom += height
    _clip(ax, steps, bottom)
    ax.set_xlabel("time step")
    ax.set_ylabel("time of the step [ms]")
    ax.margins(x=0.01)
    ax.grid(axis="x", visible=False)
    ax.xaxis.set_major_locator(_whole_numbers())


def _clip(ax: Axes, steps: LongArray, height: FloatArray) -> None:
    """Keep the axis to what most steps take, and say which stick out."""
    top = 2.5 * float(np.percentile(height, 95)) if len(height) else 0.0
    out = np.flatnonzero(height > top)
    if top <= 0 or len(out) == 0:
        return
    ax.set_ylim(0, top)
    named = [f"step {steps[i]} takes {_seconds_text(1e-3 * height[i])}" for i in out[:3]]
    more = [f"{len(out) - 3} more stick out"] if len(out) > 3 else []
    ax.text(0.99, 0.96, "\n".join(named + more), transform=ax.transAxes, ha="right", va="top", fontsize=9)


def _plain(label: str) -> str:
    """A label as it is: no formula between dollars, and not hidden for an underscore at its start."""
    text = label.replace("$", r"\$")
    return f" {text}" if text.startswith("_") else text


def _whole_numbers() -> MaxNLocator:
    return MaxNLocator(integer=True, steps=[1, 2, 5, 10])


def _seconds_text(seconds: float) -> str:
    return f"{seconds:.3g} s" if seconds >= 0.1 else f"{1e3 * seconds:.3g} ms"
