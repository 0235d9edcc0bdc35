"""The air differs from where it is measured: of an environment, at a film, with height."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.evidence.batch import Batch
from twin.diagnose.faults.context import Context, always, of_stretches, single, stretches
from twin.diagnose.faults.elements import pivot
from twin.diagnose.faults.fault import Described, Family, Fault, Slot
from twin.diagnose.model.study import Study

WARMEST = 20.0  # K: a hall in winter with its door open


@dataclass(frozen=True)
class Air(Fault):
    """All air of an environment."""

    def fill(self, slot: Slot) -> None:
        environments = [e.name for e in slot.study.probed.base.load_model.environments]
        slot.slots.environment[:, slot.s, environments.index(slot.unit.place)] = slot.shape


@dataclass(frozen=True)
class Gradient(Fault):
    """Warmer air above."""

    def described(self, study: Study, d: Described, a: np.ndarray, covariance: np.ndarray) -> Described:
        """About which height."""
        names = [e.name for e in study.probed.base.load_model.environments]
        return replace(d, settings={"height": pivot(study, names.index(self.bare(d.place)))})


SWITCHED = (
    Air("zone", "air", "K", "environment.", least=0.3, own=0.1, largest=WARMEST, everywhere=True),
    Fault("zone", "zone", "K", "films.", least=0.5, own=0.1, largest=WARMEST),
)
GRADIENT = Gradient(
    "zone", "gradient", "K/m", "environment.", least=0.3, own=0.1, largest=10.0, everywhere=True
)  # fmt: skip
FAULTS = (*SWITCHED, GRADIENT)


def batches(context: Context) -> list[Batch]:
    """Air of environments and films, draughts, gradients: always and in every window."""
    histories = of_stretches([always(context), *stretches(context)])
    switched = [batch for fault in SWITCHED for batch in fault.batches(context.blocks(fault), histories)]
    return [*switched, *single(context, GRADIENT)]


FAMILY = Family(
    6, "zone", "Environment temperature off",
    "The air differs from where it is measured: warmer above, warmer in a zone, a door, a draught.",
    "a h_f M_f z, or g(t) h_f M_f dT", "goes with height, or with a door's hours; many sensors of one zone alike",
    "0.3 K (0.5 K at one film), 0.3 K/m", "either", "every environment, film and gradient; always and every window",
    "machine", batches, what="environment temperature off",
)  # fmt: skip
