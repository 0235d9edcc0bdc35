"""Arrays within JSON: base64 of little-endian numbers, which a browser reads without parsing digits."""

from __future__ import annotations

import base64
from typing import Any

import numpy as np

_KINDS = {"f4": "<f4", "u4": "<u4", "i2": "<i2"}


def packed(values: np.ndarray, kind: str = "f4") -> dict[str, Any]:
    """{"shape", "kind", "data"} in C order; kind: f4, u4 or i2. Values that are no numbers stay so in f4 alone."""
    array = np.ascontiguousarray(values, dtype=_KINDS[kind])
    return {"shape": list(array.shape), "kind": kind, "data": base64.b64encode(array.tobytes()).decode("ascii")}


def unpacked(told: dict[str, Any]) -> np.ndarray:
    """The inverse."""
    return np.frombuffer(base64.b64decode(told["data"]), dtype=_KINDS[told["kind"]]).reshape(told["shape"])
