"""Pieces of work over processes of this computer, or over the workers of a Dask scheduler whose address is given.

    SCHEDULER=tcp://host:8786 make campaign

Workers run `dask worker ADDRESS --nthreads 1` in a clone of the same commit with the extra `cluster`. A piece whose
worker dies is given to another one, RETRIES times; its rows come back to the caller, who alone writes files.
"""

from __future__ import annotations

import os
from collections.abc import Callable, Sequence
from typing import Any, TypeVar

from twin.build.workers import each
from twin.errors import ModelError

T = TypeVar("T")
R = TypeVar("R")
RETRIES = 3  # a judgement: workers that die one after the other on one piece die of it


def scheduler() -> str:
    """The address of the Dask scheduler; empty without one."""
    return os.environ.get("SCHEDULER", "")


def spread(
    function: Callable[[Any, T], R],
    shared: Any,
    items: Sequence[T],
    done: Callable[[T, R], None],
    patience: float = 30.0,
) -> None:
    """`done(item, function(shared, item))` for every item, in the order of completion.

    function: of a module's top level, without any state. done: called here. patience: s, within which a scheduler must
    answer. Raises what a piece raises, ModelError where no scheduler answers, or `distributed` is not installed.
    """
    if not scheduler():
        each(function, shared, items, long=0.0, done=done)
        return
    try:
        from distributed import Client, as_completed
    except ImportError as e:
        raise ModelError("Dask is not installed", "SCHEDULER", "pip install 'twin[cluster]'") from e
    try:
        client = Client(scheduler(), timeout=patience)
    except (OSError, TimeoutError, ValueError) as e:
        raise ModelError(f"no scheduler answers: {e}", f"SCHEDULER={scheduler()}", "start `dask scheduler`") from e
    with client:
        (held,) = client.scatter([shared], broadcast=True)
        futures = {client.submit(function, held, item, retries=RETRIES, pure=False): item for item in items}
        for future in as_completed(futures):
            done(futures[future], future.result())
