"""The process that reads files may crash, hang, or be gone: the next request finds another."""

from __future__ import annotations

import os
import signal
import time
from pathlib import Path

import pytest

from qlb.mesh import child, files, worker
from qlb.mesh.child import ChildRefused, ask
from tests.mesh.surfaces import FILES


@pytest.fixture
def request_(tmp_path: Path) -> dict[str, str]:
    FILES["text.vtu"](tmp_path / "box.vtu")
    return {"task": "read", "path": str(tmp_path / "box.vtu")}


def test_a_process_is_kept_and_replaced_when_it_has_gone(request_: dict[str, str]) -> None:
    ask(request_, {}, seconds=300)
    first = child._kept
    ask(request_, {}, seconds=300)
    assert first is not None
    assert child._kept is first
    os.kill(first._process.pid, signal.SIGKILL)
    first._process.wait()
    assert len(ask(request_, {}, seconds=300)[1]["tets"]) == 24
    assert child._kept is not first


def test_a_crash_and_a_hang_are_refusals(monkeypatch: pytest.MonkeyPatch, tmp_path: Path) -> None:
    crashing = Path(worker.__file__).read_text().replace("def prepare(", "def prepare(path): os.abort()\ndef _(")
    hanging = crashing.replace("os.abort()", "threading.Event().wait()")
    for code, says in ((crashing, "crashed"), (hanging, "longer than 3 s")):
        (tmp_path / "worker.py").write_text(code)
        monkeypatch.setattr(worker, "__file__", str(tmp_path / "worker.py"))
        child.end()
        begin = time.monotonic()
        with pytest.raises(ChildRefused, match=says):
            ask({"task": "prepare", "path": "x.vtu"}, {}, seconds=3 if "longer" in says else 300)
        assert time.monotonic() - begin < 60
        assert child._kept is None


def test_what_a_reader_prints_is_not_seen(tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    path = tmp_path / "bad.vtu"
    path.write_text("no xml")
    with pytest.raises(files.InputError, match="it is damaged, or not what its suffix says"):
        files.MeshFile.read(path)
    assert capfd.readouterr() == ("", "")


def test_an_idle_process_ends_by_itself(
    monkeypatch: pytest.MonkeyPatch, tmp_path: Path, request_: dict[str, str]
) -> None:
    (tmp_path / "worker.py").write_text(Path(worker.__file__).read_text().replace("IDLE = 20.0", "IDLE = 0.2"))
    monkeypatch.setattr(worker, "__file__", str(tmp_path / "worker.py"))
    child.end()
    ask(request_, {}, seconds=300)
    assert child._kept is not None
    assert child._kept._process.wait(timeout=60) == 0
    assert len(ask(request_, {}, seconds=300)[1]["tets"]) == 24
    child.end()
