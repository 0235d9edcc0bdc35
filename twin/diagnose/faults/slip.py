"""A support or anchor slips, of the machine or of the measuring device: displacement lags its reversal by a play."""

from __future__ import annotations

from collections.abc import Callable
from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.faults.context import Singly
from twin.diagnose.faults.fault import Family, Fault
from twin.diagnose.faults.readings import play
from twin.diagnose.model.study import Study


@dataclass(frozen=True)
class Slip(Fault):
    """Of a component of the TCP."""

    def change(self, study: Study, states: Callable[[int], np.ndarray], name: str, size: float) -> np.ndarray:
        return size * play(study, states, self.kind, self.bare(name), abs(size))


SLIP = Slip(
    "slip", "slip", "m", "tcp.", 1, 1e-6, own=0.12, read=True, lasts=True,
    sizes=(1e-6, 2e-6, 6e-6, 9e-6, 13e-6, 20e-6), largest=1e-4,
)  # fmt: skip
# a fixing of the measuring device is moved by measurements alone: between them the machine turns back without it
FAULTS = (SLIP, replace(SLIP, kind="probed", called="when measured"))

FAMILY = Family(
    13, "slip", "Support or anchor slips",
    "Friction in a support holds the structure back until it slips: heating and cooling take different paths.",
    "play(w_thermal)", "displacement lags its own reversal by a fixed width; temperatures fit", "1 um", "positive",
    "every TCP component, of the machine and of the measuring device", "reading", Singly(FAULTS),
    what="slipping support or anchor",
)  # fmt: skip
