"""Packages that are verbs of the Python face too: `twin.build(machine)` beside `twin.build.pipeline`.

Python binds the package `twin.build` to the name `build` of `twin` as soon as any of its modules is imported, so a
function of that name would vanish. The package itself is made callable instead.
"""

from __future__ import annotations

import importlib
import sys
from collections.abc import Callable
from types import ModuleType
from typing import Any


class Verb(ModuleType):
    # no docstring here: help() of the package shows that of the function
    def __call__(self, *args: Any, **kwargs: Any) -> Any:
        return _function(self)(*args, **kwargs)

    @property
    def __signature__(self) -> Any:
        import inspect

        return inspect.signature(_function(self))

    @property
    def __doc__(self) -> str | None:  # type: ignore[override]
        return _function(self).__doc__


def _function(verb: Verb) -> Callable[..., Any]:
    """The function of the same name: that of twin.build is twin.face.build.build."""
    name = verb.__name__.rpartition(".")[2]
    function: Callable[..., Any] = getattr(importlib.import_module(f"twin.face.{name}"), name)
    return function


def callable_package(name: str) -> None:
    """Let the package `name`, which is being imported, be called as the function of the face that has its name."""
    sys.modules[name].__class__ = Verb
