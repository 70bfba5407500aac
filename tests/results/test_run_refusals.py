"""Directories that are not written to or read, and overwriting that deletes nothing but a run."""

from __future__ import annotations

import json
import os
import shutil
from pathlib import Path

import pytest

import qlb
from qlb.results import Run, RunWriter, finish_run


def _contents(directory: Path) -> dict[str, bytes]:
    return {str(p.relative_to(directory)): p.read_bytes() for p in directory.rglob("*") if p.is_file()}


def _refused(directory: Path, simulation: qlb.Simulation, **arguments: bool) -> str:
    with pytest.raises(qlb.InputError) as caught:
        RunWriter(directory, {}, simulation, **arguments)
    message = str(caught.value)
    assert str(directory) in message
    assert "choose another" in message
    assert "\n" not in message
    return message


def test_another_run_is_not_overwritten(make_run, make_simulation):
    directory = make_run().directory
    before = _contents(directory)
    assert "holds another run; choose another or use --overwrite" in _refused(directory, make_simulation())
    assert _contents(directory) == before


@pytest.mark.parametrize("overwrite", [False, True])
@pytest.mark.parametrize(
    "marker",
    [None, "", "{", "[]", '{"format": "other"}', '{"format": "qlb run", "version": 99}', "\xff" * 9],
)
def test_a_foreign_folder_is_never_touched(tmp_path, make_simulation, overwrite, marker):
    (tmp_path / "stats.csv").write_text("precious")
    if marker is not None:
        (tmp_path / "run.json").write_text(marker, encoding="latin-1")
    before = _contents(tmp_path)
    assert "not a qlb run" in _refused(tmp_path, make_simulation(), overwrite=overwrite)
    assert _contents(tmp_path) == before


def test_a_file_in_the_way(tmp_path, make_simulation):
    path = tmp_path / "out"
    path.write_text("precious")
    assert "is a file" in _refused(path, make_simulation(), overwrite=True)
    assert "cannot be written" in _refused(path / "below", make_simulation())
    assert path.read_text() == "precious"


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may write anywhere")
def test_a_folder_without_permission(tmp_path, make_simulation):
    tmp_path.chmod(0o500)
    try:
        assert "cannot be written" in _refused(tmp_path, make_simulation())
        assert "cannot be written" in _refused(tmp_path / "new", make_simulation())
    finally:
        tmp_path.chmod(0o700)


@pytest.mark.skipif(not Path("/proc/self").exists(), reason="needs a folder in which nobody can make another")
def test_a_folder_that_cannot_be_made(make_simulation):
    assert "cannot be written" in _refused(Path("/proc/qlb"), make_simulation())


def test_overwriting_deletes_only_what_a_run_wrote(make_run, make_simulation, tmp_path):
    directory = make_run(steps=4).directory
    finish_run(directory, picture=False)
    foreign = ["notes.txt", "frames/notes.txt", "frames/1.npz", "stats.csv.bak", "checkpoint-1.npz"]
    left = [".checkpoint.part.npz", ".checkpoint.old.npz", "checkpoint-000003.npz", "frames/.000005.part.npz"]
    for name in left:  # by a kill
        (directory / name).write_text("a part")
    for name in foreign:
        (directory / name).write_text("precious")
    simulation = make_simulation()
    with RunWriter(directory, {"new": True}, simulation, overwrite=True) as writer:
        writer.record(simulation.advance())
    run = Run(directory)
    assert run.frame_steps == [0, 1]
    assert run.scene == {"new": True}
    assert list(run.iterations_per_step().steps) == [1]
    assert not (directory / "report.html").exists()
    assert not any((directory / name).exists() for name in left)
    assert [(directory / name).read_text() for name in foreign] == ["precious"] * len(foreign)


def test_a_second_writer_is_kept_out(tmp_path, make_simulation):
    RunWriter(tmp_path / "run", {}, make_simulation())
    _refused(tmp_path / "run", make_simulation())


