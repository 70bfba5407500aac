"""Cases on the workers of a dask.distributed scheduler, each still in a process of its own there."""

from __future__ import annotations

from collections.abc import Callable, Sequence
from functools import partial
from importlib import import_module
from queue import Empty, Queue
from time import monotonic
from typing import Any
from uuid import uuid4

from qlb.errors import InputError, MissingExtra
from qlb.studies.processes import Case, Update, run_cases

_CONNECT = 10.0  # s
_BETWEEN_LOOKS = 0.2  # s
_BETWEEN_QUESTIONS = 1.0  # s


def run_on_cluster(
    cases: Sequence[Case],
    *,
    scheduler: str,
    on_update: Callable[[Update], None],
    stop: Callable[[], bool],
) -> None:
    """Run cases on the workers of a scheduler, as many at a time as these have threads.

    The workers need the same qlb, and share the folders of the cases with this machine.

    Args:
        cases: what to run, each into its directory.
        scheduler: its address, such as tcp://host:8786.
        on_update: called in this thread at the end of each case.
        stop: asked all the time whether to end early; cases under way are then ended and stay half done.

    Raises:
        InputError: the scheduler cannot be reached.
        MissingExtra: dask.distributed is not installed.
    """
    if not cases:
        return
    client = _connect(scheduler)
    name, updates = f"qlb-sweep-{uuid4().hex}", Queue[Update]()
    end_early = _distributed().Event(name, client)
    futures = []
    try:
        for case in cases:
            future = client.submit(_run_one, case, name, key=f"{case.name}-{uuid4().hex}", pure=False)
            future.add_done_callback(partial(_hand_on, case, updates))
            futures.append(future)
        waiting = len(futures)
        while waiting and not stop():
            try:
                on_update(updates.get(timeout=_BETWEEN_LOOKS))
            except Empty:
                continue
            waiting -= 1
    finally:
        end_early.set()
        client.cancel(futures)
        client.close()


def _distributed() -> Any:
    try:
        return import_module("distributed")
    except ImportError as error:
        raise MissingExtra(f'a scheduler needs dask.distributed: pip install "qlb[sweep]" ({error})') from None


def _connect(scheduler: str) -> Any:
    """A client of the scheduler."""
    distributed = _distributed()
    try:
        return distributed.Client(scheduler, timeout=_CONNECT, set_as_default=False)
    except (OSError, ValueError, TimeoutError) as error:
        raise InputError(f"scheduler = {scheduler!r} cannot be reached: {error or type(error).__name__}") from None


def _hand_on(case: Case, updates: Queue[Update], future: Any) -> None:
    """The end of a case, in a thread of the client."""
    error = future.exception() if future.status == "error" else None
    if error is not None:
        updates.put(Update(case, "crashed", 0, f"{type(error).__name__}: {error}"))
    elif future.status == "finished":
        updates.put(future.result())


def _run_one(case: Case, name: str) -> Update:
    """On a worker: run a case; how it ended."""
    updates: list[Update] = []
    run_cases([case], processes=1, on_update=updates.append, stop=_Asked(name))
    ended = [update for update in updates if update.state != "step"]
    return ended[-1] if ended else Update(case, "crashed", 0, "stopped")


class _Asked:
    """Whether the one who started the sweep wants its end; asks the scheduler only now and then."""

    def __init__(self, name: str) -> None:
        self._event, self._last, self._answer = _distributed().Event(name), 0.0, False

    def __call__(self) -> bool:
        if monotonic() - self._last > _BETWEEN_QUESTIONS:
            self._last, self._answer = monotonic(), bool(self._event.is_set())
        return self._answer
