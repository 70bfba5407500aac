"""`qlb reproduce`: exit status and what it prints."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import time

import pytest

from qlb.cli.main import main
from qlb.studies import processes

TINY = ["--set", "mesh.cells=4,1,1", "--steps", "3", "--processes", "2"]


@pytest.fixture
def command(monkeypatch, tmp_path, capsys):
    monkeypatch.chdir(tmp_path)

    def call(*arguments: str) -> tuple[int, str, str]:
        monkeypatch.setattr(sys, "argv", ["qlb", "reproduce", *arguments])
        with pytest.raises(SystemExit) as end:
            main()
        streams = capsys.readouterr()
        return int(end.value.code or 0), streams.out, streams.err

    return call


@pytest.mark.slow
def test_prints_a_line_for_each_case_and_a_table(command, tmp_path):
    status, out, err = command("2", *TINY)
    assert (status, err) == (0, "")
    lines = [line for line in out.splitlines() if "bar-" in line]
    assert len(lines) >= 6
    assert lines[-1].startswith(f"{len(lines)}/{len(lines)}")
    assert "Figure 2: Incompressibility" in out
    assert (tmp_path / "runs" / "reproduce" / "index.html").exists()
    status, out, _ = command("2", *TINY)
    assert (status, out.count("kept")) == (0, len(lines))


def test_wrong_input_is_one_line(command):
    for arguments in (["11"], ["1", "--processes", "0"], ["1", "--set", "solver=ND"]):
        status, out, err = command(*arguments)
        assert (status, out, len(err.splitlines())) == (2, "", 1)


@pytest.mark.slow
def test_a_crash_gives_status_1(command, monkeypatch):
    monkeypatch.setattr(processes, "WORKER", (sys.executable, "-c", "raise SystemExit(3)"))
    status, out, err = command("2", *TINY)
    assert status == 1
    assert "crashed: bar-default-ND: exit status 3" in err
    assert "no run" in out


@pytest.mark.slow
def test_interrupt_says_how_to_go_on(tmp_path):
    arguments = ["reproduce", "2", "--set", "mesh.cells=4,1,1", "--steps", "100000", "--out", "out"]
    start = [sys.executable, "-c", "from qlb.cli.main import main; main()", *arguments]
    process = subprocess.Popen(start, cwd=tmp_path, stderr=subprocess.PIPE, text=True)
    frames = tmp_path / "out" / "runs" / "bar-default-QLF" / "frames"
    deadline = time.monotonic() + 60
    while time.monotonic() < deadline and not (frames.exists() and len(os.listdir(frames)) > 2):
        time.sleep(0.05)
    process.send_signal(signal.SIGINT)
    _, err = process.communicate(timeout=30)
    assert process.returncode == 130
    assert "goes on from there" in err
    assert "0 of" in err
    count = len(os.listdir(frames))
    time.sleep(0.3)
    assert len(os.listdir(frames)) == count  # no process goes on in the background
