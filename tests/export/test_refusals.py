"""Exports that are refused or break off leave nothing half written, and what was there stays."""

from __future__ import annotations

import re
import resource
import sys
from pathlib import Path

import pytest

import qlb
from qlb.cli.main import EXPORT_FORMATS, main
from qlb.export import FORMATS, Recording, export_run
from qlb.results import MissingExtra, Run, WriteError
from qlb.scenes import load_scene
from qlb.studies import run_scene

FILES = ("vtkhdf", "vtu", "usd", "glb", "obj", "ply")
"""Formats that need no rendering."""


def contents(directory: Path) -> dict[str, bytes]:
    return {str(p.relative_to(directory)): p.read_bytes() for p in directory.rglob("*") if p.is_file()}


@pytest.fixture
def command(monkeypatch, capsys):
    """Call `qlb export ARGUMENTS`: (exit status, stdout, stderr)."""

    def call(*arguments: object) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["qlb", "export", *map(str, arguments)])
        with pytest.raises(SystemExit) as end:
            main()
        streams = capsys.readouterr()
        return int(end.value.code or 0), streams.out, streams.err

    return call


@pytest.mark.parametrize("name", FILES)
def test_an_earlier_export_is_replaced_only_where_asked(bar, tmp_path, name):
    out = tmp_path / "out"
    export_run(bar, out, format=name)
    (out / "notes.txt").write_text("precious")
    (out / "bar.txt").write_text("precious")
    before = contents(out)
    with pytest.raises(qlb.InputError, match="is there already; choose another or use --overwrite"):
        export_run(bar, out, format=name, steps="1")
    assert contents(out) == before
    done = export_run(bar, out, format=name, steps="1", overwrite=True)
    after = contents(out)
    assert after["notes.txt"] == after["bar.txt"] == b"precious"
    assert {out / path for path in after} == {*done.files, out / "notes.txt", out / "bar.txt"}
    assert done.frames == 1


@pytest.mark.parametrize(("name", "room"), [*((name, 256) for name in FILES), ("vtkhdf", 0), ("vtkhdf", 10_000)])
def test_a_full_disk(bar, tmp_path, name, room):
    out = tmp_path / "out"
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    resource.setrlimit(resource.RLIMIT_FSIZE, (room, limits[1]))
    try:
        with pytest.raises(WriteError, match="cannot write") as caught:
            export_run(bar, out, format=name)
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
    assert str(caught.value).count("cannot write") == 1
    assert "\n" not in str(caught.value)
    assert [path for path in out.rglob("*") if path.is_file()] == []


@pytest.mark.parametrize(
    ("name", "module", "extra"),
    [
        ("vtkhdf", "h5py", "vtkhdf"),
        ("usd", "pxr", "usd"),
        ("mp4", "imageio_ffmpeg", "video"),
        ("gif", "pyvista", "view"),
    ],
)
def test_a_package_that_is_missing(bar, tmp_path, monkeypatch, name, module, extra):
    monkeypatch.setitem(sys.modules, module, None)
    with pytest.raises(MissingExtra, match=re.escape(f'pip install "qlb[{extra}]"')):
        export_run(bar, tmp_path / "out", format=name)
    assert not any(path.is_file() for path in (tmp_path / "out").rglob("*"))


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"format": "stl"}, "format 'stl' is not known: must be one of vtkhdf, vtu"),
        ({}, "no format is given"),
        ({"format": "obj", "fps": 3.0}, "format obj has no option 'fps', it takes none"),
        ({"format": "vtu", "turntable": True}, "format vtu has no option 'turntable', only volume"),
        ({"format": "glb", "steps": "9:"}, r"steps '9:' choose no frame of run .*: it has 0 to 3 \(4 frames\)"),
        ({"format": "glb", "steps": "a"}, "steps = 'a' must be A:B:C"),
        ({"format": "glb", "steps": "-1"}, "steps = '-1' must be A:B:C"),
        ({"format": "glb", "steps": "0:3:0"}, "every 0-th frame, must be >= 1"),
        ({"format": "glb", "steps": "0:1:2:3"}, "must be A:B:C"),
    ],
)
def test_wrong_arguments(bar, tmp_path, arguments, message):
    with pytest.raises(qlb.InputError, match=message):
        export_run(bar, tmp_path / "out", **arguments)
    assert not (tmp_path / "out").exists() or not list((tmp_path / "out").iterdir())


