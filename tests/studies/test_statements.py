"""Statements on figures: each kind holds, fails, and says so, on counts made up for it."""

from __future__ import annotations

import pytest

from qlb.studies.reproduce_figures import COLUMNS, FIGURES
from qlb.studies.statements import (
    Claim,
    Measure,
    Statement,
    alike,
    converge,
    fails,
    grows,
    grows_more,
    more,
    times_above,
    two_stages,
)


def one(mean: float, failed: int = 0, stages: tuple[float, ...] = (1.0,)) -> Measure:
    return Measure(mean, failed, 120, stages)


MEASURED = {
    "soft": {"ND": one(4), "QLF": one(30), "QLB": one(5, stages=(2.0, 3.0))},
    "hard": {"ND": one(5), "QLF": one(300, failed=7), "QLB": one(4, stages=(2.0, 2.0))},
}


@pytest.mark.parametrize(
    ("claim", "holds", "words"),
    [
        (grows("ND", "QLF"), True, ["QLF grows 10 times from soft to hard", "ND: 4 (soft), 5 (hard)"]),
        (grows("QLF", "QLB"), False, ["QLB goes from 5 to 4 between soft and hard"]),
        (grows_more("QLF", ("ND", "QLB")), True, ["QLF 10 times, ND 1.25 times, QLB 0.8 times"]),
        (grows_more("ND", ("QLF",)), False, ["ND 1.25 times"]),
        (more("hard", "soft", ("ND", "QLF")), True, ["QLF 10 times what it needs in the row soft"]),
        (more("hard", "soft", ("ND", "QLB")), False, ["QLB 0.8 times"]),
        (times_above("QLF", "ND", 7), True, ["QLF needs 7.5 to 60 times as many as ND"]),
        (times_above("QLF", "ND", 8), False, ["7.5 to 60"]),
        (alike(("ND", "QLB"), 1.3), True, ["ND 1.25, QLB 1.25 times between the rows"]),
        (alike(("ND", "QLF"), 1.3), False, ["QLF 10 times"]),
        (fails("QLF", "hard"), True, ["hard: 7 of 120 steps failed", "5.8 % of its steps in hard"]),
        (fails("QLF"), False, ["Every step converges in soft"]),
        (converge("ND", "QLB"), True, ["failed steps: ND 0, QLB 0"]),
        (converge("ND", "QLF"), False, ["Not converged: 7 steps of QLF in hard"]),
        (two_stages("QLB"), True, ["soft QLB: 2 + 3"]),
        (two_stages("QLB", "ND"), False, ["Not two: soft ND, hard ND"]),
    ],
)
def test_a_claim_is_judged_by_the_counts(claim: Claim, holds: bool, words: list[str]) -> None:
    finding = Statement("So it is.", claim).against(MEASURED)
    assert finding.holds is holds
    assert finding.verdict == ("holds" if holds else "does not hold")
    for word in words:
        assert word in f"{finding.sentence} {finding.measured}"


def test_a_missing_run_leaves_it_open() -> None:
    finding = Statement("So it is.", converge("QLA")).against(MEASURED)
    assert (finding.holds, finding.verdict) == (None, "not measured")


def test_every_figure_has_statements_that_its_rows_can_decide() -> None:
    for figure in FIGURES.values():
        measured = {row.label: {solver: one(5, stages=(2.0, 3.0)) for solver in COLUMNS} for row in figure.rows}
        findings = [statement.against(measured) for statement in figure.statements]
        assert findings
        assert all(finding.holds is not None and finding.measured and finding.sentence for finding in findings)
