"""Independent pieces of work over the cores of this computer: equal results in equal order, whatever their number.

Stepping a reduced model is thousands of small matrix products: threads spend their time waiting for the interpreter
(measured: two threads are no faster than one), and a forked process may hang on a lock that a thread of JAX held.
So helpers are fresh Python processes, started once the work has proved long, that read pickles from a pipe. They do not
import the caller's script again, unlike `multiprocessing`. A helper ends with its pipe: nothing outlives the caller.
"""

from __future__ import annotations

import importlib
import os
import pickle
import signal
import subprocess
import sys
import threading
import time
from collections.abc import Callable, Iterator, Sequence
from contextlib import suppress
from typing import Any, BinaryIO, Generic, TypeVar

from twin.errors import ModelError

T = TypeVar("T")
R = TypeVar("R")
MOST = 4  # processes; each holds a copy of the model
LONG = 6.0  # s of work left that pay for a helper, which takes two to start


def workers() -> int:
    """Processes that may work at once: $TWIN_WORKERS, or the cores this process may use, 4 at most."""
    wanted = os.environ.get("TWIN_WORKERS", "")
    if wanted:
        if not wanted.isdecimal() or int(wanted) < 1:
            raise ModelError(f"'{wanted}' is no number of processes", "TWIN_WORKERS", "give 1, 2, ...")
        return int(wanted)
    cores = len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    return min(cores, MOST)


def each(
    function: Callable[[Any, T], R],
    shared: Any,
    items: Sequence[T],
    progress: Callable[[T], None] = lambda _: None,
    long: float = LONG,
    done: Callable[[T, R], None] = lambda _, __: None,
) -> list[R]:
    """[function(shared, item) for item in items], by several processes where that takes long.

    function: of a module's top level; it must not depend on anything but its arguments, nor change `shared`. shared:
    sent to every helper once. Everything is pickled. progress, done: called here, in the order of completion, the
    latter with the result. long: s of work left that are worth a helper (0: at once). Exceptions of a piece are raised
    here; helpers are gone in any case.
    """
    work = _Work(function, shared, items)

    def told(i: int) -> None:
        progress(items[i])
        done(items[i], work.results[i])

    began = time.perf_counter()
    try:
        if long <= 0.0:
            work.call_helpers(len(items))
        while (i := work.take()) is not None:
            work.results[i] = function(shared, items[i])
            told(i)
            ahead = len(items) - i - 1
            if not work.helpers and ahead > 1 and (time.perf_counter() - began) / (i + 1) * ahead > long:
                work.call_helpers(ahead)
            work.report(told)
        work.wait()
        work.report(told)
    finally:
        for helper in work.helpers:
            helper.close()
    if work.failed:
        raise work.failed[0]
    return [work.results[i] for i in range(len(items))]


class _Work(Generic[T, R]):
    """Pieces of work that this process and its helpers take one after the other."""

    def __init__(self, function: Callable[[Any, T], R], shared: Any, items: Sequence[T]) -> None:
        self._function, self._shared, self._items = function, shared, items
        self._todo, self._lock = iter(range(len(items))), threading.Lock()
        self._finished: list[int] = []  # by helpers, not yet reported
        self._threads: list[threading.Thread] = []
        self.helpers: list[_Helper] = []
        self.results: dict[int, R] = {}
        self.failed: list[BaseException] = []

    def take(self) -> int | None:
        """The next piece; None where none is left, or one has failed."""
        with self._lock:
            return None if self.failed else next(self._todo, None)

    def call_helpers(self, left: int) -> None:
        """As many as there are cores and pieces of work besides this process and its next piece."""
        if (more := min(workers(), left) - 1) < 1:
            return
        # pickled before the threads start: what the pieces of this thread cache in `shared` would change it meanwhile
        opening = pickle.dumps((self._function.__module__, self._function.__qualname__, self._shared), protocol=5)
        self.helpers.extend(_Helper() for _ in range(more))
        self._threads.extend(threading.Thread(target=self._serve, args=(h, opening), daemon=True) for h in self.helpers)
        for thread in self._threads:
            thread.start()

    def _serve(self, helper: _Helper, opening: bytes) -> None:
        try:
            helper.begin(opening)
            while (i := self.take()) is not None:
                self.results[i] = helper.ask(self._items[i])
                self._finished.append(i)
        except BaseException as e:
            self.failed.append(e)

    def report(self, told: Callable[[int], None]) -> None:
        """What helpers have finished since the last report, in this thread."""
        while self._finished:
            told(self._finished.pop(0))

    def wait(self) -> None:
        """Until the helpers have finished."""
        for thread in self._threads:
            while thread.is_alive():
                thread.join(0.2)  # in turns: an interrupt must get through


class _Helper:
    """A process that answers pickles with pickles."""

    def __init__(self) -> None:
        # one thread each: the processes are the parallelism, and kernels of another width round otherwise
        one = dict.fromkeys(("OPENBLAS_NUM_THREADS", "MKL_NUM_THREADS", "OMP_NUM_THREADS", "TWIN_WORKERS"), "1")
        path = os.pathsep.join(p or os.getcwd() for p in sys.path)
        self._process = subprocess.Popen(
            [sys.executable, "-m", "twin.build.workers"],
            stdin=subprocess.PIPE,
            stdout=subprocess.PIPE,
            env=os.environ | one | {"PYTHONPATH": path},
        )

    def begin(self, opening: bytes) -> None:
        assert self._process.stdin is not None
        self._process.stdin.write(opening)
        self._process.stdin.flush()

    def send(self, message: Any) -> None:
        assert self._process.stdin is not None
        pickle.dump(message, self._process.stdin, protocol=5)
        self._process.stdin.flush()

    def ask(self, item: Any) -> Any:
        assert self._process.stdout is not None
        try:
            self.send(item)
            fine, answer = pickle.load(self._process.stdout)
        except (EOFError, BrokenPipeError, pickle.UnpicklingError) as e:
            raise ModelError(
                "a process that helped with the build has ended", "workers", "is memory short? try TWIN_WORKERS=1"
            ) from e
        if not fine:
            raise answer
        return answer

    def close(self) -> None:
        self._process.kill()
        for pipe in (self._process.stdin, self._process.stdout):
            with suppress(OSError):
                if pipe is not None:
                    pipe.close()
        self._process.wait()


def _serve(requests: BinaryIO, answers: BinaryIO) -> None:
    """The other end: (module, function, shared), then items, each answered by (True, result) or (False, exception)."""
    module, name, shared = pickle.load(requests)
    function = getattr(importlib.import_module(module), name)
    for item in _messages(requests):
        try:
            answer = (True, function(shared, item))
        except Exception as e:
            answer = (False, e)
        pickle.dump(answer, answers, protocol=5)
        answers.flush()


def _messages(stream: BinaryIO) -> Iterator[Any]:
    with suppress(EOFError):
        while True:
            yield pickle.load(stream)


if __name__ == "__main__":
    signal.signal(signal.SIGINT, signal.SIG_IGN)  # the caller is interrupted, and ends us
    out = os.fdopen(os.dup(1), "wb")
    os.dup2(2, 1)  # whatever prints must not garble the answers
    with suppress(EOFError, BrokenPipeError):
        _serve(sys.stdin.buffer, out)