def test_wrong_arguments(tmp_path, make_simulation):
    with pytest.raises(qlb.InputError, match="stride = 0 is out of range: must be >= 1"):
        RunWriter(tmp_path / "run", {}, make_simulation(), stride=0)
    with pytest.raises(qlb.InputError, match="scene must be plain data"):
        RunWriter(tmp_path / "run", {"mesh": make_simulation().mesh}, make_simulation())
    assert not (tmp_path / "run").exists()


@pytest.mark.parametrize(
    ("marker", "message"),
    [
        (None, "it has no run.json"),
        ("{", "run.json cannot be read"),
        ("[1]", "does not have format = 'qlb run'"),
        ('{"format": "other", "version": 1}', "does not have format = 'qlb run'"),
        ('{"format": "qlb run"}', "has format version None"),
        ('{"format": "qlb run", "version": 2}', "has format version 2, this qlb reads 1"),
    ],
)
def test_what_is_not_a_run_is_not_read(make_run, marker, message):
    directory = make_run(steps=1).directory
    (directory / "run.json").unlink()
    if marker is not None:
        (directory / "run.json").write_text(marker)
    with pytest.raises(qlb.InputError, match=message):
        Run(directory)


def test_a_missing_folder_is_not_a_run(tmp_path):
    with pytest.raises(qlb.InputError, match="there is no such folder"):
        Run(tmp_path / "nowhere")


def test_damaged_files_are_named(make_run):
    directory = make_run(steps=2).directory
    damage = {
        "frames/000001.npz": lambda run: run.frame(1),
        "checkpoint.npz": lambda run: run.checkpoint,
        "mesh.npz": lambda run: run.mesh,
        "stats.csv": lambda run: run.stats,
        "summary.json": lambda run: run.summary,
        "scene.yaml": lambda run: run.scene,
    }
    for name, read in damage.items():
        path = directory / name
        whole = path.read_bytes()
        for broken in (b"", whole[: len(whole) // 2], b"\x00\xff" * 40):
            if name == "scene.yaml" and broken and broken in whole:
                continue  # half of a YAML file may be YAML
            if name == "stats.csv" and broken and broken in whole:
                continue  # as a kill leaves it
            path.write_bytes(broken)
            with pytest.raises(qlb.InputError, match=path.name):
                read(Run(directory))
        path.unlink()
        with pytest.raises(qlb.InputError, match=path.name if name != "frames/000001.npz" else "no frame of step 1"):
            read(Run(directory))
        path.write_bytes(whole)
        read(Run(directory))


def test_a_flipped_byte_is_found(make_run):
    run = make_run(steps=1)
    path = run.directory / "checkpoint.npz"
    data = bytearray(path.read_bytes())
    data[len(data) // 2] ^= 0x01
    path.write_bytes(data)
    with pytest.raises(qlb.InputError, match=r"checkpoint\.npz is damaged"):
        _ = run.checkpoint


def test_a_checkpoint_of_another_mesh_is_refused(make_run, make_simulation, tmp_path):
    """Also where the other run has the same id."""
    mesh = qlb.TetMesh.box(cells=(1, 1, 1))
    other = qlb.Simulation(mesh, material=qlb.StableNeoHookean(), threads=1)
    RunWriter(tmp_path / "other", {}, other)
    run = make_run(steps=1)
    (tmp_path / "other" / "checkpoint.npz").replace(run.directory / "checkpoint.npz")
    shutil.copy(tmp_path / "other" / "run.json", run.directory)
    with pytest.raises(qlb.InputError, match=r"'positions' has shape \(8, 3\), must be \(20, 3\)"):
        _ = Run(run.directory).checkpoint


def test_a_missing_frame_is_named(make_run):
    run = make_run(steps=2)
    with pytest.raises(qlb.InputError, match=r"has no frame of step 7, only 0 to 2 \(3 frames\)"):
        run.frame(7)


def test_the_marker_says_what_and_when(make_run):
    marker = json.loads((make_run(steps=1).directory / "run.json").read_text())
    assert marker["format"] == "qlb run"
    assert marker["version"] == 1
    assert marker["created"].endswith("+00:00")
