"""A run followed in the browser: its page gets every step while it goes, hears of its end, and nothing stays behind."""

from __future__ import annotations

import signal
import subprocess
import sys
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from time import monotonic, sleep
from urllib.error import HTTPError
from urllib.request import Request, urlopen

import pytest

from qlb.results import Run
from qlb.results.live import LiveView

pytestmark = pytest.mark.slow

COMMAND = [sys.executable, "-c", "from qlb.cli.main import main; main()"]


@contextmanager
def started(folder: Path, steps: int) -> Iterator[tuple[subprocess.Popen[str], str]]:
    """A run with --live, and the address that it prints."""
    keys = ["--steps", str(steps), "--set", "mesh.cells=4,1,1", "--out", "out", "--no-picture", "--threads", "1"]
    command = [*COMMAND, "run", "bar", "--live", *keys]
    with subprocess.Popen(command, cwd=folder, stderr=subprocess.PIPE, text=True) as process:
        assert process.stderr is not None
        try:
            yield process, process.stderr.readline().split()[-1]
        finally:
            process.kill()


def is_gone(address: str) -> bool:
    try:
        urlopen(address, timeout=30).close()
    except HTTPError:
        return False
    except OSError:
        return True
    return False


def test_a_page_follows_a_run_until_it_is_interrupted(open_page, tmp_path):
    with started(tmp_path, 100_000) as (process, address):
        page = open_page(address)
        page.wait_for("() => Number(document.getElementById('viewer-root').dataset.step) >= 20")
        assert page.page.inner_text(".verdict").startswith("Running: ")
        page.wait_for("() => document.querySelectorAll('#energy .scatterlayer path').length > 0")
        process.send_signal(signal.SIGINT)
        page.page.wait_for_selector(".verdict:has-text('Interrupted after')")
        assert process.wait(120) == 130
    last = Run(tmp_path / "out").frame_steps[-1]
    page.wait_for_step(last)
    assert str(last) in page.page.inner_text(".verdict")
    assert is_gone(address)


def test_a_server_that_nobody_looks_at_ends_with_the_run(tmp_path):
    with started(tmp_path, 3) as (process, address):
        assert process.wait(120) == 0
    assert address.startswith("http://127.0.0.1:")
    assert is_gone(address)


def test_a_kill_takes_the_server_along(tmp_path):
    with started(tmp_path, 100_000) as (process, address):
        assert not is_gone(address)
        process.kill()
    deadline = monotonic() + 60
    while not is_gone(address):
        assert monotonic() < deadline, "the server is still there"
        sleep(0.1)


def test_only_pages_of_this_machine_are_answered(bar):
    addresses: list[str] = []
    view = LiveView(bar, addresses.append)
    try:
        while not addresses:
            assert view._process.poll() is None
            sleep(0.05)
        foreign = Request(addresses[0], headers={"Host": "example.org"})
        with pytest.raises(HTTPError, match="403"):
            urlopen(foreign, timeout=60)
        for path, status in (("nothing", "404"), ("update?after=x", "400")):
            with pytest.raises(HTTPError, match=status):
                urlopen(addresses[0] + path, timeout=60)
    finally:
        view.close()
    assert is_gone(addresses[0])
