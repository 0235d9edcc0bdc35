"""A disk that is full, as far as this process can see."""

from __future__ import annotations

import resource
import signal
from collections.abc import Iterator
from contextlib import contextmanager


@contextmanager
def full_disk(size: int = 10_000) -> Iterator[None]:
    """Files cannot grow beyond `size` [bytes], as on a disk that is full.

    Not a fixture: the limit holds for the process, and pytest reports a test before it tears its fixtures down, so a
    session whose output goes to a file of more than that would die of it.
    """
    limits = resource.getrlimit(resource.RLIMIT_FSIZE)
    handler = signal.signal(signal.SIGXFSZ, signal.SIG_IGN)
    resource.setrlimit(resource.RLIMIT_FSIZE, (size, limits[1]))
    try:
        yield
    finally:
        resource.setrlimit(resource.RLIMIT_FSIZE, limits)
        signal.signal(signal.SIGXFSZ, handler)
