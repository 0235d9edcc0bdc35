"""How long work reports itself: a stage with a known number of steps."""

from __future__ import annotations

import sys
from collections.abc import Callable, Iterator
from contextlib import AbstractContextManager, contextmanager
from typing import TextIO

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


def bar(label: str, steps: int) -> AbstractContextManager[Advance]:
    """A progress bar on a terminal, one line per stage elsewhere; on standard output."""
    return _bar(label, steps, None)


def error_bar(label: str, steps: int) -> AbstractContextManager[Advance]:
    """The same on standard error, which leaves a program's output alone."""
    return _bar(label, steps, sys.stderr)


@contextmanager
def _bar(label: str, steps: int, file: TextIO | None) -> Iterator[Advance]:
    with click.progressbar(
        length=steps, label=f"{label:<28}", item_show_func=lambda detail: detail or "", width=24, file=file
    ) as progress:

        def advance(detail: str) -> None:
            if _interrupted:
                raise KeyboardInterrupt
            progress.update(1, detail[:60])

        yield advance


def reporter(progress: Progress | bool | None) -> Progress:
    """What a `progress` argument asks for: True a bar, False nothing, None a bar where standard error is a terminal."""
    if callable(progress):
        return progress
    if progress is None:
        progress = sys.stderr is not None and sys.stderr.isatty()
    return error_bar if progress else silent
