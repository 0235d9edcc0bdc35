"""Drives of pieces of a step as the drive of the step: means over its time, flags that any piece raises.

Means of means, weighted by time, are what `twin.rom.drive.evaluate` makes of all samples at once, to rounding: dwell
times, powers and tables of laws are averages over time. So a step can be evaluated while its samples arrive.
"""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from twin.rom.drive import Drive
from twin.rom.following import Following

_MEANS = (
    "power", "contact_heat", "theta", "environment", "mean_position", "conductance", "weight", "square", "neighbour",
    "switched",
)  # fmt: skip


def joined(pieces: Sequence[Drive]) -> Drive:
    """One step out of pieces of one step each, of any lengths, that follow one another; positions of the last."""
    if len(pieces) == 1:
        return pieces[0]
    length = np.array([p.time[1] - p.time[0] for p in pieces])
    share = length / length.sum()

    def mean(values: Sequence[np.ndarray]) -> np.ndarray:
        """What is constant stays so to the last digit."""
        return np.asarray(values[0] + sum(s * (v - values[0]) for s, v in zip(share[1:], values[1:], strict=True)))

    def following(name: str) -> Following:
        own: list[Following] = [getattr(p, name) for p in pieces]
        outside = np.any([f.outside for f in own], axis=0)
        return replace(own[0], value=mean([f.value for f in own]), outside=outside)

    names = tuple(dict.fromkeys(name for p in pieces for name in p.flag_names))
    raised = [dict(zip(p.flag_names, p.flags[0], strict=True)) for p in pieces]
    means: dict[str, Any] = {
        n: mean([getattr(p, n) for p in pieces]) for n in _MEANS if getattr(pieces[0], n) is not None
    }
    return replace(
        pieces[-1],
        time=np.array([pieces[0].time[0], pieces[-1].time[1]]),
        films=following("films"),
        losses=following("losses"),
        flags=np.array([[any(r.get(name, False) for r in raised) for name in names]]),
        flag_names=names,
        **means,
    )
