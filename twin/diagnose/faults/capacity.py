"""Stored heat that the description lacks: an oil tank, a workpiece, a fixture."""

from __future__ import annotations

from dataclasses import dataclass, replace

import numpy as np

from twin.diagnose.faults.context import Singly
from twin.diagnose.faults.fault import Family, Fault, Slot, as_found
from twin.diagnose.model.study import Study
from twin.diagnose.result.diagnosis import Cause
from twin.machine.effects.effect import Effect

RIGID = 300.0  # s: time constant of a capacity that the diagnosis attached rigidly


@dataclass(frozen=True)
class Capacity(Fault):
    """At a surface."""

    def fill(self, slot: Slot) -> None:
        b = slot.study.probed.B[slot.place]
        slot.slots.E[slot.s] = np.outer(b, b)


FAULTS = (Capacity("capacity", "capacity", "J/K", "", 1, 2000.0, own=0.1, bent=True, saturates=True),)


def edit(cause: Cause, study: Study) -> Effect:
    """Behind a conductance that makes it as good as rigid."""
    effect = as_found(cause, study)
    return replace(effect, settings={**effect.settings, "conductance": cause.amplitude / RIGID})


FAMILY = Family(
    14, "capacity", "Heat capacity wrong or missing",
    "An oil tank, a workpiece, a fixture takes part and is not described; or a body stores otherwise than declared.",
    "C_t x_t' = k (T_surface - x_t)", "an extra slow pole at one place", "2 kJ/K", "positive",
    "every surface; every declared capacity", "machine", Singly(FAULTS),
    what="wrong or missing heat capacity", times="times the declared", edit=edit,
)  # fmt: skip
