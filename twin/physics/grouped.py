"""Laws with many arguments: what belongs together travels in a frozen dataclass, and is named singly outside.

The description, the table and the runtime know every parameter of a law by its own name; the function of the law knows
a channel, a winding or the bolts of a joint. `grouped` stands between the two.
"""

from __future__ import annotations

import inspect
from collections.abc import Callable
from dataclasses import fields, is_dataclass
from functools import wraps
from typing import Any, get_type_hints

Value = Any  # of an argument: a number, a numpy or a JAX array, in SI units


def grouped(law: Callable) -> Callable:
    """`law(speed, winding: Winding)` as a function of single names: f(speed, resistance, coefficient).

    An argument annotated with a dataclass is replaced by the fields of that dataclass, in their place and order; this
    is the signature of what is returned, and it may be called by position or by name.
    Raises TypeError, on the call, for arguments that are missing, unknown or given twice.
    """
    kinds: dict[str, Any] = {name: kind for name, kind in get_type_hints(law).items() if is_dataclass(kind)}
    names = {
        argument: [field.name for field in fields(kinds[argument])] if argument in kinds else [argument]
        for argument in inspect.signature(law).parameters
    }
    single = inspect.Signature(
        [inspect.Parameter(name, inspect.Parameter.POSITIONAL_OR_KEYWORD) for found in names.values() for name in found]
    )

    @wraps(law)
    def by_name(*given: Value, **named: Value) -> Value:
        values = single.bind(*given, **named).arguments
        return law(
            *(
                kinds[argument](*(values[name] for name in found)) if argument in kinds else values[argument]
                for argument, found in names.items()
            )
        )

    by_name.__signature__ = single  # type: ignore[attr-defined]
    return by_name
