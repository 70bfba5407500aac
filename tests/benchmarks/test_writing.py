"""The benchmark of writing: what it times is part of the run, and its table says what the runs said."""

from __future__ import annotations

from benchmarks import writing


def test_a_row_has_medians_and_the_shares_of_each_repeat():
    costs = [
        writing.Cost(cpu=1.0, wall=2.0, writing_cpu=0.1, writing_wall=0.1, size=2e6),
        writing.Cost(cpu=2.0, wall=4.0, writing_cpu=0.4, writing_wall=0.4, size=2e6),
        writing.Cost(cpu=9.0, wall=9.0, writing_cpu=0.9, writing_wall=0.9, size=2e6),
    ]
    assert writing.cost_row("7", "as it is", costs, 10) == [
        *("7", "as it is", "2.00"),  # MB a frame
        *("160.00", "40.00", "40.00"),  # ms a step: without writing, of writing by CPU and wall clock
        *("10.0 %", "10.0 %"),
    ]


def test_writing_is_a_part_of_the_run():
    plain, single = (writing.run_once(["mesh.cells=4,2,2", *case], 3) for case in ([], writing.CASES["float32"]))
    for cost in (plain, single):
        assert 0 < cost.writing_cpu < cost.cpu
        assert 0 < cost.writing_wall < cost.wall
    assert single.size < plain.size
