"""How far a correction may go, and how fast: always on, whatever computes it.

Both limits are of the offset of an axis anywhere in the workspace, in metres: of polynomials by the sum of the absolute
values of their coefficients, which no offset exceeds. So coefficients move straight to where they are to go, and a
limited correction is the computed one times a factor.
"""

from __future__ import annotations

import math
from dataclasses import dataclass

from twin.live.offsets import Form, Values, size


@dataclass(frozen=True)
class Limits:
    """Of an axis offset."""

    most: float  # m
    slew: float  # m/s
    period: float  # s: a step is never larger than slew * period, however long the one before is ago


def allowed(target: Values, limits: Limits, form: Form) -> tuple[Values, bool]:
    """The target within the absolute limit, and whether it had to be made smaller; not finite is neutral."""
    found, cut = [], False
    for values in target:
        large = size(values, form)
        if not math.isfinite(large):
            values, cut = (0.0,) * len(values), True
        elif large > limits.most:
            values, cut = tuple(v * (limits.most / large) for v in values), True
        found.append(values)
    return tuple(found), cut


def moved(now: Values, target: Values, elapsed: float, limits: Limits, form: Form) -> Values:
    """From `now` towards the target as far as the slew limit lets it in `elapsed` seconds; axis by axis."""
    most = limits.slew * min(max(elapsed, 0.0), limits.period)
    found = []
    for a, b in zip(now, target, strict=True):
        difference = tuple(q - p for p, q in zip(a, b, strict=True))
        large = size(difference, form)
        if large <= most:
            found.append(b)
        else:
            part = most / large
            found.append(tuple(p + part * d for p, d in zip(a, difference, strict=True)))
    return tuple(found)
