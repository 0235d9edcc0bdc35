"""What differs between two sets of golden values, in words."""

from __future__ import annotations

from collections.abc import Mapping
from typing import Any

import numpy as np


def differences(golden: Mapping[str, Any], now: Mapping[str, Any], tolerance: float) -> list[str]:
    """One line per value that is not the same: numbers within `tolerance` of their scale, all else equal."""
    lines = [f"{name}: is gone" for name in golden if name not in now]
    lines += [f"{name}: is new" for name in now if name not in golden]
    for name in golden:
        if name in now and (what := _difference(golden[name], now[name], tolerance)):
            lines.append(f"{name}: {what}")
    return lines


def _difference(old: Any, new: Any, tolerance: float) -> str:
    if not (_numeric(old) and _numeric(new)):
        return "" if old == new else f"{_short(old)} has become {_short(new)}"
    if old["shape"] != new["shape"]:
        return f"shape {old['shape']} has become {new['shape']}"
    a, b = (np.array(v["values"], dtype=float) for v in (old, new))  # None: nan
    if not np.array_equal(np.isfinite(a), np.isfinite(b)):
        return "other numbers are missing"
    off = np.nan_to_num(np.abs(b - a))
    worst = int(np.argmax(off)) if off.size else 0
    if not off.size or off[worst] <= tolerance * old["scale"]:
        return ""
    relative = off[worst] / old["scale"] if old["scale"] else np.inf
    return f"off by {relative:.1e} of its scale, number {worst}: {a[worst]!r} has become {b[worst]!r}"


def _numeric(value: Any) -> bool:
    return isinstance(value, dict) and "values" in value


def _short(value: Any) -> str:
    text = repr(value)
    return text if len(text) < 80 else f"{text[:77]}..."
