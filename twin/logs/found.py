"""How findings about a log are told: where a row stands in its file, how often, and which slip a factor looks like."""

from __future__ import annotations

import math
from collections.abc import Sequence

import numpy as np

from twin.errors import Problem

_LISTED = 3
SLIPS = {  # factor: what it looks like
    60.0: "60: minutes for seconds",
    1000.0: "1000: milli",
    3600.0: "3600: hours for seconds",
    2.0 * math.pi: "2 pi: radians for revolutions",
    360.0: "360: degrees for revolutions",
    1e6: "1000000: micro",
    60000.0: "60000: mm/min for m/s",
    25.4: "25.4: inches for mm",
    1000.0 / 60.0: "1000/60: mm/s for m/min",
}


def at(path: str, rows: Sequence[int] | np.ndarray) -> str:
    """`path` with the lines of these rows; row 0 stands on line 2, under the header."""
    lines = [int(i) + 2 for i in rows[:_LISTED]]
    more = len(rows) - len(lines)
    if len(lines) == 1:
        return f"{path} (line {lines[0]})"
    return f"{path} (lines {', '.join(map(str, lines))}{f' and {more} more' if more else ''})"


def span(path: str, first: int, last: int) -> str:
    """`path` with the lines of rows first .. last."""
    return f"{path} (lines {first + 2} .. {last + 2})"


def warning(what: str, where: str, remedy: str) -> Problem:
    """Something worth a look that does not forbid results."""
    return Problem(what, where, remedy, warning=True)


def times(n: int) -> str:
    """ "once", "3 times"."""
    return "once" if n == 1 else f"{n} times"


def slip(ratio: float, tolerance: float = 0.1) -> str:
    """What a ratio, or its inverse, looks like: "60: minutes for seconds"; "" where it is like no usual slip."""
    if not (math.isfinite(ratio) and ratio > 0.0):
        return ""
    size = max(ratio, 1.0 / ratio)
    factor = min(SLIPS, key=lambda f: abs(math.log(size / f)))
    return SLIPS[factor] if abs(math.log(size / factor)) < math.log1p(tolerance) else ""


def held(values: np.ndarray) -> np.ndarray:
    """Values (n,) with the last finite one in place of each missing one, as runs take them; leading ones: the first."""
    finite = np.isfinite(values)
    if finite.all() or not finite.any():
        return values
    last = np.maximum.accumulate(np.where(finite, np.arange(len(values)), -1))
    return np.asarray(values[np.where(last < 0, np.argmax(finite), last)])
