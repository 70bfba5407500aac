"""What is said about a figure, held against the counts of its runs."""

from __future__ import annotations

from collections.abc import Callable, Mapping, Sequence
from dataclasses import dataclass
from itertools import pairwise
from math import inf

from qlb.results import Run
from qlb.results.figure import Finding


@dataclass(frozen=True)
class Measure:
    """What a run took."""

    mean: float
    """nonlinear iterations a step"""
    failed: int
    """steps that did not converge"""
    steps: int
    stage_means: tuple[float, ...]
    """nonlinear iterations of each stage of the integrator"""

    @staticmethod
    def of(run: Run) -> Measure:
        """From a run."""
        summary = run.summary
        stages = [run.iterations_per_step(stage).iterations for stage in range(1, run.stages + 1)]
        means = tuple(float(iterations.mean()) for iterations in stages if len(iterations))
        return Measure(
            summary["iterations_mean"], len(summary["failed_steps"]), len(run.iterations_per_step(1)[0]), means
        )


Measured = Mapping[str, Mapping[str, Measure]]
"""By label of the row, in order, then by solver."""


@dataclass(frozen=True)
class Judgement:
    """What a claim comes to."""

    measured: str
    """the numbers that decide"""
    holds: bool
    sentence: str
    """why it holds or does not"""


Claim = Callable[[Measured], Judgement]
"""Judges what was measured. Raises `KeyError` where a run that it needs is not there."""


@dataclass(frozen=True)
class Statement:
    """A sentence on a figure, and what it claims."""

    text: str
    claim: Claim

    def against(self, measured: Measured) -> Finding:
        """Held against what was measured."""
        try:
            judged = self.claim(measured)
        except KeyError:
            return Finding(self.text, "", None, "A run that this needs is missing.")
        return Finding(self.text, judged.measured, judged.holds, judged.sentence)


def measure(runs: Mapping[str, Mapping[str, Run]]) -> Measured:
    """The counts of a figure's runs."""
    return {label: {solver: Measure.of(run) for solver, run in row.items()} for label, row in runs.items()}


def grows(*solvers: str) -> Claim:
    """Each solver's mean is larger in each row than in the row above."""

    def claim(measured: Measured) -> Judgement:
        means = {solver: _means(measured, solver) for solver in solvers}
        falls = [
            f"{solver} goes from {a:.3g} to {b:.3g} between {above} and {below}"
            for solver in solvers
            for (above, a), (below, b) in pairwise(means[solver].items())
            if not b > a
        ]
        grown = [f"{solver} grows {_growth(row):.3g} times" for solver, row in means.items()]
        first, *_, last = measured
        return Judgement(
            _listed(means), not falls, _sentence(falls) if falls else _sentence(grown, f" from {first} to {last}")
        )

    return claim


def grows_more(solver: str, others: Sequence[str]) -> Claim:
    """From the first row to the last, the mean of `solver` grows by a larger factor than those of `others`."""

    def claim(measured: Measured) -> Judgement:
        means = {name: _means(measured, name) for name in (solver, *others)}
        growth = {name: _growth(row) for name, row in means.items()}
        holds = all(growth[solver] > growth[other] for other in others)
        factors = [f"{name} {factor:.3g} times" for name, factor in growth.items()]
        return Judgement(_listed(means), holds, _sentence(factors, " from the first row to the last"))

    return claim


def more(row: str, than: str, solvers: Sequence[str]) -> Claim:
    """In `row` each of `solvers` has a larger mean than in row `than`."""

    def claim(measured: Measured) -> Judgement:
        pairs = {s: {label: measured[label][s].mean for label in (row, than)} for s in solvers}
        holds = all(means[row] > means[than] for means in pairs.values())
        ratios = [f"{s} {_ratio(means[row], means[than]):.3g} times" for s, means in pairs.items()]
        return Judgement(_listed(pairs), holds, _sentence(ratios, f" what it needs in the row {than}"))

    return claim


