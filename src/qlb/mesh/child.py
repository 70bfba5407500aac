"""Reading files and filling surfaces in a process of its own (`qlb.mesh.worker`), which may crash, hang or print."""

from __future__ import annotations

import atexit
import os
import subprocess
import sys
import threading
from contextlib import suppress
from typing import Any

from qlb.errors import QlbError
from qlb.mesh import worker
from qlb.mesh.worker import Arrays


class ChildRefused(Exception):
    """The child could not do what it was asked; the message says why."""


class _Child:
    """A running `qlb.mesh.worker`."""

    def __init__(self) -> None:
        if not sys.executable:
            raise QlbError("mesh files are read in another process, and there is no Python to start one with")
        # Threads of BLAS, which has nothing to do there, would count as memory.
        environment = os.environ | {"OPENBLAS_NUM_THREADS": "1", "PYTHONWARNINGS": "ignore"}
        self.owner = os.getpid()
        self._timed_out = False
        self._process = subprocess.Popen(
            [sys.executable, "-P", worker.__file__],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            stderr=subprocess.DEVNULL,
            env=environment,
        )

    def ask(self, header: dict[str, Any], arrays: Arrays, seconds: float) -> tuple[dict[str, Any], Arrays]:
        """The answer. Raises `EOFError` where the process has ended, `TimeoutError` where it took too long."""
        requests, answers = self._process.stdin, self._process.stdout
        assert requests is not None
        assert answers is not None
        timer = threading.Timer(seconds, self._time_out)
        timer.daemon = True
        timer.start()
        try:
            worker.send(requests, header, arrays)
            return worker.receive(answers)
        except (EOFError, OSError):
            self.end()
            if self._timed_out:
                raise TimeoutError from None
            raise EOFError from None
        except BaseException:
            self.end()
            raise
        finally:
            timer.cancel()

    def _time_out(self) -> None:
        self._timed_out = True
        self._process.kill()

    def end(self) -> None:
        """End the process, now."""
        self._process.kill()
        self._process.wait()
        for stream in (self._process.stdin, self._process.stdout):
            if stream is not None:
                with suppress(OSError):  # what could not be sent any more
                    stream.close()


_lock = threading.Lock()
_kept: _Child | None = None


def ask(header: dict[str, Any], arrays: Arrays, *, seconds: float) -> tuple[dict[str, Any], Arrays]:
    """What the child answers to a request; see `qlb.mesh.worker`. A child is kept for the next request for a while.

    Raises:
        ChildRefused: it could not, it crashed, or it took longer than `seconds`.
    """
    global _kept
    with _lock:
        child, _kept = _kept, None
        used = child is not None and child.owner == os.getpid()
        try:
            try:
                answer, result = (child if used and child else (child := _Child())).ask(header, arrays, seconds)
            except EOFError:
                if not used:
                    raise
                child = _Child()  # the one before had gone, for it waits for a while only
                answer, result = child.ask(header, arrays, seconds)
        except EOFError:
            raise ChildRefused("its reader crashed") from None
        except TimeoutError:
            raise ChildRefused(f"it takes longer than {seconds:.0f} s") from None
        _kept = child
    if "refused" in answer:
        raise ChildRefused(answer["refused"])
    return answer, result


@atexit.register
def end() -> None:
    """End the child that is kept, if any."""
    global _kept
    if _kept is not None and _kept.owner == os.getpid():
        _kept.end()
    _kept = None
