"""A checkpoint repeats nothing that lies in a frame, loses no bit by that, and tells what has changed."""

from __future__ import annotations

import shutil
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest

import qlb
from qlb.results import Run
from qlb.scenes import load_scene
from qlb.studies import resume_run, run_scene

BAR = ["mesh.cells=12,4,4", "threads=1", "steps=5"]
ARRAY = 13 * 5 * 5 * 3 * 8
"""bytes of the positions; more than checkpoint.npz holds of one array"""


def run_bar(directory: Path, *overrides: str) -> Run:
    return run_scene(load_scene("bar", [*BAR, *overrides]), directory).run


@pytest.fixture
def bar(tmp_path: Path) -> Run:
    return run_bar(tmp_path / "bar")


def sizes(run: Run) -> dict[str, int]:
    return {path.name: path.stat().st_size for path in run.directory.glob("checkpoint*")}


@pytest.mark.parametrize(("solver", "arrays"), [("ND", 0), ("QLB", 0), ("QLA", 1)])
def test_what_frames_hold_is_not_repeated(tmp_path, solver, arrays):
    """Neither the two states, nor the start of the step where QLB has its factor; QLA has one state of its own."""
    size = sizes(run_bar(tmp_path / "run", f"solver={solver}"))
    assert size.pop("checkpoint.npz") < 6000
    assert len(size) <= arrays
    assert sum(size.values()) <= arrays * (ARRAY + 1000)


def test_what_did_not_change_is_not_written_again(tmp_path):
    """The factor of QLA is kept over many steps."""
    run = run_bar(tmp_path / "run", "step=1e-4", "steps=6")
    assert run.stats["factorizations"].sum() < 6
    (part,) = (name for name in sizes(run) if name != "checkpoint.npz")
    assert part < "checkpoint-000006.npz"


def test_single_precision_frames_leave_the_states_to_checkpoints(tmp_path):
    """The last two, each written once."""
    run = run_bar(tmp_path / "run", "output.precision=float32", "solver=ND")
    size = sizes(run)
    assert sorted(size) == ["checkpoint-000004.npz", "checkpoint-000005.npz", "checkpoint.npz"]
    assert 2 * ARRAY < size["checkpoint-000005.npz"] < 2 * ARRAY + 1500


@pytest.mark.parametrize("solver", ["ND", "QLF", "QLB", "QLA"])
@pytest.mark.parametrize(
    "output",
    [[], ["output.stride=3"], ["output.precision=float32"], ["output.compress=true"]],
    ids=["plain", "stride", "float32", "deflated"],
)
def test_resumed_is_unbroken(tmp_path, solver, output):
    settings = [f"solver={solver}", *output]
    run_bar(tmp_path / "run", *settings)
    resumed = resume_run(tmp_path / "run", steps=9).run.checkpoint.state
    exact = run_bar(tmp_path / "exact", f"solver={solver}", "steps=9").frame(9)
    assert np.array_equal(resumed.positions, exact.positions)
    assert np.array_equal(resumed.velocities, exact.velocities)


def other_state(run: Run) -> None:
    """The frame is that of another run, whole in itself."""
    other = run_bar(run.directory.parent / "other", "material.young=1e5")
    shutil.copy(other.directory / "frames" / "000005.npz", run.directory / "frames")


def flipped(run: Run) -> None:
    path = run.directory / "frames" / "000004.npz"
    data = bytearray(path.read_bytes())
    data[len(data) // 3] ^= 1
    path.write_bytes(data)


def changed(name: str, value: object) -> Callable[[Run], None]:
    def change(run: Run) -> None:
        path = run.directory / "checkpoint.npz"
        with np.load(path) as arrays:
            kept = dict(arrays)
        np.savez(path, **(kept | {name: value}))

    return change


@pytest.mark.parametrize(
    ("damage", "says"),
    [
        (other_state, r"frames/000005\.npz is not what it should be: its 'positions' is missing or another one"),
        (flipped, r"frames/000004\.npz is damaged"),
        (lambda run: (run.directory / "frames" / "000005.npz").unlink(), r"frames/000005\.npz does not exist"),
        (lambda run: next(run.directory.glob("checkpoint-*")).unlink(), r"checkpoint-00000\d\.npz does not exist"),
        (
            changed("elsewhere", [["positions", "../other/frames/000005.npz", "positions", "1"]]),
            "it leans on '../other/frames/000005.npz', which no run",
        ),
        (
            changed("elsewhere", [["positions", "/etc/passwd", "positions", "1"]]),
            "it leans on '/etc/passwd', which no run writes",
        ),
        (changed("elsewhere", [["positions", "frames/000005.npz", "positions", "-1"]]), "which no run writes"),
        (changed("elsewhere", np.zeros((0, 4), str)), "it has no array 'positions'"),
        (changed("run", "0"), "is the checkpoint of another run: '0'"),
    ],
)
def test_what_it_leans_on_must_be_as_it_was(bar, damage, says):
    """By name, and before anything of the run is changed."""
    damage(bar)
    before = {path: path.read_bytes() for path in bar.directory.rglob("*") if path.is_file()}
    with pytest.raises(qlb.InputError, match=says) as caught:
        resume_run(bar.directory, steps=6)
    assert "checkpoint.npz" in str(caught.value)
    assert {path: path.read_bytes() for path in bar.directory.rglob("*") if path.is_file()} == before


@pytest.mark.parametrize("both", [False, True])
def test_a_checkpoint_that_a_kill_left_aside_counts(bar, both):
    """Where the next one did not take its place; where it did, that one counts."""
    path = bar.directory / "checkpoint.npz"
    old = path.with_name(".checkpoint.old.npz")
    if both:
        old.write_bytes(b"an earlier one")
    else:
        path.replace(old)
    assert bar.checkpoint.steps_done == 5
    assert resume_run(bar.directory, steps=6).run.checkpoint.steps_done == 6
    assert path.exists()
    assert both or not old.exists()