def times_above(solver: str, other: str, factor: float) -> Claim:
    """In every row the mean of `solver` is at least `factor` times that of `other`."""

    def claim(measured: Measured) -> Judgement:
        means = {name: _means(measured, name) for name in (solver, other)}
        ratios = {label: _ratio(means[solver][label], means[other][label]) for label in measured}
        low, high = min(ratios.values()), max(ratios.values())
        return Judgement(_listed(means), low >= factor, f"{solver} needs {_span(low, high)} times as many as {other}.")

    return claim


def alike(solvers: Sequence[str], factor: float) -> Claim:
    """The means of each of `solvers` differ from row to row by at most `factor`."""

    def claim(measured: Measured) -> Judgement:
        means = {solver: _means(measured, solver) for solver in solvers}
        spread = {solver: _ratio(max(row.values()), min(row.values())) for solver, row in means.items()}
        told = [f"{solver} {value:.3g}" for solver, value in spread.items()]
        return Judgement(_listed(means), max(spread.values()) <= factor, _sentence(told, " times between the rows"))

    return claim


def fails(solver: str, *rows: str) -> Claim:
    """In each of `rows`, all by default, some steps of `solver` do not converge."""

    def claim(measured: Measured) -> Judgement:
        found = {label: measured[label][solver] for label in rows or measured}
        never = [label for label, one in found.items() if not one.failed]
        counts = ", ".join(f"{label}: {one.failed} of {one.steps} steps failed" for label, one in found.items())
        shares = [f"{100 * one.failed / one.steps:.2g} % of its steps in {label}" for label, one in found.items()]
        told = f"Every step converges in {', '.join(never)}." if never else _sentence(shares)
        return Judgement(f"{solver}: {counts}", not never, told)

    return claim


def converge(*solvers: str, row: str = "") -> Claim:
    """Every step of each of `solvers` converges, in all rows or in one."""

    def claim(measured: Measured) -> Judgement:
        rows = {row: measured[row]} if row else measured
        failed = {s: {label: one[s].failed for label, one in rows.items() if one[s].failed} for s in solvers}
        bad = [f"{n} steps of {s} in {label}" for s, of_rows in failed.items() for label, n in of_rows.items()]
        counts = ", ".join(f"{s} {sum(of_rows.values())}" for s, of_rows in failed.items())
        told = f"Not converged: {', '.join(bad)}." if bad else f"No step failed in {row or 'any row'}."
        return Judgement(f"failed steps: {counts}", not bad, told)

    return claim


def two_stages(*solvers: str) -> Claim:
    """Each step is two solves, drawn as two curves."""

    def claim(measured: Measured) -> Judgement:
        found = {f"{label} {s}": row[s].stage_means for label, row in measured.items() for s in solvers}
        single = [name for name, means in found.items() if len(means) != 2]
        told = ", ".join(f"{name}: {' + '.join(f'{m:.3g}' for m in means)}" for name, means in found.items())
        verdict = f"Not two: {', '.join(single)}." if single else "The first stage is drawn in blue, the second in red."
        return Judgement(told, not single, verdict)

    return claim


def _means(measured: Measured, solver: str) -> dict[str, float]:
    return {label: row[solver].mean for label, row in measured.items()}


def _listed(means: Mapping[str, Mapping[str, float]]) -> str:
    """As in "QLF: 185 (E = 6e3 Pa), 235 (E = 2e4 Pa)"."""
    rows = {solver: ", ".join(f"{mean:.3g} ({label})" for label, mean in row.items()) for solver, row in means.items()}
    return "; ".join(f"{solver}: {counts}" for solver, counts in rows.items())


def _ratio(a: float, b: float) -> float:
    return a / b if b else inf


def _growth(row: Mapping[str, float]) -> float:
    """Of the last row over the first."""
    means = list(row.values())
    return _ratio(means[-1], means[0])


def _span(low: float, high: float) -> str:
    return f"{low:.3g}" if f"{low:.3g}" == f"{high:.3g}" else f"{low:.3g} to {high:.3g}"


def _sentence(parts: Sequence[str], end: str = "") -> str:
    return ", ".join(parts) + end + "."
