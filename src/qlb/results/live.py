"""A run shown in a browser while it goes: a small web server, in a process of its own, over the run's folder.

The run only writes its folder, as always; the server reads it when a page asks. It ends when its standard input does,
once open pages have seen the end of the run: so also after a kill of the process that started it.
"""

from __future__ import annotations

import json
import subprocess
import sys
from collections.abc import Callable
from contextlib import suppress
from http import HTTPStatus
from http.server import BaseHTTPRequestHandler, ThreadingHTTPServer
from pathlib import Path
from threading import Lock, Thread
from time import monotonic, sleep, thread_time
from typing import Any
from urllib.parse import parse_qs, urlsplit

from qlb.errors import InputError, QlbError
from qlb.results.page import PAGE_BYTES, SCRIPTS_MISSING, Animation, page_scripts, run_charts
from qlb.results.page.thinning import spread
from qlb.results.report import moving_parts, report_context, template
from qlb.results.run import Run
from qlb.results.wording import facts, title, verdict

HOST = "127.0.0.1"
MOST_FRAMES = 60
"""Frames in one answer: where more have come since the last, they are thinned out."""
_SECONDS_TO_SAY_GOODBYE = 12.0
_AWAY = 4.0
"""A page that has not asked for so long is taken for closed [s], but for its pause after a long answer."""
_PAUSE = 10.0
"""How much longer a page waits than an answer took of a core (web/src/live.ts)."""


class LiveView:
    """The process that shows a run; to be closed when the run has ended.

    Args:
        directory: the run, which has its marker, mesh and first frame.
        ready: called with the address, in another thread, when pages can be asked for.

    Raises:
        InputError: qlb was built without the scripts of pages.
    """

    def __init__(self, directory: Path, ready: Callable[[str], None]) -> None:
        require_scripts()
        command = [sys.executable, "-P", "-m", "qlb.results.live", str(directory)]
        pipe = subprocess.PIPE
        self._process = subprocess.Popen(command, stdin=pipe, stdout=pipe, text=True, start_new_session=True)
        Thread(target=self._announce, args=(ready,), daemon=True).start()

    def close(self) -> None:
        """Let the server end; waits for it, some seconds at most."""
        assert self._process.stdin is not None
        with suppress(OSError):
            self._process.stdin.close()
        try:
            self._process.wait(_SECONDS_TO_SAY_GOODBYE + 5)
        except subprocess.TimeoutExpired:
            self._process.kill()
            self._process.wait()

    def _announce(self, ready: Callable[[str], None]) -> None:
        assert self._process.stdout is not None
        with self._process.stdout as output:
            if address := output.readline().strip():
                ready(address)


def require_scripts() -> None:
    """Raise `InputError` where qlb was built without the scripts of pages."""
    if page_scripts(("viewer", "plots")) is None:
        raise InputError(f"a run cannot be shown while it goes. {SCRIPTS_MISSING}")


class LiveRun:
    """What pages are told of a run.

    Attributes:
        is_watched: whether an open page has yet to hear of the end of the run.
    """

    def __init__(self, directory: Path) -> None:
        self._expected = 0.0  # by the monotonic clock [s]: when an open page asks again at the latest
        self._directory = directory
        self._animation = Animation(Run(directory))
        self._lock = Lock()

    def page(self) -> str:
        """The report as it is now, which goes on to ask for more."""
        with self._lock:
            run = Run(self._directory)
            context = report_context(run, {}) | moving_parts({title(run): run}, most_bytes=PAGE_BYTES, live=True)
            self._expected = monotonic() + _SECONDS_TO_SAY_GOODBYE  # it has much to load
        return template("report.html.j2").render(context)

    def update(self, after: int) -> dict[str, Any]:
        """What is new since the frame of step `after` (web/src/data.ts)."""
        with self._lock:
            start = thread_time()
            run = Run(self._directory)
            summary = run.summary
            new = spread([step for step in run.frame_steps if step > after], MOST_FRAMES)
            word = verdict(run)
            running = summary["status"] == "running"
            headline = (
                f"Running: {summary['steps']} of {run.scene.get('steps', '?')} steps." if running else word.headline
            )
            answer = {
                "status": summary["status"],
                "headline": headline,
                "detail": "" if running else word.detail,
                "level": word.level,
                "facts": facts(summary),
                "chunk": self._animation.chunk(new) if new else None,
                "charts": run_charts(run),
                "failedSteps": summary["failed_steps"],
            }
            answer["seconds"] = seconds = thread_time() - start
            self._expected = monotonic() + _AWAY + _PAUSE * seconds if running else 0.0
        return answer

    @property
    def is_watched(self) -> bool:
        """Whether an open page has yet to hear of the end of the run."""
        return monotonic() < self._expected


class _Handler(BaseHTTPRequestHandler):
    """Answers pages of this machine."""

    live: LiveRun
    server_version = "qlb"

    def do_GET(self) -> None:
        """The page, or what is new for it."""
        if (self.headers.get("Host") or "").split(":")[0] not in (HOST, "localhost"):
            self.send_error(HTTPStatus.FORBIDDEN)
            return
        url = urlsplit(self.path)
        try:
            if url.path == "/":
                self._send(self.live.page(), "text/html")
            elif url.path == "/update":
                after = int(parse_qs(url.query).get("after", ["-1"])[0])
                self._send(json.dumps(self.live.update(after), allow_nan=False), "application/json")
            else:
                self.send_error(HTTPStatus.NOT_FOUND)
        except ValueError:
            self.send_error(HTTPStatus.BAD_REQUEST)
        except QlbError as error:
            self.send_error(HTTPStatus.SERVICE_UNAVAILABLE, explain=str(error))

    def log_message(self, format: str, *args: Any) -> None:
        """Nothing: the terminal is the run's."""

    def _send(self, text: str, kind: str) -> None:
        body = text.encode()
        self.send_response(HTTPStatus.OK)
        self.send_header("Content-Type", f"{kind}; charset=utf-8")
        self.send_header("Content-Length", str(len(body)))
        self.send_header("Cache-Control", "no-store")
        self.end_headers()
        self.wfile.write(body)


def serve(directory: Path) -> None:
    """Serve pages until standard input ends; says the address on standard output."""
    live = LiveRun(directory)
    handler = type("Handler", (_Handler,), {"live": live})
    with ThreadingHTTPServer((HOST, 0), handler) as server:
        server.daemon_threads = False  # the last answers go out whole
        Thread(target=server.serve_forever, daemon=True).start()
        print(f"http://{HOST}:{server.server_address[1]}/", flush=True)
        sys.stdin.read()
        deadline = monotonic() + _SECONDS_TO_SAY_GOODBYE
        while live.is_watched and monotonic() < deadline:
            sleep(0.05)
        server.shutdown()


if __name__ == "__main__":
    serve(Path(sys.argv[1]))