@pytest.mark.parametrize(
    ("steps", "chosen"),
    [
        ("", [0, 1, 2, 3]),
        (":", [0, 1, 2, 3]),
        ("1:", [1, 2, 3]),
        (":2", [0, 1, 2]),
        ("::2", [0, 2]),
        ("2", [2]),
        ("1:9:2", [1, 3]),
    ],
)
def test_steps(bar, steps, chosen):
    assert Recording.of(bar, steps).steps == chosen


def test_a_run_without_frames(bar, tmp_path):
    for step in bar.frame_steps:
        (bar.directory / "frames" / f"{step:06d}.npz").unlink()
    with pytest.raises(qlb.InputError, match="has no frames to export"):
        export_run(bar, tmp_path / "x.glb")


def test_a_damaged_frame_breaks_the_export_off(bar, tmp_path):
    (bar.directory / "frames" / "000002.npz").write_bytes(b"nothing")
    for name in FILES:
        with pytest.raises(qlb.InputError, match=r"000002\.npz is damaged"):
            export_run(bar, tmp_path / name, format=name)
        assert not list((tmp_path / name).glob(".*"))


def test_places(bar, tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    where = {
        None: bar.directory / "exports" / "bar.glb",
        Path("folder"): Path("folder/bar.glb"),
        Path("v1.2"): Path("v1.2/bar.glb"),
        Path("deep/er/other.glb"): Path("deep/er/other.glb"),
    }
    for out, path in where.items():
        assert export_run(bar, out, format="glb").files == [path]
        assert path.is_file()
    with pytest.raises(qlb.InputError, match=r"output x\.glb must end in \.usd or \.usdc or \.usda for format usd"):
        export_run(bar, Path("x.glb"), format="usd")
    Path("file").write_text("precious")
    with pytest.raises(qlb.InputError, match="output folder file is a file"):
        export_run(bar, Path("file/x.glb"))


def test_a_run_that_takes_the_place_of_another_takes_its_exports_along(tmp_path):
    """By the names that `qlb export` gives them; what a user put beside them stays."""
    directory, scene = tmp_path / "bar", load_scene("bar", ["mesh.cells=2,1,1", "steps=2", "threads=1"])
    run = run_scene(scene, directory).run
    for name in ("glb", "obj", "vtu", "ply"):
        export_run(run, format=name)
    kept = {directory / "exports" / name for name in ("bar_notes.obj", "mine.glb", "bar.txt")}
    for path in kept:
        path.write_text("precious")
    assert len(list((directory / "exports").iterdir())) > len(kept) + 4
    with pytest.raises(qlb.InputError, match="holds another run"):
        run_scene(scene, directory)
    assert (directory / "exports" / "bar.glb").exists()
    run_scene(scene, directory, overwrite=True)
    assert set((directory / "exports").iterdir()) == kept
    for path in kept:
        path.unlink()
    run_scene(scene, directory, overwrite=True)
    assert not (directory / "exports").exists()


def test_progress_counts_every_frame_once(bar, tmp_path):
    for name in FILES:
        counted: list[tuple[int, int]] = []
        export_run(bar, tmp_path / name, format=name, on_frame=lambda k, total, to=counted: to.append((k, total)))
        assert counted == [(k, 4) for k in (1, 2, 3, 4)], name


def test_the_command(bar, tmp_path, command):
    out = tmp_path / "x.glb"
    status, said, _ = command(bar.directory, "--out", out)
    assert status == 0
    assert said.splitlines()[0] == f"4 frames, {out.stat().st_size / 1e3:.3g} kB"
    assert said.splitlines()[1].split(maxsplit=1) == ["glb", str(out)]
    status, _, told = command(bar.directory, "--out", out)
    assert (status, len(told.strip().splitlines())) == (2, 1)
    for arguments in (["--format", "gif", "--size", "9"], ["--format", "gif", "--size", "axb"], ["--format", "tga"]):
        status, _, told = command(bar.directory, *arguments)
        assert (status, len(told.strip().splitlines())) == (2, 1), arguments
    assert command(tmp_path, "--format", "glb")[0] == 2


def test_the_help_names_every_format(command):
    assert tuple(FORMATS) == EXPORT_FORMATS
    assert command("--help")[0] == 0


def test_an_early_run_has_no_stress_and_says_so(bar, tmp_path):
    (bar.directory / "materials.npz").unlink()
    done = export_run(Run(bar.directory), tmp_path / "x.ply")
    assert done.notes == ["without stress: the run was written by an earlier version of qlb, which kept no materials"]
    assert b"von_mises" not in done.files[0].read_bytes()
    assert done.size == sum(file.stat().st_size for file in done.files)
