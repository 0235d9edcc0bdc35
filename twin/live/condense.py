"""Fast records made quick to compute: what is not a position holds its mean over a window, and the heat is kept.

Currents, forces and torques become rms, speeds the mean of their magnitude, all others their mean, as
`twin unpack --mean` does (`twin.logs.compress`); missing values are left out. Positions stay as they are, record by
record: where pads dwell is exact. Heat within a window no longer follows the position; a window of a second is far
below a tenth of every time constant, within which averaging is admissible (paper 001, item 1.13).

What it saves are the tables of laws that follow a temperature: they are made anew whenever a signal changes.
"""

from __future__ import annotations

import math
from array import array
from collections.abc import Callable
from operator import mul

WINDOW = 1.0  # s
RMS = frozenset(("A", "N", "N*m"))
MAGNITUDE = frozenset(("m/s", "rad/s", "1/s"))


def condense(rows: array[float], units: tuple[str, ...], keep: frozenset[int], interval: float) -> None:
    """Rows (n * s) of s channels, `interval` [s] apart, in place. units: of the channels. keep: those left alone."""
    s = len(units)
    n, per = len(rows) // s, round(WINDOW / interval)
    if per < 2:
        return
    for k, unit in enumerate(units):
        if k in keep:
            continue
        mean = _of(unit)
        column = rows[k::s]
        for first in range(0, n, per):
            part = column[first : first + per]
            total = sum(part)
            good = part if total == total else array("d", [v for v in part if v == v])
            value = mean(good) if good else math.nan
            column[first : first + per] = array("d", [value]) * len(part)
        rows[k::s] = column


def _of(unit: str) -> Callable[[array[float]], float]:
    if unit in RMS:
        return lambda part: math.sqrt(sum(map(mul, part, part)) / len(part))
    if unit in MAGNITUDE:
        return lambda part: sum(map(abs, part)) / len(part)
    return lambda part: sum(part) / len(part)
