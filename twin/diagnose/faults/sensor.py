"""A temperature sensor is at fault: offset, drift, lag, contact to the part lost, another part, two of them swapped."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.batch import Batch
from twin.diagnose.faults.context import Context, Singly, alone, of_stretches, to_the_end
from twin.diagnose.faults.fault import Family, Fault
from twin.diagnose.faults.sensor_readings import elsewhere, lagged
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause


@dataclass(frozen=True)
class Lag(Fault):
    """A sensor that follows late."""

    def change(self, study: Study, states: Callable[[int], np.ndarray], name: str, size: float) -> np.ndarray:
        return size * lagged(study, states, self.bare(name), max(size, self.least))


@dataclass(frozen=True)
class Elsewhere(Fault):
    """A sensor that is mounted on another part; its place is sensors.SENSOR>PLACE."""

    def prior(self, q: int) -> tuple[np.ndarray, np.ndarray]:
        """All that it shows is that place's, but for how the point where it sits differs from the mean there."""
        return np.ones(q), np.full(q, POINT**-2.0)

    def change(self, study: Study, states: Callable[[int], np.ndarray], name: str, size: float) -> np.ndarray:
        sensor, place = self.bare(name).split(">", 1)
        return size * elsewhere(study, states, sensor, place)


POINT = 0.2  # standard deviation of a point's rise over its surface's mean: a judgement, as `own` of misplaced heat
SHIFT = Fault("sensor", "shift", "K", "sensors.", 0, 0.3, 100.0, read=True, grows=False)
DRIFT = Fault("sensor", "drift", "K/day", "sensors.", 0, 0.1, 20.0, read=True)
SINGLE = (
    # K: a converter at its rail
    Fault("sensor", "offset", "K", "sensors.", 0, 0.15, 100.0, read=True, called="offset"),
    Lag(
        "sensor", "lag", "s", "sensors.", 1, 120.0, 7200.0, read=True, sizes=(200.0, 600.0, 1800.0, 5400.0),
        called="lag",
    ),
    # all of the reading is the air's; half as much again for the error of a fit
    Fault("sensor", "detached", "1", "sensors.", 1, 0.05, 1.5, read=True, called="detached"),
    # less than half: the place is its own
    Elsewhere(
        "sensor", "elsewhere", "1", "sensors.", 1, 0.5, 1.5, read=True, lasts=True, moves=True, beside=True,
        partner="mounted", own=0.2, called="mounted on another part",
    ),
    Fault("sensor", "swapped", "1", "sensors.", 1, 0.0, fixed=True, read=True, exchanges=True, called="swapped"),
)  # fmt: skip
FAULTS = (*SINGLE, DRIFT, SHIFT)


def batches(context: Context) -> list[Batch]:
    """Every sensor and every pair; offsets also from every hour on, in its run or for good, drifts also of one run."""
    rows: dict[str, list[int]] = {}
    for place, _, column in context.named(SHIFT.kind):
        rows.setdefault(place, []).append(column)
    since = [replace(h, name=f"offset {h.name}") for h in of_stretches(to_the_end(context))]
    drifts = [
        batch for history in dict.fromkeys(h for _, h, _ in context.named(DRIFT.kind))
        for batch in DRIFT.batches(
            context.rows(DRIFT, history), [alone(context, history, "drift" if history == "always" else "")]
        )
    ]  # fmt: skip
    return [*Singly(SINGLE)(context), *drifts, *SHIFT.batches(list(rows.items()), since)]


def said(cause: Cause) -> list[str]:
    """Of the quickest sensor a lag says as much of all; where one that sits elsewhere does."""
    if place := cause.settings.get("mounted"):
        return [f"the share of {place} in what it shows"]
    return ["as if it followed late, or as if all temperatures were logged late"] if cause.history == "lag" else []


FAMILY = Family(
    9, "sensor", "Temperature sensor at fault",
    "Offset, drift, lag, contact to the part lost, mounted on another part, stuck, or two sensors swapped. "
    "The machine model is left alone.",
    "y + a;  a t;  filter;  (1 - w) y + w T_air;  (1 - w) y + w T_place",
    "one channel only: neighbours and TCP agree with the model",
    "0.15 K, 0.1 K/day, 2 min, 5 %", "either",
    "every sensor, offsets also from every hour on, drifts in every run or one; every pair; every place of other parts",
    "sensor",
    batches, what="temperature sensor at fault", channel=True, kind_told=True, said=said,
)  # fmt: skip
