"""A joint or contact conducts otherwise than described, always or since an event; or with a speed (`paths`)."""

from __future__ import annotations

from dataclasses import dataclass

from twin.diagnose.evidence.batch import Batch
from twin.diagnose.faults.context import Context, always, of_stretches, to_the_end
from twin.diagnose.faults.fault import Curve, Family, Fault, Slot
from twin.diagnose.result.diagnosis import Cause

RANGE = 9.0  # conductances of joints scatter by a decade with pressure and roughness


@dataclass(frozen=True)
class Conductance(Fault):
    """Of a joint between faces that do not move, or of a contact that moves."""

    def fill(self, slot: Slot) -> None:
        load = slot.study.probed.base.load_model
        names = [j.name for j in load.joints] if self.kind == "joint" else load.contacts
        getattr(slot.slots, self.kind)[:, slot.s, names.index(slot.unit.place)] = slot.shape


FAULTS = tuple(
    Conductance(
        "joint", kind, "1", "contacts.", least=0.3, curve=Curve.RELATIVE, conducts=True, bent=True, grows=False,
        largest=RANGE,
    )
    for kind in ("joint", "contact")
)  # fmt: skip


def batches(context: Context) -> list[Batch]:
    """Every contact: always, and from every hour on."""
    histories = of_stretches([always(context), *to_the_end(context)])
    return [batch for fault in FAULTS for batch in fault.batches(context.blocks(fault), histories)]


def with_a_speed(cause: Cause) -> bool:
    return bool(cause.signal)


FAMILY = Family(
    5, "joint", "Joint conductance wrong or lost",
    "A joint or guide conducts otherwise than described, perhaps since an event: preload lost, oil film gone; or the "
    "more the faster something turns.",
    "-kappa g(t) d d^T x", "residuals of opposite sign on both sides", "30 % of a conductance", "either",
    "every contact; always, and from every hour on; once anything is out of order, with every speed", "machine",
    batches,
    what="wrong joint conductance", times="times the declared", declared=True,
    last=with_a_speed,
)  # fmt: skip
