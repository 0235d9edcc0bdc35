"""Which channels a cause rests on: their shares of its statistic, and over how many of them it spreads.

With white residual r and response d of a cause, LR = d^T Pi r is a sum over channels, whose participation ratio (sum
s)^2 / sum s^2 is the number of them that carry it (Bell, Dean, Discuss. Faraday Soc. 50, 1970). It decides nothing.
"""

from __future__ import annotations

import numpy as np

from twin.diagnose.faults.table import fault_of
from twin.diagnose.model.study import COMPONENTS, Study
from twin.diagnose.result.place import Support
from twin.diagnose.search.accepted import jacobian, read_change, readings_columns
from twin.diagnose.search.look import Search


def support_of(found: Search) -> Support | None:
    """Of the first cause of a search; None without one, or where its response is of no channel."""
    if not found.accepted:
        return None
    detector, first, others = found.detector, found.accepted[0], found.accepted[1:]
    sizes = [(a.hypothesis, a.amplitude) for a in found.accepted]
    J = jacobian(detector, np.clip(found.x, -3.0, 3.0), sizes, closely=True)
    beside = [readings_columns(detector, a.hypothesis) for a in others]
    projector = detector.fitter.projector(J, np.hstack(beside) if beside else None)
    explained = read_change(detector, first.hypothesis, first.amplitude, found.x)
    explained = np.where(np.isfinite(found.residual), explained, 0.0)
    left = detector.whiten(found.residual)
    if fault_of(first.hypothesis).parameter:  # the residual is beside it, of others with it
        left = left + explained
    return _shared(detector.study, explained * projector(left))


def _shared(study: Study, rows: np.ndarray) -> Support | None:
    """From the terms (m,) of a statistic: channels that speak against a cause carry nothing of it."""
    total: dict[str, float] = {}
    for planned, T, w in study.split(rows):
        for names, values in ((planned.measured.sensors, T), (COMPONENTS, w)):
            for name, value in zip(names, values.sum(axis=0), strict=True) if len(values) else ():
                total[name] = total.get(name, 0.0) + float(value)
    return shared(total)


def shared(total: dict[str, float]) -> Support | None:
    """From what each channel contributes."""
    positive = {name: max(value, 0.0) for name, value in total.items()}
    whole = sum(positive.values())
    if not whole > 0.0:
        return None
    shares = {name: value / whole for name, value in positive.items()}
    ratio = 1.0 / sum(s**2 for s in shares.values())
    return Support(tuple(sorted(shares.items(), key=lambda s: -s[1])), ratio)
