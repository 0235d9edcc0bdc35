"""Whether two models are the same one: equal in every number, name and place."""

from __future__ import annotations

from dataclasses import fields, is_dataclass, replace
from typing import Any

import numpy as np

from twin.rom.model import MachineModel


def same_model(a: MachineModel, b: MachineModel) -> bool:
    """True where both step and read alike, to the last bit; rows for pictures, which artefacts keep apart, aside."""
    return _equal(*(replace(m, bodies=tuple(replace(body, F=None, V=None) for body in m.bodies)) for m in (a, b)))


def _equal(a: Any, b: Any) -> bool:
    if isinstance(a, np.ndarray) and isinstance(b, np.ndarray):
        return a.dtype == b.dtype and np.array_equal(a, b)
    if type(a) is not type(b):
        return False
    if is_dataclass(a):
        return all(_equal(getattr(a, f.name), getattr(b, f.name)) for f in fields(a))
    if isinstance(a, tuple | list):
        return len(a) == len(b) and all(map(_equal, a, b))
    return bool(a == b)
