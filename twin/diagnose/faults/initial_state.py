"""A run starts from another state than it says."""

from __future__ import annotations

from dataclasses import dataclass

from twin.diagnose.faults.context import Singly
from twin.diagnose.faults.fault import Family, Fault, Slot


@dataclass(frozen=True)
class Start(Fault):
    """What the state of one run begins with, whatever a history says."""

    def fill(self, slot: Slot) -> None:
        if slot.column.histories[slot.k] is not None:
            slot.slots.initial[slot.s] = slot.vector


FAULTS = (Start("initial_state", "start", "K", "runs.", 0, 0.2, 30.0, several=True),)

FAMILY = Family(
    15, "initial_state", "Initial temperature off",
    "The machine, or a part, was warmer or colder than the run says: yesterday's heat.",
    "T(0)", "decays with the model's own time constants from the first minute on", "0.2 K", "either",
    "the machine and every part, in every run", "reading", Singly(FAULTS), what="initial temperature off",
)  # fmt: skip
