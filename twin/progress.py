"""How long work reports itself: a stage with a known number of steps."""

from __future__ import annotations

from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager

import click

# An interrupt that arrives inside a callback of the garbage collector (JAX has one) is printed and lost: the bar looks
# here too.
_interrupted = False


def interrupt(signal: int, frame: object) -> None:
    """A handler of SIGINT: KeyboardInterrupt now, and once more with the next advance of a bar if it got lost."""
    global _interrupted
    _interrupted = True
    raise KeyboardInterrupt


Advance = Callable[[str], None]
Progress = Callable[[str, int], AbstractContextManager[Advance]]


@contextmanager
def silent(label: str, steps: int) -> Iterator[Advance]:
    """No report; the default of every library function."""
    yield lambda _detail: None


@contextmanager
def bar(label: str, steps: int) -> Iterator[Advance]:
    """A progress bar on a terminal, one line per stage elsewhere."""
    with click.progressbar(
        length=steps, label=f"{label:<28}", item_show_func=lambda detail: detail or "", width=24
    ) as progress:

        def advance(detail: str) -> None:
            if _interrupted:
                raise KeyboardInterrupt
            progress.update(1, detail[:60])

        yield advance
