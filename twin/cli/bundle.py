"""Options of a command as one object of the face: click hands them over by name."""

from __future__ import annotations

import functools
from collections.abc import Callable
from dataclasses import fields
from typing import Any, TypeVar

R = TypeVar("R")


def bundled(load: Callable[[], type[Any]]) -> Callable[[Callable[..., R]], Callable[..., R]]:
    """Give a command its options as one argument `options`, a dataclass; those that are no fields stay arguments.

    load: gives the dataclass; it is called with the command, so that --help imports nothing.
    """

    def decorate(function: Callable[..., R]) -> Callable[..., R]:
        @functools.wraps(function)
        def called(**values: Any) -> R:
            kind = load()
            names = {f.name for f in fields(kind)} & set(values)
            return function(options=kind(**{n: values.pop(n) for n in names}), **values)

        return called

    return decorate
