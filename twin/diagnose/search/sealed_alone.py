"""What a sealed run holds that none of the diagnosed runs has: no verdict is on it, but a note."""

from __future__ import annotations

from collections.abc import Iterator, Sequence

import numpy as np

from twin.diagnose.model.study import COMPONENTS
from twin.diagnose.result.diagnosis import Series
from twin.diagnose.result.numbers import quantity, rms
from twin.diagnose.search.policy import SearchPolicy


def sealed_alone(series: Sequence[Series], policy: SearchPolicy) -> list[str]:
    """A note for every sealed run in which a channel is left more than `policy.elsewhere` times as much (rms) as in any
    diagnosed run, of the channel of which most."""
    known: dict[str, float] = {}
    for s in (s for s in series if not s.sealed):
        for name, _, left in _left(s):
            known[name] = max(left, known.get(name, 0.0))
    notes = []
    for s in (s for s in series if s.sealed):
        times = [(left / known[name], name, unit, left) for name, unit, left in _left(s) if known.get(name, 0.0) > 0.0]
        most, name, unit, left = max(times, default=(0.0, "", "", 0.0))
        if most > policy.elsewhere:
            notes.append(
                f"{s.run}: effect absent from the other runs: residual of {name} {quantity(left, unit)} "
                f"(rms) here, at most {quantity(known[name], unit)} there; diagnose it as one of the runs"
            )
    return notes


def _left(s: Series) -> Iterator[tuple[str, str, float]]:
    """(channel, unit, rms) of what the model that is told leaves of a run."""
    for names, unit, residual in ((s.sensors, "K", s.extended), (COMPONENTS, "m", s.tcp_extended)):
        for name, values in zip(names, np.asarray(residual).T, strict=False):
            if np.isfinite(values).any():
                yield name, unit, float(rms(values))
